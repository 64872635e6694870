#include "penalty/fields/topology.h"

#include <map>
#include <numeric>
#include <set>

#include "fields/meshes.h"

namespace penalty::testing {
namespace {

// Boxes of several shapes, with vertices off the grid, and a ball: bodies without holes; and a torus, with one.
struct NamedMesh {
  TetMesh mesh;
  int euler_characteristic;  // of the body; of its surface it is twice that
};
std::vector<NamedMesh> meshes() {
  Random random(1);
  return {{noisy_box({1, 1, 1}, 1, 0.1, random), 1},
          {noisy_box({3, 2, 4}, 0.25, 0.1, random), 1},
          {make_ball(0.5, 3), 1},
          {make_torus(0.7, 0.3, 2, 9), 0}};
}

TEST(Edges, AreListedOnceSortedLowerFirst) {
  const std::vector<Tetrahedron> two{{0, 1, 2, 3}, {4, 2, 1, 3}};
  const std::vector<Edge> expected{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {1, 4}, {2, 3}, {2, 4}, {3, 4}};
  EXPECT_EQ(edges_of(two), expected);
  const std::vector<Triangle> square{{0, 1, 2}, {2, 1, 3}};
  EXPECT_EQ(edges_of(square), (std::vector<Edge>{{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}}));
  EXPECT_TRUE(edges_of(std::vector<Tetrahedron>{}).empty());
}

TEST(Faces, OfOneTetrahedronLookOutwards) {
  const std::vector<Triangle> faces = boundary_faces(std::vector<Tetrahedron>{{0, 1, 2, 3}});
  EXPECT_EQ(faces, (std::vector<Triangle>{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}));
}

TEST(Faces, SharedByTwoTetrahedraAreInside) {
  const std::vector<Triangle> faces = boundary_faces(std::vector<Tetrahedron>{{0, 1, 2, 3}, {4, 2, 1, 3}});
  EXPECT_EQ(faces.size(), 6u);
  for (Triangle face : faces) {
    std::sort(face.begin(), face.end());
    EXPECT_NE(face, (Triangle{1, 2, 3}));
  }
}

TEST(Faces, FormAClosedSurface) {
  for (const auto& [mesh, euler] : meshes()) {
    SCOPED_TRACE(mesh.source);
    std::map<std::pair<int, int>, int> sides;  // directed
    for (const Triangle& face : boundary_faces(mesh.tetrahedra))
      for (int k = 0; k < 3; ++k) ++sides[{face[k], face[(k + 1) % 3]}];
    ASSERT_FALSE(sides.empty());
    for (const auto& [side, count] : sides) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(sides.count({side.second, side.first}), 1u);
    }
  }
}

TEST(Faces, EncloseTheVolumeOfTheTetrahedra) {
  for (const auto& [mesh, euler] : meshes()) {
    SCOPED_TRACE(mesh.source);
    Real enclosed = 0;  // divergence theorem: positive only if the faces look outwards
    for (const Triangle& face : boundary_faces(mesh.tetrahedra)) {
      const Vector3 a = mesh.vertices.col(face[0]), b = mesh.vertices.col(face[1]), c = mesh.vertices.col(face[2]);
      enclosed += a.dot(b.cross(c)) / 6;
    }
    const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
    const Real volume = std::accumulate(volumes.begin(), volumes.end(), 0.0);
    ASSERT_GT(*std::min_element(volumes.begin(), volumes.end()), 0);
    EXPECT_NEAR(enclosed, volume, 1e-14 * static_cast<double>(mesh.tetrahedra.size()));
  }
}

TEST(Topology, EulerCharacteristicOfBodyAndSurface) {
  for (const auto& [mesh, euler] : meshes()) {
    SCOPED_TRACE(mesh.source);
    const int vertices = static_cast<int>(mesh.vertices.cols());
    const int tetrahedra = static_cast<int>(mesh.tetrahedra.size());
    const std::vector<Triangle> surface = boundary_faces(mesh.tetrahedra);
    const int surface_faces = static_cast<int>(surface.size());
    const int faces = (4 * tetrahedra + surface_faces) / 2;
    EXPECT_EQ(vertices - static_cast<int>(edges_of(mesh.tetrahedra).size()) + faces - tetrahedra, euler);
    std::set<int> surface_vertices;
    for (const Triangle& face : surface) surface_vertices.insert(face.begin(), face.end());
    EXPECT_EQ(static_cast<int>(surface_vertices.size()) - static_cast<int>(edges_of(surface).size()) + surface_faces,
              2 * euler);
  }
}

TEST(Topology, EdgesOfTheSurfaceAreEdgesOfTheBody) {
  for (const auto& [mesh, euler] : meshes()) {
    SCOPED_TRACE(mesh.source);
    const std::vector<Edge> all = edges_of(mesh.tetrahedra), outside = edges_of(boundary_faces(mesh.tetrahedra));
    ASSERT_FALSE(outside.empty());
    EXPECT_TRUE(std::includes(all.begin(), all.end(), outside.begin(), outside.end()));
  }
}

TEST(Volumes, AreSigned) {
  Eigen::Matrix3Xd vertices(3, 4);
  vertices << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  const std::vector<Real> volumes = signed_volumes(vertices, std::vector<Tetrahedron>{{0, 1, 2, 3}, {0, 2, 1, 3}});
  EXPECT_EQ(volumes, (std::vector<Real>{1.0 / 6, -1.0 / 6}));
}

TEST(Volumes, AreSharedOutToTheEdgesWithoutRest) {
  for (const auto& [mesh, euler] : meshes()) {
    SCOPED_TRACE(mesh.source);
    const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
    const std::vector<Real> shares = edge_volume_shares(edges_of(mesh.tetrahedra), mesh.tetrahedra, volumes);
    EXPECT_GT(*std::min_element(shares.begin(), shares.end()), 0);
    const Real volume = std::accumulate(volumes.begin(), volumes.end(), 0.0);
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), volume, 1e-13 * volume);
  }
}

