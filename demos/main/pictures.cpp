#include "main/pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "render/renderer.h"
#include "render/video.h"

namespace penalty::demo {
namespace {

constexpr Real figure_frames_per_second = 15;
const render::Color scenery{0.66f, 0.67f, 0.69f};

using render::Frame;
using render::Overlay;

struct DrawnShape {
  render::Shape operator()(const Ball& ball) const { return render::Sphere{ball.radius}; }
  render::Shape operator()(const Block& block) const { return render::Box{block.half_extents}; }
};

/// Turns recorded frames into what the renderer draws; everything but the camera is fixed for the clip.
class Stage {
 public:
  Stage(const Recording& recording, const RunOptions& options, const SceneSetup& setup)
      : recording_(recording), options_(options), setup_(setup) {
    for (const SoftObject& body : setup.bodies) triangles_.push_back(body.mesh.drawn_triangles());
    shows_energy_ = coloring(options, setup) == Coloring::energy;
    colors_.square_root = shows_energy_;
    colors_.high = setup.look.color_high && !shows_energy_ ? *setup.look.color_high : color_range();
  }

  Frame frame(const FrameRecord& record) const {
    Frame frame;
    frame.colors = colors_;
    if (setup_.ground) frame.ground = 0.0;
    for (std::size_t b = 0; b < record.bodies.size(); ++b) {
      const SoftRecord& body = record.bodies[b];
      const BodyMesh& mesh = setup_.bodies[b].mesh;
      frame.surfaces.push_back({.vertices = mesh.drawn(body.positions),
                                .triangles = body.triangles.empty() ? triangles_[b] : body.triangles,
                                .values = drawn_values(mesh, body.values),
                                .wire = setup_.look.wire && !mesh.surface});
      for (int i : setup_.bodies[b].pinned) frame.markers.push_back({.position = body.positions.col(i)});
    }
    for (std::size_t b = 0; b < record.objects.size(); ++b) {
      render::Transform transform;
      transform << record.objects[b].rotation, record.objects[b].position;
      const RigidObject& object = setup_.objects[b];
      frame.bodies.push_back({.shape = std::visit(DrawnShape(), object.shape),
                              .transform = transform,
                              .color = object.scenery ? scenery : render::palette(static_cast<int>(b)),
                              .two_tone = !object.scenery});
    }
    return frame;
  }

  Overlay overlay(const FrameRecord& record) const {
    Overlay overlay;
    overlay.title = setup_.title;
    for (const Restart& restart : setup_.restarts)
      if (restart.time < record.time + 1e-9) overlay.title = setup_.title + ": " + restart.name;
    char time[32];
    std::snprintf(time, sizeof time, "t = %.2f s", record.time);
    overlay.subtitle = {time, num_elements(),
                        std::string(name_of(options_.world)) + " world, " + std::string(bullet_precision())};
    overlay.color_bar =
        shows_energy_
            ? render::ColorBar{std::string("strain energy\ndensity [") + unit_name() + (is_shell() ? "/m²]" : "/m³]"),
                               unit()}
            : render::ColorBar{"mean |C|\nof lengths", 1};
    overlay.inset = curves(record.time);
    return overlay;
  }

 private:
  bool is_shell() const { return setup_.bodies.front().mesh.is_shell(); }

  std::string num_elements() const {
    std::size_t count = 0;
    for (std::size_t b = 0; b < triangles_.size(); ++b)
      count += is_shell() ? triangles_[b].size() : setup_.bodies[b].mesh.tetrahedra().size();
    return std::to_string(count) + (is_shell() ? " triangles" : " tetrahedra");
  }

  static Eigen::VectorXd drawn_values(const BodyMesh& mesh, const Eigen::VectorXd& values) {
    if (!mesh.surface) return values;
    const EmbeddedSurface& embedded = *mesh.surface;
    Eigen::VectorXd drawn = Eigen::VectorXd::Zero(embedded.weights.cols());
    for (Eigen::Index v = 0; v < drawn.size(); ++v)
      for (int k = 0; k < 4; ++k) drawn[v] += embedded.weights(k, v) * values[embedded.stencils[v][k]];
    return drawn.cwiseMax(0);
  }

