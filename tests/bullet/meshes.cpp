#include "bullet/meshes.h"

#include <algorithm>

namespace penalty::testing {
namespace {

std::unique_ptr<btTriangleMesh> triangles_of(const MeshData& data) {
  auto mesh = std::make_unique<btTriangleMesh>();
  for (const auto& [a, b, c] : data.triangles)
    mesh->addTriangle(to_bullet(data.vertices[a]), to_bullet(data.vertices[b]), to_bullet(data.vertices[c]));
  return mesh;
}

}  // namespace

MeshData MeshData::turned() const {
  MeshData other = *this;
  for (auto& triangle : other.triangles) std::swap(triangle[1], triangle[2]);
  return other;
}

MeshData MeshData::shifted(const Vector3& shift) const {
  MeshData other = *this;
  for (Vector3& vertex : other.vertices) vertex += shift;
  return other;
}

MeshData MeshData::with(const MeshData& other) const {
  MeshData both = *this;
  const auto first = static_cast<int>(vertices.size());
  both.vertices.insert(both.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) both.triangles.push_back({a + first, b + first, c + first});
  return both;
}

MeshData box_mesh(const Vector3& half_extents) {
  MeshData mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.emplace_back(
        half_extents.cwiseProduct(Vector3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

MeshData sheet_mesh(Real half_x, Real half_z, int cells) {
  MeshData mesh;
  for (int i = 0; i <= cells; ++i)
    for (int k = 0; k <= cells; ++k)
      mesh.vertices.emplace_back(half_x * (2.0 * i / cells - 1), 0, half_z * (2.0 * k / cells - 1));
  for (int i = 0; i < cells; ++i)
    for (int k = 0; k < cells; ++k) {
      const int a = i * (cells + 1) + k, b = a + cells + 1;
      mesh.triangles.push_back({a, a + 1, b});
      mesh.triangles.push_back({b, a + 1, b + 1});
    }
  return mesh;
}

MeshData extruded_mesh(const std::vector<std::array<Real, 2>>& line, Real half_z) {
  MeshData mesh;
  for (const auto& [x, y] : line)
    for (const Real z : {-half_z, half_z}) mesh.vertices.emplace_back(x, y, z);
  for (int k = 0; k + 1 < static_cast<int>(line.size()); ++k) {
    const int a = 2 * k;
    mesh.triangles.push_back({a, a + 1, a + 2});
    mesh.triangles.push_back({a + 2, a + 1, a + 3});
  }
  return mesh;
}

JellyOptions jelly_with(Real margin, const Vector3& shift, Real damping_time) {
  return {
      .shift = shift, .body = {.margin = margin, .friction = 1}, .attach = {.step = {.damping_time = damping_time}}};
}

Real least(const btSoftBody& body, const std::function<Real(const Vector3&)>& height) {
  Real least = 1e9;
  for (int i = 0; i < body.m_nodes.size(); ++i) least = std::min(least, height(to_vector(body.m_nodes[i].m_x)));
  return least;
}

MeshShape::MeshShape(const MeshData& data, Real margin)
    : std::unique_ptr<btTriangleMesh>(triangles_of(data)), btBvhTriangleMeshShape(get(), true) {
  setMargin(static_cast<btScalar>(margin));
}

}  // namespace penalty::testing
