#include "render/rigid_mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace penalty::render {
namespace {

constexpr int around = 64;  // segments of a full circle: 0.1 pixels from round at a radius of 90

RigidVertex vertex(const Eigen::Vector3f& core, const Eigen::Vector3f& direction, const Eigen::Vector3f& normal) {
  return {{core.x(), core.y(), core.z()},
          {direction.x(), direction.y(), direction.z()},
          {normal.x(), normal.y(), normal.z()}};
}

/// A strip of quads between rings `lower` and `upper` of around + 1 vertices each.
void join_rings(RigidMesh& mesh, std::uint32_t upper, std::uint32_t lower, std::uint32_t segments = around) {
  for (std::uint32_t i = 0; i < segments; ++i)
    mesh.indices.insert(mesh.indices.end(),
                        {upper + i, upper + i + 1, lower + i, upper + i + 1, lower + i + 1, lower + i});
}

Eigen::Vector3f on_circle(int i, float radius, float y, int segments = around) {
  const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(segments);
  return {radius * std::sin(turn), y, radius * std::cos(turn)};
}

/// Rings from pole to pole; with `parted`, the upper half hangs on core +y and the lower on -y (a capsule).
RigidMesh round(bool parted, int segments = around, int rings = 40) {
  RigidMesh mesh;
  std::uint32_t start = 0;
  const auto add_ring = [&](int ring, float core) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(ring) / static_cast<float>(rings);
    for (int i = 0; i <= segments; ++i) {
      const Eigen::Vector3f direction = on_circle(i, std::sin(angle), std::cos(angle), segments);
      mesh.vertices.push_back(vertex({0, core, 0}, direction, direction));
    }
    const auto count = static_cast<std::uint32_t>(segments + 1);
    if (start > 0) join_rings(mesh, start - count, start, count - 1);
    start += count;
  };
  for (int ring = 0; ring <= rings / 2; ++ring) add_ring(ring, parted ? 1.f : 0.f);
  for (int ring = parted ? rings / 2 : rings / 2 + 1; ring <= rings; ++ring) add_ring(ring, parted ? -1.f : 0.f);
  return mesh;
}

RigidMesh box() {
  RigidMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.f, 1.f}) {
      const Eigen::Vector3f normal = side * Eigen::Vector3f::Unit(axis);
      const Eigen::Vector3f u = Eigen::Vector3f::Unit((axis + 1) % 3), w = normal.cross(u);
      const auto start = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const auto& [a, b] : {std::pair{-1.f, -1.f}, {1.f, -1.f}, {1.f, 1.f}, {-1.f, 1.f}})
        mesh.vertices.push_back(vertex(normal + a * u + b * w, {0, 0, 0}, normal));
      mesh.indices.insert(mesh.indices.end(), {start, start + 1, start + 2, start, start + 2, start + 3});
    }
  return mesh;
}

/// A disc that closes the end y = `end` (1 or -1).
void add_lid(RigidMesh& mesh, float end) {
  const auto center = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(vertex({0, end, 0}, {0, 0, 0}, {0, end, 0}));
  for (int i = 0; i <= around; ++i) mesh.vertices.push_back(vertex({0, end, 0}, on_circle(i, 1, 0), {0, end, 0}));
  for (std::uint32_t i = 0; i < around; ++i) {
    const std::uint32_t a = center + 1 + i, b = a + 1;
    mesh.indices.insert(mesh.indices.end(), {center, end > 0 ? a : b, end > 0 ? b : a});
  }
}

RigidMesh cylinder() {
  RigidMesh mesh;
  for (const float end : {1.f, -1.f})
    for (int i = 0; i <= around; ++i) {
      const Eigen::Vector3f direction = on_circle(i, 1, 0);
      mesh.vertices.push_back(vertex({0, end, 0}, direction, direction));
    }
  join_rings(mesh, 0, around + 1);
  for (const float end : {1.f, -1.f}) add_lid(mesh, end);
  return mesh;
}

RigidMesh cone() {
  RigidMesh mesh;
  for (const float end : {1.f, -1.f})  // the tip once for each segment, so that it is as smooth as the rest
    for (int i = 0; i <= around; ++i) {
      const Eigen::Vector3f direction = on_circle(i, 1, 0);
      const Eigen::Vector3f normal = on_circle(i, static_cast<float>(Cone::slope), 1).normalized();
      mesh.vertices.push_back(vertex({0, end, 0}, (end < 0 ? 1.f : 0.f) * direction, normal));
    }
  join_rings(mesh, 0, around + 1);
  add_lid(mesh, -1);
  return mesh;
}

struct SizeOf {
  Eigen::Vector4d operator()(const Sphere& s) const { return {0, 0, 0, s.radius}; }
  Eigen::Vector4d operator()(const Box& b) const { return b.half_extents.homogeneous() - Eigen::Vector4d::UnitW(); }
  Eigen::Vector4d operator()(const Capsule& c) const { return {0, c.half_height, 0, c.radius}; }
  Eigen::Vector4d operator()(const Cylinder& c) const { return {0, c.half_height, 0, c.radius}; }
  Eigen::Vector4d operator()(const Cone& c) const { return {0, c.half_height(), 0, c.radius}; }
};

}  // namespace

RigidMesh rigid_mesh(std::size_t shape) {
  switch (shape) {
    case 0:
      return round(false);
    case 1:
      return box();
    case 2:
      return round(true);
    case 3:
      return cylinder();
    case 4:
      return cone();
    default:
      throw std::invalid_argument("unknown rigid shape");
  }
}

RigidMesh marker_mesh() { return round(false, 16, 10); }

RigidInstance rigid_instance(const RigidBody& body, const UnitSpace& space) {
  const Eigen::Vector4d size = std::visit(SizeOf{}, body.shape) / space.radius;
  const bool is_box = std::holds_alternative<Box>(body.shape);
  if (!size.allFinite() || size.minCoeff() < 0 || !((is_box ? size.head<3>().minCoeff() : size[3]) > 0))
    throw std::invalid_argument("a rigid body's size must be positive and finite");
  const Eigen::Vector3f position = space(body.transform.col(3));
  const Color color = linear(body.color);
  RigidInstance instance{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) instance.rows[i][j] = static_cast<float>(body.transform(i, j));
    instance.rows[i][3] = position[i];
    instance.color[i] = color[i];
  }
  for (int i = 0; i < 4; ++i) instance.size[i] = static_cast<float>(size[i]);
  instance.color[3] = body.two_tone ? 1.f : 0.f;
  return instance;
}

}  // namespace penalty::render
