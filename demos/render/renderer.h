// Draws a Frame and its Overlay into an Image, without a screen.
//
//   using namespace penalty::render;
//   Renderer renderer({.quality = Quality::still});    // throws if the machine has no off-screen OpenGL
//   Frame frame;
//   frame.colors = {.map = ColorMap::turbo, .low = 0, .high = 1e4, .square_root = true};
//   frame.ground = 0.0;
//   frame.surfaces.push_back({.vertices = x, .triangles = triangles, .values = energy_density});
//   frame.bodies.push_back({.shape = Sphere{0.5}, .transform = at({0, 2, 0}), .color = palette(1)});
//   Bounds bounds;                                     // of a clip: of all its frames, before the first is drawn
//   bounds.add(bounds_of(frame));
//   frame.camera = frame_camera(bounds, renderer.aspect(), {.azimuth = 28, .elevation = 16});
//   Overlay overlay{.title = "Ball", .subtitle = {"t = 0.33 s"}, .color_bar = ColorBar{"density [kJ/m³]", 1e3}};
//   write_png("still.png", renderer.render(frame, overlay), {{"Title", "Ball"}});
//   VideoWriter video("clip.mp4", renderer.width(), renderer.height(), {.frames_per_second = 30});
//   video.add(renderer.render(frame, overlay));        // once a frame
//   video.finish();                                    // then, unless video.encoded(): see video.command()
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "render/context.h"
#include "render/image.h"
#include "render/picture.h"

namespace penalty::render {

/// How many passes are averaged into one picture: the only trade between time and looks.
enum class Quality { preview, video, still };

/// "preview", "video" or "still"; throws std::invalid_argument for anything else.
Quality quality_from_name(std::string_view name);

/// 1, 12 or 160 passes.
int default_samples(Quality quality);

/// Width and height: 640 x 360, 960 x 540 or 1280 x 720.
std::pair<int, int> default_size(Quality quality);

struct RendererOptions {
  Backend backend = Backend::automatic;
  Quality quality = Quality::preview;
  int width = 0, height = 0;  // both 0: default_size(quality)
  int samples = 0;            // 0: default_samples(quality); 1, or 8 and more (fewer would show each single shadow)
  std::filesystem::path font_directory = "/usr/share/fonts/truetype/dejavu";  // Debian package fonts-dejavu-core
  BackendLibraries libraries{};
};

class Renderer {
 public:
  /// Throws std::invalid_argument for an impossible size or number of samples, std::runtime_error without an
  /// off-screen OpenGL or without the fonts.
  explicit Renderer(const RendererOptions& options = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// The same frame gives the same pixels on one machine. Throws std::invalid_argument naming what is wrong with the
  /// frame (an index, a size, a camera of no extent), std::runtime_error if OpenGL reports an error.
  Image render(const Frame& frame, const Overlay& overlay = {});

  int width() const;
  int height() const;
  int samples() const;
  double aspect() const { return static_cast<double>(width()) / height(); }
  std::string_view backend_name() const;   // "osmesa" or "egl"
  const std::string& description() const;  // driver and OpenGL version

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace penalty::render