  /// The highest value that most of the vertices reach at some time: single ones would leave the rest in the dark.
  double color_range() const {
    double high = 0;
    for (const FrameRecord& frame : recording_.frames) {
      std::vector<double> values;
      for (const SoftRecord& body : frame.bodies) values.insert(values.end(), body.values.begin(), body.values.end());
      const auto rank = values.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), rank, values.end());
      if (std::isfinite(*rank)) high = std::max(high, *rank);
    }
    return high > 0 ? high : 1;
  }

  double unit() const { return colors_.high >= 1e6 ? 1e6 : colors_.high >= 1e3 ? 1e3 : 1; }
  std::string unit_name() const { return colors_.high >= 1e6 ? "MJ" : colors_.high >= 1e3 ? "kJ" : "J"; }

  /// The largest energy; of a body that is put into impossible shapes, what it has left a moment later.
  double energy_range() const {
    double high = 0;
    const Real moment = setup_.restarts.empty() ? 0 : 0.25;  // [s]
    std::size_t restart = 0;
    for (const StepRecord& step : recording_.steps) {
      while (restart + 1 < setup_.restarts.size() && step.time > setup_.restarts[restart + 1].time) ++restart;
      if (moment > 0 && step.time < setup_.restarts[restart].time + moment) continue;
      high = std::max({high, step.energies.elastic, step.energies.kinetic});
    }
    return high;
  }

  render::Inset curves(Real until) const {
    const double high = energy_range();
    const double scale = high >= 1e4 ? 1e3 : 1;
    render::Inset inset{.title = scale > 1 ? "energy [kJ]" : "energy [J]", .series = {}};
    render::Series elastic{.name = "elastic", .color = render::palette(1), .x = {}, .y = {}};
    render::Series kinetic{.name = "kinetic", .color = render::palette(0), .x = {}, .y = {}};
    for (const StepRecord& step : recording_.steps) {
      if (step.time > until + 1e-9) break;
      elastic.x.push_back(step.time);
      elastic.y.push_back(std::min<double>(step.energies.elastic, high) / scale);
      kinetic.x.push_back(step.time);
      kinetic.y.push_back(step.energies.kinetic / scale);
    }
    inset.series = {elastic, kinetic};
    inset.x_high = std::max(recording_.steps.back().time, 1e-9);
    inset.y_high = high > 0 ? 1.05 * high / scale : 1;
    return inset;
  }

  const Recording& recording_;
  const RunOptions& options_;
  const SceneSetup& setup_;
  std::vector<std::vector<Triangle>> triangles_;  // of each body
  render::ColorScale colors_;
  bool shows_energy_ = true;
};

render::Metadata metadata(const RunOptions& options, const Recording& recording, const SceneSetup& setup) {
  char parameters[160];
  std::snprintf(parameters, sizeof parameters, "scene %s, world %s, rate %g Hz, seed %u", options.scene.c_str(),
                std::string(name_of(options.world)).c_str(), options.rate, recording.seed);
  return {{"Title", setup.title}, {"Description", parameters}, {"Software", "penalty-demo"}};
}

}  // namespace

