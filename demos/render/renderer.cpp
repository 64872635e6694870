#include "render/renderer.h"

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <tuple>

#include "render/canvas.h"
#include "render/overlay.h"
#include "render/projection.h"
#include "render/scene.h"
#include "render/targets.h"

namespace penalty::render {
namespace {

RendererOptions checked(RendererOptions options) {
  if (options.width == 0 && options.height == 0)
    std::tie(options.width, options.height) = default_size(options.quality);
  if (options.samples == 0) options.samples = default_samples(options.quality);
  if (options.width <= 0 || options.height <= 0 || options.width > 8192 || options.height > 8192)
    throw std::invalid_argument("a picture of " + std::to_string(options.width) + " x " +
                                std::to_string(options.height) + " pixels: both must lie within 1 to 8192");
  if (options.samples < 1 || (options.samples > 1 && options.samples < 8) || options.samples > 4096)
    throw std::invalid_argument(std::to_string(options.samples) + " samples: must be 1, or 8 to 4096");
  return options;
}

void check(const Camera& camera) {
  if (!camera.eye.allFinite() || !camera.target.allFinite() || !camera.scene_center.allFinite() ||
      !((camera.eye - camera.target).norm() > 0) || !(camera.scene_radius > 0) || !std::isfinite(camera.scene_radius))
    throw std::invalid_argument("the camera needs an eye away from its target, and a scene radius");
  if (!(camera.field_of_view >= 1 && camera.field_of_view <= 120))
    throw std::invalid_argument("the camera's field of view must lie within 1 to 120 degrees");
}

/// The fewer the passes, the more each has to smooth its shadows by itself.
int taps_for(int samples) { return samples == 1 ? 12 : samples < 64 ? 4 : 1; }

/// Texels along a side of the sun's and the sky's shadow map: the wider the filter, the fewer are needed.
std::pair<int, int> shadow_sides(int samples) {
  if (samples == 1) return {1024, 512};
  return samples < 64 ? std::pair{1024, 1024} : std::pair{2048, 2048};
}

/// All that lives on the graphics side. Made and used while its context is current.
class Studio {
 public:
  Studio(const GlApi& gl, const RendererOptions& options, const FontAtlas& fonts);
  Image render(const Frame& frame, const Overlay& overlay);

 private:
  void draw_shadows(const PassView& view);
  void draw_pass(const PassView& view);
  void cover(const Target& target, const Program& program, GLuint texture);
  void draw_overlay_on(const Target& target, const Overlay& overlay, const ColorScale& colors);
  void load_color_map(ColorMap map);
  Image read_back() const;
  Eigen::Vector2f resolution() const { return Eigen::Vector2i(width_, height_).cast<float>(); }

