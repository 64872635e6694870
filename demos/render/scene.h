// The bodies and the ground of a frame, on the graphics card: uploaded once a frame, drawn once a pass.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "render/gl_objects.h"
#include "render/picture.h"
#include "render/rigid_mesh.h"
#include "render/shaders.h"

namespace penalty::render {

/// What one pass sees; directions are unit vectors, positions in unit space.
struct PassView {
  Eigen::Matrix4f view_projection, sun_matrix, sky_matrix;
  Eigen::Vector3f eye, sun_direction, sky_direction;
  Eigen::Vector2f noise, resolution;
};

class Scene {
 public:
  /// `taps` and `single_pass` as in SceneVariant.
  Scene(const GlApi& gl, int taps, bool single_pass);

  /// Throws std::invalid_argument naming what is wrong with the frame.
  void upload(const Frame& frame, const UnitSpace& space);

  void draw_depth(const Eigen::Matrix4f& light) const;

  /// Shadow maps and colour map must be bound to texture units 0 to 3: sun (compared), sky (compared), sun (plain),
  /// colour map.
  void draw(const PassView& view) const;

  /// How far the ground reaches, in unit space: there it has become the backdrop.
  static constexpr float ground_radius = 9.4f;

 private:
  struct Drawn {  // a surface
    GLint first;
    GLsizei count;
    std::size_t program;
    Eigen::Vector3f color;
  };
  struct Shapes {  // all bodies of one shape
    GLuint vertex_array = 0, instances = 0;
    GLsizei indices = 0, count = 0;
  };
  void draw_bodies() const;
  void set_view(const Program& program, const PassView& view) const;

  const GlApi& gl_;
  std::vector<Program> surface_programs_;  // index: colour-mapped + 2 * wire
  Program rigid_program_, ground_program_, rigid_depth_, surface_depth_;
  GLuint surface_array_ = 0, surface_buffer_ = 0, empty_array_ = 0;
  static constexpr std::size_t markers = std::variant_size_v<Shape>;  // their place after the rigid shapes
  std::array<Shapes, markers + 1> shapes_;
  std::vector<Drawn> surfaces_;
  GLsizei surface_vertices_ = 0;
  std::optional<float> ground_;
  static constexpr float no_floor = -1e6f;
  float floor_ = no_floor;  // what throws light back from below
  float grid_scale_ = 1, grid_major_ = 5;
  Eigen::Vector2f grid_offset_{0, 0};
};

}  // namespace penalty::render