std::string draw(const Recording& recording, const RunOptions& options, const SceneSetup& setup, const FramePlan& plan,
                 const std::filesystem::path& directory, const std::function<void(long)>& progress) {
  const Stage stage(recording, options, setup);
  const render::View view{
      .azimuth = setup.look.azimuth, .elevation = setup.look.elevation, .left = -0.62};  // beside the curves
  std::string remarks;

  const Real wanted = options.still.value_or(setup.look.still_time);
  const auto later = [wanted](const FrameRecord& a, const FrameRecord& b) {
    return std::abs(a.time - wanted) < std::abs(b.time - wanted);
  };
  const FrameRecord& moment =
      wanted < 0 ? recording.frames.back() : *std::min_element(recording.frames.begin(), recording.frames.end(), later);
  {
    render::Renderer renderer({.backend = options.backend, .quality = options.quality});
    Frame frame = stage.frame(moment);
    frame.camera = frame_camera(bounds_of(frame), renderer.aspect(), view);
    write_png(directory / (setup.name + ".png"), renderer.render(frame, stage.overlay(moment)),
              metadata(options, recording, setup));
    progress(1);
  }

  const bool finest = options.quality == render::Quality::still;
  render::Renderer renderer({.backend = options.backend, .quality = finest ? render::Quality::video : options.quality});
  render::Bounds bounds;
  if (setup.look.reach) {
    for (const SoftObject& body : setup.bodies) {
      const Eigen::Matrix3Xd& rest = body.mesh.vertices();
      const Vector3 low = rest.rowwise().minCoeff(), high = rest.rowwise().maxCoeff();
      bounds.add(Vector3((low + high) / 2), *setup.look.reach * (high - low).norm() / 2);
    }
  } else {
    for (const FrameRecord& record : recording.frames) bounds.add(bounds_of(stage.frame(record)));
  }
  const render::Camera camera = frame_camera(bounds, renderer.aspect(), view);
  render::VideoWriter video(directory / (setup.name + ".mp4"), renderer.width(), renderer.height(),
                            {.frames_per_second = plan.frames_per_second});
  long done = 1;
  for (const FrameRecord& record : recording.frames) {
    Frame frame = stage.frame(record);
    frame.camera = camera;
    video.add(renderer.render(frame, stage.overlay(record)));
    progress(++done);
  }
  video.finish();
  if (!video.encoded())
    remarks =
        "no ffmpeg: the frames are in " + video.frames_directory().string() + "; encode them with " + video.command();
  return remarks;
}

std::string draw(const std::vector<Figure>& figures, const RunOptions& options, Real duration,
                 const std::filesystem::path& directory, const std::function<void(long)>& progress) {
  long done = 0;
  {
    render::Renderer renderer({.backend = options.backend, .quality = options.quality});
    for (const Figure& figure : figures) {
      Frame frame = figure.frame;
      frame.camera = frame_camera(bounds_of(frame), renderer.aspect(), figure.view);
      write_png(directory / (figure.name + ".png"), renderer.render(frame, figure.overlay),
                {{"Title", figure.overlay.title}, {"Software", "penalty-demo"}});
      progress(++done);
    }
  }
  // Once round the first, at one distance: that from which all of it is seen from every side.
  const Figure& figure = figures.front();
  const bool finest = options.quality == render::Quality::still;
  render::Renderer renderer({.backend = options.backend, .quality = finest ? render::Quality::video : options.quality});
  render::VideoWriter video(directory / (figure.name + ".mp4"), renderer.width(), renderer.height(),
                            {.frames_per_second = figure_frames_per_second});
  const long frames = num_figure_frames(duration);
  const auto camera = [&](long k) {
    render::View view = figure.view;
    view.azimuth += 360.0 * static_cast<double>(k) / static_cast<double>(frames);
    return frame_camera(bounds_of(figure.frame), renderer.aspect(), view);
  };
  double distance = 0;
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  for (long k = 0; k < frames; ++k) {
    const render::Camera c = camera(k);
    distance = std::max(distance, (c.eye - c.target).norm());
    target += c.target / static_cast<double>(frames);
  }
  for (long k = 0; k < frames; ++k) {
    Frame frame = figure.frame;
    frame.camera = camera(k);
    frame.camera.eye = target + distance * (frame.camera.eye - frame.camera.target).normalized();
    frame.camera.target = target;
    video.add(renderer.render(frame, figure.overlay));
    progress(++done);
  }
  video.finish();
  if (video.encoded()) return {};
  return "no ffmpeg: the frames are in " + video.frames_directory().string() + "; encode them with " + video.command();
}

long num_figure_frames(Real duration) { return std::clamp(std::lround(duration * figure_frames_per_second), 1L, 900L); }

}  // namespace penalty::demo