  const GlApi& gl_;
  const FontAtlas& fonts_;
  int width_, height_;
  std::vector<Sample> samples_;
  Scene scene_;
  Program backdrop_, accumulate_, develop_, letters_;
  Targets targets_;
  GLuint color_map_ = 0, glyphs_ = 0, empty_array_ = 0, canvas_array_ = 0, canvas_buffer_ = 0;
};

Studio::Studio(const GlApi& gl, const RendererOptions& options, const FontAtlas& fonts)
    : gl_(gl),
      fonts_(fonts),
      width_(options.width),
      height_(options.height),
      samples_(sample_set(options.samples)),
      scene_(gl, taps_for(options.samples), options.samples == 1),
      backdrop_(gl, full_screen_vertex_shader(), backdrop_fragment_shader()),
      accumulate_(gl, full_screen_vertex_shader(), accumulate_fragment_shader()),
      develop_(gl, full_screen_vertex_shader(), develop_fragment_shader()),
      letters_(gl, overlay_vertex_shader(), overlay_fragment_shader()),
      targets_(gl, width_, height_, shadow_sides(options.samples), options.samples == 1,
               taps_for(options.samples) == 1) {
  gl.pixel_storei(GL_UNPACK_ALIGNMENT, 1);
  gl.pixel_storei(GL_PACK_ALIGNMENT, 1);
  glyphs_ = make_texture(gl, fonts.side(), fonts.side(), byte_red, fonts.coverage().data(), GL_LINEAR);
  color_map_ = make_texture(gl, 256, 1, float_rgb, nullptr, GL_LINEAR);
  gl.gen_vertex_arrays(1, &empty_array_);
  gl.gen_vertex_arrays(1, &canvas_array_);
  gl.gen_buffers(1, &canvas_buffer_);
  gl.bind_vertex_array(canvas_array_);
  gl.bind_buffer(GL_ARRAY_BUFFER, canvas_buffer_);
  constexpr int stride = sizeof(CanvasVertex) / sizeof(float);
  set_attribute(gl, 0, 2, stride, 0);
  set_attribute(gl, 1, 2, stride, 2);
  set_attribute(gl, 2, 4, stride, 4);
  set_attribute(gl, 3, 1, stride, 8);
  require_no_error(gl, "setting up the renderer");
}

void Studio::load_color_map(ColorMap map) {
  std::vector<float> texels;
  for (int i = 0; i < 256; ++i) {
    const Color color = linear(map_color(map, i / 255.0));
    texels.insert(texels.end(), {color.x(), color.y(), color.z()});
  }
  gl_.bind_texture(GL_TEXTURE_2D, color_map_);
  gl_.tex_sub_image_2d(GL_TEXTURE_2D, 0, 0, 0, 256, 1, GL_RGB, GL_FLOAT, texels.data());
}

void Studio::draw_shadows(const PassView& view) {
  gl_.enable(GL_DEPTH_TEST);
  gl_.enable(GL_POLYGON_OFFSET_FILL);
  gl_.polygon_offset(1.5f, 2);
  draw_into(gl_, targets_.sun, GL_DEPTH_BUFFER_BIT);
  scene_.draw_depth(view.sun_matrix);
  draw_into(gl_, targets_.sky, GL_DEPTH_BUFFER_BIT);
  scene_.draw_depth(view.sky_matrix);
  gl_.disable(GL_POLYGON_OFFSET_FILL);
}

void Studio::draw_pass(const PassView& view) {
  cover(targets_.pass, backdrop_, 0);
  gl_.clear(GL_DEPTH_BUFFER_BIT);
  gl_.enable(GL_DEPTH_TEST);
  const GLuint textures[4] = {targets_.sun.image, targets_.sky.image, targets_.sun.image, color_map_};
  const GLuint samplers[4] = {targets_.compared, targets_.compared, targets_.plain, 0};
  for (GLuint unit = 0; unit < 4; ++unit) {
    gl_.active_texture(GL_TEXTURE0 + unit);
    gl_.bind_texture(GL_TEXTURE_2D, textures[unit]);
    gl_.bind_sampler(unit, samplers[unit]);
  }
  scene_.draw(view);
  for (GLuint unit = 0; unit < 4; ++unit) gl_.bind_sampler(unit, 0);
  gl_.active_texture(GL_TEXTURE0);
}

/// Fills the target through the program, which may read one texture; blends if blending is on.
void Studio::cover(const Target& target, const Program& program, GLuint texture) {
  draw_into(gl_, target, 0);
  gl_.disable(GL_DEPTH_TEST);
  program.use();
  gl_.bind_texture(GL_TEXTURE_2D, texture);
  gl_.bind_vertex_array(empty_array_);
  gl_.draw_arrays(GL_TRIANGLES, 0, 3);
}

void Studio::draw_overlay_on(const Target& target, const Overlay& overlay, const ColorScale& colors) {
  Canvas canvas(fonts_, width_, height_);
  draw_overlay(canvas, overlay, colors);
  if (canvas.vertices().empty()) return;
  draw_into(gl_, target, 0);
  gl_.disable(GL_DEPTH_TEST);
  gl_.enable(GL_BLEND);
  gl_.blend_func(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  letters_.use();
  letters_.set("resolution", resolution());
  gl_.bind_texture(GL_TEXTURE_2D, glyphs_);
  gl_.bind_vertex_array(canvas_array_);
  gl_.bind_buffer(GL_ARRAY_BUFFER, canvas_buffer_);
  gl_.buffer_data(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(canvas.vertices().size() * sizeof(CanvasVertex)),
                  canvas.vertices().data(), GL_STREAM_DRAW);
  gl_.draw_arrays(GL_TRIANGLES, 0, static_cast<GLsizei>(canvas.vertices().size()));
  gl_.disable(GL_BLEND);
}

Image Studio::read_back() const {
  Image upside_down(width_, height_), image(width_, height_);
  gl_.bind_framebuffer(GL_FRAMEBUFFER, targets_.finished.framebuffer);
  gl_.read_pixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, upside_down.rgb.data());
  const std::size_t row = 3 * static_cast<std::size_t>(width_);
  for (int y = 0; y < height_; ++y) std::memcpy(&image.rgb[row * y], &upside_down.rgb[row * (height_ - 1 - y)], row);
  return image;
}

Image Studio::render(const Frame& frame, const Overlay& overlay) {
  const UnitSpace space{frame.camera.scene_center, frame.camera.scene_radius};
  scene_.upload(frame, space);
  load_color_map(frame.colors.map);
  if (targets_.sum.image) {
    gl_.clear_color(0, 0, 0, 0);
    draw_into(gl_, targets_.sum, GL_COLOR_BUFFER_BIT);
  }
  for (const Sample& sample : samples_) {
    const PassView view = pass_view(frame.camera, space, sample, resolution());
    draw_shadows(view);
    draw_pass(view);
    if (!targets_.sum.image) continue;
    accumulate_.use();
    accumulate_.set("weight", 1.f / static_cast<float>(samples_.size()));
    gl_.enable(GL_BLEND);
    gl_.blend_func(GL_ONE, GL_ONE);
    cover(targets_.sum, accumulate_, targets_.pass.image);
    gl_.disable(GL_BLEND);
  }
  if (targets_.resolved.image) {
    gl_.bind_framebuffer(GL_READ_FRAMEBUFFER, targets_.pass.framebuffer);
    gl_.bind_framebuffer(GL_DRAW_FRAMEBUFFER, targets_.resolved.framebuffer);
    gl_.blit_framebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  cover(targets_.finished, develop_, targets_.sum.image ? targets_.sum.image : targets_.resolved.image);
  draw_overlay_on(targets_.finished, overlay, frame.colors);
  Image image = read_back();
  require_no_error(gl_, "drawing a frame");
  return image;
}

}  // namespace

Quality quality_from_name(std::string_view name) {
  if (name == "preview") return Quality::preview;
  if (name == "video") return Quality::video;
  if (name == "still") return Quality::still;
  throw std::invalid_argument("unknown quality '" + std::string(name) + "': preview, video or still");
}

int default_samples(Quality quality) { return quality == Quality::preview ? 1 : quality == Quality::video ? 12 : 160; }

std::pair<int, int> default_size(Quality quality) {
  if (quality == Quality::preview) return {640, 360};
  return quality == Quality::video ? std::pair{960, 540} : std::pair{1280, 720};
}

struct Renderer::Impl {
  explicit Impl(const RendererOptions& given)
      : options(checked(given)),
        fonts(options.font_directory, Canvas::text_size * Canvas::scale_for(options.width, options.height),
              Canvas::title_size * Canvas::scale_for(options.width, options.height)),
        context(options.backend, options.libraries) {
    const Context::Current current(context);
    studio = std::make_unique<Studio>(context.gl(), options, fonts);
  }

  RendererOptions options;
  FontAtlas fonts;
  Context context;
  std::unique_ptr<Studio> studio;
};

Renderer::Renderer(const RendererOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Renderer::~Renderer() = default;

Image Renderer::render(const Frame& frame, const Overlay& overlay) {
  check(frame.camera);
  const Context::Current current(impl_->context);
  return impl_->studio->render(frame, overlay);
}

int Renderer::width() const { return impl_->options.width; }
int Renderer::height() const { return impl_->options.height; }
int Renderer::samples() const { return impl_->options.samples; }
std::string_view Renderer::backend_name() const { return impl_->context.backend_name(); }
const std::string& Renderer::description() const { return impl_->context.description(); }

}  // namespace penalty::render
