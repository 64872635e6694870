#include "penalty/fields/topology.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace penalty {
namespace {

constexpr std::array<std::array<int, 2>, 6> edges_of_tetrahedron{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
constexpr std::array<std::array<int, 3>, 4> faces_of_tetrahedron{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

Edge sorted_edge(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

Triangle sorted_face(int a, int b, int c) {
  Triangle face{a, b, c};
  std::sort(face.begin(), face.end());
  return face;
}

std::vector<Edge> sorted_unique(std::vector<Edge> edges) {
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

std::vector<Edge> edges_of(std::span<const Tetrahedron> tetrahedra) {
  std::vector<Edge> edges;
  edges.reserve(6 * tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra)
    for (auto [a, b] : edges_of_tetrahedron) edges.push_back(sorted_edge(t[a], t[b]));
  return sorted_unique(std::move(edges));
}

std::vector<Edge> edges_of(std::span<const Triangle> triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) edges.push_back(sorted_edge(t[k], t[(k + 1) % 3]));
  return sorted_unique(std::move(edges));
}

std::vector<Triangle> faces_of(std::span<const Tetrahedron> tetrahedra) {
  std::vector<Triangle> faces;
  faces.reserve(4 * tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra)
    for (auto [a, b, c] : faces_of_tetrahedron) faces.push_back(sorted_face(t[a], t[b], t[c]));
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  return faces;
}

std::vector<Triangle> boundary_faces(std::span<const Tetrahedron> tetrahedra) {
  struct Face {
    Triangle key, face;
    std::size_t order;
  };
  std::vector<Face> faces;
  faces.reserve(4 * tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra)
    for (auto [a, b, c] : faces_of_tetrahedron) {
      Face f{{t[a], t[b], t[c]}, {t[a], t[b], t[c]}, faces.size()};
      std::sort(f.key.begin(), f.key.end());
      faces.push_back(f);
    }
  std::sort(faces.begin(), faces.end(), [](const Face& l, const Face& r) { return l.key < r.key; });
  std::vector<Face> boundary;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t next = i + 1;
    while (next < faces.size() && faces[next].key == faces[i].key) ++next;
    if (next == i + 1) boundary.push_back(faces[i]);
    i = next;
  }
  std::sort(boundary.begin(), boundary.end(), [](const Face& l, const Face& r) { return l.order < r.order; });
  std::vector<Triangle> triangles;
  triangles.reserve(boundary.size());
  for (const Face& f : boundary) triangles.push_back(f.face);
  return triangles;
}

std::vector<Real> signed_volumes(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra) {
  std::vector<Real> volumes;
  volumes.reserve(tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra) {
    const Vector3 p0 = vertices.col(t[0]);
    const Vector3 a = vertices.col(t[1]) - p0, b = vertices.col(t[2]) - p0, c = vertices.col(t[3]) - p0;
    volumes.push_back(a.dot(b.cross(c)) / 6);
  }
  return volumes;
}

void orient(const Eigen::Matrix3Xd& vertices, std::span<Tetrahedron> tetrahedra) {
  const std::vector<Real> volumes = signed_volumes(vertices, tetrahedra);
  for (std::size_t t = 0; t < tetrahedra.size(); ++t)
    if (volumes[t] < 0) std::swap(tetrahedra[t][2], tetrahedra[t][3]);
}

std::vector<Real> edge_volume_shares(std::span<const Edge> edges, std::span<const Tetrahedron> tetrahedra,
                                     std::span<const Real> volumes) {
  std::vector<Real> shares(edges.size(), 0);
  for (std::size_t i = 0; i < tetrahedra.size(); ++i)
    for (auto [a, b] : edges_of_tetrahedron) {
      const Edge edge = sorted_edge(tetrahedra[i][a], tetrahedra[i][b]);
      const auto found = std::lower_bound(edges.begin(), edges.end(), edge);
      shares[found - edges.begin()] += volumes[i] / 6;
    }
  return shares;
}

std::vector<Real> face_volume_shares(std::span<const Triangle> faces, std::span<const Tetrahedron> tetrahedra,
                                     std::span<const Real> volumes) {
  std::vector<Real> shares(faces.size(), 0);
  for (std::size_t i = 0; i < tetrahedra.size(); ++i)
    for (auto [a, b, c] : faces_of_tetrahedron) {
      const Triangle face = sorted_face(tetrahedra[i][a], tetrahedra[i][b], tetrahedra[i][c]);
      const auto found = std::lower_bound(faces.begin(), faces.end(), face);
      shares[found - faces.begin()] += volumes[i] / 4;
    }
  return shares;
}

std::vector<Hinge> hinges_of(std::span<const Triangle> triangles) {
  struct HalfEdge {
    Edge edge;
    bool upwards;  // the triangle runs from the lower index to the higher
    int wing;
  };
  std::vector<HalfEdge> sides;
  sides.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      sides.push_back({sorted_edge(a, b), a < b, t[(k + 2) % 3]});
    }
  // The left triangle, which runs upwards, first; equal ones stay in the order of their triangles.
  std::stable_sort(sides.begin(), sides.end(), [](const HalfEdge& l, const HalfEdge& r) {
    return l.edge != r.edge ? l.edge < r.edge : l.upwards && !r.upwards;
  });
  std::vector<Hinge> hinges;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t next = i + 1;
    while (next < sides.size() && sides[next].edge == sides[i].edge) ++next;
    const auto fail = [&](const std::string& what) {
      throw std::invalid_argument("hinges: edge " + std::to_string(sides[i].edge[0]) + ", " +
                                  std::to_string(sides[i].edge[1]) + " " + what);
    };
    if (next - i > 2) fail("belongs to " + std::to_string(next - i) + " triangles");
    if (next - i == 2) {
      if (sides[i].upwards == sides[i + 1].upwards) fail("is run through in one direction by both of its triangles");
      hinges.push_back({sides[i].edge[0], sides[i].edge[1], sides[i].wing, sides[i + 1].wing});
    }
    i = next;
  }
  return hinges;
}

std::vector<Real> areas_of(const Eigen::Matrix3Xd& vertices, std::span<const Triangle> triangles) {
  std::vector<Real> areas;
  areas.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const Vector3 u = vertices.col(b) - vertices.col(a), v = vertices.col(c) - vertices.col(a);
    areas.push_back(u.cross(v).norm() / 2);
  }
  return areas;
}

std::vector<Real> edge_area_shares(std::span<const Edge> edges, std::span<const Triangle> triangles,
                                   std::span<const Real> areas) {
  std::vector<Real> shares(edges.size(), 0);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const Edge edge = sorted_edge(triangles[i][k], triangles[i][(k + 1) % 3]);
      const auto found = std::lower_bound(edges.begin(), edges.end(), edge);
      shares[found - edges.begin()] += areas[i] / 3;
    }
  return shares;
}

}  // namespace penalty
