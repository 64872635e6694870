#include "render/scene.h"

#include <cmath>

namespace penalty::render {
namespace {

Program scene_program(const GlApi& gl, SceneVariant variant) {
  return Program(gl, scene_vertex_shader(variant.kind), scene_fragment_shader(variant));
}

Program depth_program(const GlApi& gl, Kind kind) {
  return Program(gl, depth_vertex_shader(kind), depth_fragment_shader());
}

constexpr int floats(std::size_t bytes) { return static_cast<int>(bytes / sizeof(float)); }

template <class T>
void fill(const GlApi& gl, GLenum target, const std::vector<T>& data, GLenum usage) {
  gl.buffer_data(target, static_cast<GLsizeiptr>(data.size() * sizeof(T)), data.data(), usage);
}

}  // namespace

Scene::Scene(const GlApi& gl, int taps, bool single_pass)
    : gl_(gl),
      rigid_program_(scene_program(gl, {.kind = Kind::rigid, .taps = taps, .single_pass = single_pass})),
      ground_program_(scene_program(gl, {.kind = Kind::ground, .taps = taps, .single_pass = single_pass})),
      rigid_depth_(depth_program(gl, Kind::rigid)),
      surface_depth_(depth_program(gl, Kind::surface)) {
  for (const bool wire : {false, true})
    for (const bool mapped : {false, true})
      surface_programs_.push_back(scene_program(
          gl, {.kind = Kind::surface, .color_mapped = mapped, .wire = wire, .taps = taps, .single_pass = single_pass}));

  gl.gen_vertex_arrays(1, &empty_array_);
  gl.gen_vertex_arrays(1, &surface_array_);
  gl.gen_buffers(1, &surface_buffer_);
  gl.bind_vertex_array(surface_array_);
  gl.bind_buffer(GL_ARRAY_BUFFER, surface_buffer_);
  constexpr int stride = floats(sizeof(SurfaceVertex));
  set_attribute(gl, 0, 3, stride, 0);
  set_attribute(gl, 1, 3, stride, 3);
  set_attribute(gl, 2, 1, stride, 6);

  for (std::size_t shape = 0; shape < shapes_.size(); ++shape) {
    const RigidMesh mesh = shape == markers ? marker_mesh() : rigid_mesh(shape);
    Shapes& s = shapes_[shape];
    GLuint vertices = 0, indices = 0;
    gl.gen_vertex_arrays(1, &s.vertex_array);
    for (GLuint* buffer : {&vertices, &indices, &s.instances}) gl.gen_buffers(1, buffer);
    gl.bind_vertex_array(s.vertex_array);
    gl.bind_buffer(GL_ARRAY_BUFFER, vertices);
    fill(gl, GL_ARRAY_BUFFER, mesh.vertices, GL_STATIC_DRAW);
    for (int i = 0; i < 3; ++i) set_attribute(gl, i, 3, floats(sizeof(RigidVertex)), 3 * i);
    gl.bind_buffer(GL_ELEMENT_ARRAY_BUFFER, indices);
    fill(gl, GL_ELEMENT_ARRAY_BUFFER, mesh.indices, GL_STATIC_DRAW);
    s.indices = static_cast<GLsizei>(mesh.indices.size());
    gl.bind_buffer(GL_ARRAY_BUFFER, s.instances);
    for (int i = 0; i < 5; ++i) set_attribute(gl, 3 + i, 4, floats(sizeof(RigidInstance)), 4 * i, true);
  }
}

void Scene::upload(const Frame& frame, const UnitSpace& space) {
  surfaces_.clear();
  std::vector<SurfaceVertex> vertices;
  for (const SoftSurface& surface : frame.surfaces) {
    const auto first = static_cast<GLint>(vertices.size());
    append_surface(surface, frame.colors, space, vertices);
    const std::size_t program = (surface.values.size() != 0 ? 1 : 0) + (surface.wire ? 2 : 0);
    surfaces_.push_back({first, static_cast<GLsizei>(vertices.size()) - first, program, linear(surface.color)});
  }
  surface_vertices_ = static_cast<GLsizei>(vertices.size());
  gl_.bind_buffer(GL_ARRAY_BUFFER, surface_buffer_);
  fill(gl_, GL_ARRAY_BUFFER, vertices, GL_STREAM_DRAW);

  std::array<std::vector<RigidInstance>, markers + 1> instances;
  const auto place = [&](const RigidBody& body, std::size_t shape) {
    if (body.transform.allFinite()) instances[shape].push_back(rigid_instance(body, space));
  };
  for (const RigidBody& body : frame.bodies) place(body, body.shape.index());
  for (const Marker& marker : frame.markers)
    place({.shape = Sphere{marker.radius > 0 ? marker.radius : 0.014 * space.radius},
           .transform = at(marker.position),
           .color = marker.color,
           .two_tone = false},
          markers);
  for (std::size_t shape = 0; shape < shapes_.size(); ++shape) {
    shapes_[shape].count = static_cast<GLsizei>(instances[shape].size());
    gl_.bind_buffer(GL_ARRAY_BUFFER, shapes_[shape].instances);
    fill(gl_, GL_ARRAY_BUFFER, instances[shape], GL_STREAM_DRAW);
  }

  ground_.reset();
  floor_ = no_floor;
  if (frame.ground) {
    floor_ = static_cast<float>((*frame.ground - space.center.y()) / space.radius);
    // From below it would only hide what stands on it.
    if (frame.camera.eye.y() > *frame.ground) ground_ = floor_;
    const double spacing = grid_spacing(frame.camera);
    // Bold lines every 5 fine ones, or 4 of 5, 50, ...: then they lie at 5, 10 or 20.
    const double mantissa = spacing / std::pow(10.0, std::floor(std::log10(spacing) + 1e-9));
    grid_major_ = mantissa > 4 ? 4 : 5;
    grid_scale_ = static_cast<float>(space.radius / spacing);
    for (int i = 0; i < 2; ++i)
      grid_offset_[i] = static_cast<float>(std::fmod(space.center[2 * i] / spacing, static_cast<double>(grid_major_)));
  }
}

void Scene::draw_bodies() const {
  for (const Shapes& s : shapes_) {
    if (s.count == 0) continue;
    gl_.bind_vertex_array(s.vertex_array);
    gl_.draw_elements_instanced(GL_TRIANGLES, s.indices, GL_UNSIGNED_INT, nullptr, s.count);
  }
}

void Scene::draw_depth(const Eigen::Matrix4f& light) const {
  surface_depth_.use();
  surface_depth_.set("view_projection", light);
  gl_.bind_vertex_array(surface_array_);
  if (surface_vertices_ > 0) gl_.draw_arrays(GL_TRIANGLES, 0, surface_vertices_);
  rigid_depth_.use();
  rigid_depth_.set("view_projection", light);
  draw_bodies();
}

void Scene::set_view(const Program& program, const PassView& view) const {
  program.use();
  program.set("view_projection", view.view_projection);
  program.set("sun_matrix", view.sun_matrix);
  program.set("sky_matrix", view.sky_matrix);
  program.set("eye", view.eye);
  program.set("sun_direction", view.sun_direction);
  program.set("sky_direction", view.sky_direction);
  program.set("noise", view.noise);
  program.set("resolution", view.resolution);
  program.set("floor_height", floor_);
  program.set("bounce", floor_ > no_floor ? 1.f : 2.2f);
  program.set("sun_map", 0);
  program.set("sky_map", 1);
  program.set("sun_depth", 2);
  program.set("color_map", 3);
}

void Scene::draw(const PassView& view) const {
  gl_.bind_vertex_array(surface_array_);
  for (const Drawn& surface : surfaces_) {
    if (surface.count == 0) continue;
    const Program& program = surface_programs_[surface.program];
    set_view(program, view);
    program.set("plain_color", surface.color);
    gl_.draw_arrays(GL_TRIANGLES, surface.first, surface.count);
  }
  set_view(rigid_program_, view);
  draw_bodies();
  if (ground_) {  // last: most of it is hidden by then
    set_view(ground_program_, view);
    ground_program_.set("ground_height", *ground_);
    ground_program_.set("ground_radius", ground_radius);
    ground_program_.set("fade_radius", ground_radius);
    ground_program_.set("grid_scale", grid_scale_);
    ground_program_.set("grid_major", grid_major_);
    ground_program_.set("grid_offset", grid_offset_);
    gl_.bind_vertex_array(empty_array_);
    gl_.draw_arrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

}  // namespace penalty::render