TEST(Volumes, OfTheTetrahedraAroundAnEdgeGiveItASixthEach) {
  const std::vector<Tetrahedron> two{{0, 1, 2, 3}, {4, 2, 1, 3}};
  const std::vector<Real> shares = edge_volume_shares(edges_of(two), two, std::vector<Real>{6, 12});
  //                                    01 02 03 12 13 14 23 24 34
  EXPECT_EQ(shares, (std::vector<Real>{1, 1, 1, 3, 3, 2, 3, 2, 2}));
}

TEST(Hinges, HaveTheirLeftTriangleFirst) {
  //   3---2
  //   | / |
  //   0---1
  const std::vector<Triangle> square{{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(hinges_of(square), (std::vector<Hinge>{{0, 2, 3, 1}}));
  const std::vector<Triangle> turned{{0, 2, 1}, {3, 2, 0}};
  EXPECT_EQ(hinges_of(turned), (std::vector<Hinge>{{0, 2, 1, 3}})) << "the other side up";
  EXPECT_TRUE(hinges_of(std::vector<Triangle>{{0, 1, 2}}).empty());
}

TEST(Hinges, AreTheInnerEdgesOfASurfaceEachOnceAndInOrder) {
  for (const auto& [mesh, euler] : meshes()) {
    SCOPED_TRACE(mesh.source);
    std::vector<Triangle> surface = boundary_faces(mesh.tetrahedra);
    const std::set<Triangle> triangles = [&] {
      std::set<Triangle> rotations;
      for (const auto& [a, b, c] : surface) rotations.insert({{a, b, c}, {b, c, a}, {c, a, b}});
      return rotations;
    }();
    const auto edges_of_hinges = [](const std::vector<Hinge>& hinges) {
      std::vector<Edge> edges;
      edges.reserve(hinges.size());
      for (const auto& [p0, p1, p2, p3] : hinges) edges.push_back({p0, p1});
      return edges;
    };
    const std::vector<Hinge> hinges = hinges_of(surface);
    EXPECT_EQ(edges_of_hinges(hinges), edges_of(surface)) << "closed: every edge is an inner one";
    for (const auto& [p0, p1, p2, p3] : hinges) {
      EXPECT_TRUE(triangles.contains({p0, p1, p2}));
      EXPECT_TRUE(triangles.contains({p1, p0, p3}));
    }
    std::reverse(surface.begin(), surface.end());
    EXPECT_EQ(hinges_of(surface), hinges) << "whatever the order of the triangles";
    surface.pop_back();
    EXPECT_EQ(hinges_of(surface).size(), hinges.size() - 3) << "a hole has a rim";
  }
}

TEST(Hinges, NameTheEdgeThatHasNoLeftAndRight) {
  const auto complaint = [](const std::vector<Triangle>& triangles) {
    try {
      hinges_of(triangles);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaint({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}), "hinges: edge 0, 1 belongs to 3 triangles");
  EXPECT_EQ(complaint({{0, 1, 2}, {0, 1, 3}}),
            "hinges: edge 0, 1 is run through in one direction by both of its triangles");
}

TEST(Areas, AreSharedOutToTheEdgesWithoutRest) {
  Eigen::Matrix3Xd vertices(3, 4);
  vertices << 0, 2, 2, 0, 0, 0, 1, 1, 3, 3, 3, 3;
  const std::vector<Triangle> rectangle{{0, 1, 2}, {0, 2, 3}};
  const std::vector<Real> areas = areas_of(vertices, rectangle);
  EXPECT_EQ(areas, (std::vector<Real>{1, 1}));
  const std::vector<Edge> edges = edges_of(rectangle);
  //                                                             01 02 03 12 23
  EXPECT_EQ(edge_area_shares(edges, rectangle, std::vector<Real>{3, 6}), (std::vector<Real>{1, 3, 2, 1, 2}));
  for (const auto& [mesh, euler] : meshes()) {
    const std::vector<Triangle> surface = boundary_faces(mesh.tetrahedra);
    const std::vector<Real> all = areas_of(mesh.vertices, surface);
    const std::vector<Real> shares = edge_area_shares(edges_of(surface), surface, all);
    const Real area = std::accumulate(all.begin(), all.end(), 0.0);
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), area, 1e-13 * area);
    EXPECT_GT(*std::min_element(shares.begin(), shares.end()), 0);
  }
}

}  // namespace
}  // namespace penalty::testing
