#include "penalty/mesh/embed.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "bcc_lattice.h"
#include "files.h"
#include "overlap.h"
#include "penalty/mesh/surface_builders.h"
#include "surfaces.h"
#include "winding_number.h"

namespace penalty::testing {
namespace {

// Tetrahedra reached from the first through faces.
std::size_t reached_through_faces(const TetMesh& mesh) {
  std::map<std::array<int, 3>, std::vector<int>> faces;
  const auto faces_of = [](Tetrahedron t) {
    std::sort(t.begin(), t.end());
    return std::array<std::array<int, 3>, 4>{
        {{t[0], t[1], t[2]}, {t[0], t[1], t[3]}, {t[0], t[2], t[3]}, {t[1], t[2], t[3]}}};
  };
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i)
    for (const auto& face : faces_of(mesh.tetrahedra[i])) faces[face].push_back(static_cast<int>(i));
  std::vector<int> queue{0};
  std::set<int> seen{0};
  for (std::size_t i = 0; i < queue.size(); ++i)
    for (const auto& face : faces_of(mesh.tetrahedra[queue[i]]))
      for (int next : faces[face])
        if (seen.insert(next).second) queue.push_back(next);
  return queue.size();
}

void expect_lawful(const EmbeddedSurface& e) {
  const Eigen::Index vertices = e.surface.vertices.cols();
  ASSERT_EQ(static_cast<Eigen::Index>(e.stencils.size()), vertices);
  ASSERT_EQ(e.weights.cols(), vertices);
  EXPECT_GE(e.weights.minCoeff(), -1e-9);
  EXPECT_LT((e.weights.colwise().sum().array() - 1).abs().maxCoeff(), 1e-14);
  const std::set<Tetrahedron> kept(e.lattice.tetrahedra.begin(), e.lattice.tetrahedra.end());
  for (const Tetrahedron& stencil : e.stencils) ASSERT_TRUE(kept.contains(stencil));
  const Real size = (e.surface.vertices.rowwise().maxCoeff() - e.surface.vertices.rowwise().minCoeff()).maxCoeff();
  EXPECT_LT((skin(e, e.lattice.vertices) - e.surface.vertices).cwiseAbs().maxCoeff(), 1e-12 * size);
  EXPECT_GT(volume(e.lattice), volume(e.surface));
  EXPECT_EQ(reached_through_faces(e.lattice), e.lattice.tetrahedra.size());
  EXPECT_EQ(e.lattice.repairs.reoriented, 0);
  EXPECT_EQ(e.lattice.repairs.dropped_vertices, 0);
  const MeshQuality q = quality(e.lattice);
  EXPECT_NEAR(q.edge_ratio, 2 / std::numbers::sqrt3, 1e-9);
  EXPECT_NEAR(q.smallest_dihedral, std::numbers::pi / 3, 1e-9);
  EXPECT_NEAR(q.largest_dihedral, std::numbers::pi / 2, 1e-9);
}

TEST(Embed, ObeysItsLawsForBallsBoxesAndTori) {
  for (int cells : {1, 2, 3, 8, 15}) {
    SCOPED_TRACE(cells);
    expect_lawful(embed(boundary_surface(make_ball(1, 6)), {.cells = cells}));
    expect_lawful(embed(boundary_surface(make_box({3, 1, 2}, {6, 2, 4})), {.cells = cells}));
    expect_lawful(embed(boundary_surface(make_torus()), {.cells = cells}));
  }
}

TEST(Embed, CoversLargeTrianglesAndCubesThatLieOnTheLattice) {
  for (int cells : {1, 4, 9}) {
    const EmbeddedSurface e = embed(boundary_surface(make_box({1, 1, 1}, {1, 1, 1})), {.cells = cells});
    expect_lawful(e);
    EXPECT_EQ(e.surface.triangles.size(), 12u);
  }
}

TEST(Embed, LatticeOfABallApproachesItsVolume) {
  const TriangleSurface ball = boundary_surface(make_ball(1, 10));
  Real before = std::numeric_limits<Real>::infinity();
  for (int cells : {5, 10, 20, 40}) {
    const Real excess = volume(embed(ball, {.cells = cells}).lattice) / (4 * std::numbers::pi / 3) - 1;
    EXPECT_LT(excess, 0.65 * before);
    before = excess;
  }
  EXPECT_LT(before, 0.12);
}

TEST(Embed, KeepsCavitiesHollow) {
  const TriangleSurface shell =
      together(boundary_surface(make_ball(1, 8)), inside_out(boundary_surface(make_ball(0.6, 8))));
  const EmbeddedSurface e = embed(shell, {.cells = 24});
  expect_lawful(e);
  for (const Tetrahedron& t : e.lattice.tetrahedra) {
    Real farthest = 0;
    for (int v : t) farthest = std::max(farthest, e.lattice.vertices.col(v).norm());
    EXPECT_GT(farthest, 0.55) << "a tetrahedron in the cavity";
  }
}

TEST(Embed, AffineMapsOfTheLatticeAreAffineMapsOfTheSurface) {
  const EmbeddedSurface e = embed(boundary_surface(make_torus()), {.cells = 12});
  Matrix3 map;
  map << 1.1, 0.3, -0.2, 0, -0.7, 0.4, 0.5, 0, 2;
  const Vector3 shift(3, -4, 5);
  const Eigen::Matrix3Xd expected = (map * e.surface.vertices).colwise() + shift;
  Eigen::Matrix3Xd moved(3, 1);
  skin(e, (map * e.lattice.vertices).colwise() + shift, moved);
  EXPECT_LT((moved - expected).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(Embed, IsTheSameForASoupAndForASurfaceInsideOut) {
  const TriangleSurface torus = boundary_surface(make_torus());
  const EmbeddedSurface plain = embed(torus), other = embed(inside_out(soup(torus)));
  EXPECT_TRUE(other.surface.repairs.flipped);
  EXPECT_EQ(other.lattice.vertices, plain.lattice.vertices);
  EXPECT_EQ(other.lattice.tetrahedra, plain.lattice.tetrahedra);
}

TEST(Embed, ScalesAndMovesWithTheSurface) {
  TriangleSurface torus = boundary_surface(make_torus());
  const EmbeddedSurface plain = embed(torus);
  torus.vertices *= 0x1p-30;
  EXPECT_EQ(embed(torus).lattice.tetrahedra, plain.lattice.tetrahedra);
  torus.vertices *= 0x1p60;
  EXPECT_EQ(embed(torus).lattice.tetrahedra, plain.lattice.tetrahedra);
}

TEST(Embed, SurvivesSurfacesOfAFewRoundingsFarFromTheOrigin) {
  for (Real size : {1e-3, 1e-6, 1e-8, 1e-9, 3e-10}) {
    TriangleSurface ball = boundary_surface(make_ball(size, 3));
    ball.vertices.array() += 1e6;
    const std::string complaint = invalid_argument([&] { EXPECT_GT(embed(ball, {.cells = 50}).weights.cols(), 0); });
    EXPECT_EQ(complaint.empty(), size > 5e-9) << size << ": " << complaint;
  }
}

TEST(Embed, NumbersLatticeSliceBySliceAlongTheLongestSide) {
  const EmbeddedSurface e = embed(boundary_surface(make_box({0.2, 1, 0.2}, {2, 10, 2})), {.cells = 20});
  int widest = 0;
  for (const Edge& edge : edges_of(e.lattice.tetrahedra)) widest = std::max(widest, edge[1] - edge[0]);
  EXPECT_LT(widest, static_cast<int>(e.lattice.vertices.cols()) / 8);
}

TEST(Embed, CountsThePiecesOfTheLattice) {
  const TriangleSurface ball = boundary_surface(make_ball(1, 2));
  TriangleSurface far = ball;
  far.vertices.row(0).array() += 5;
  const EmbeddedSurface apart = embed(together(ball, far));
  EXPECT_EQ(apart.pieces, 2);
  EXPECT_EQ(2 * reached_through_faces(apart.lattice), apart.lattice.tetrahedra.size()) << "of two alike";
  far.vertices.row(0).array() -= 2.9;
  EXPECT_EQ(embed(together(ball, far), {.cells = 4}).pieces, 1) << "cells that reach from one to the other join them";
}

bool holds(const TetMesh& mesh, const Vector3& point) {
  return std::any_of(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), [&](const Tetrahedron& t) {
    Eigen::Matrix4d corners;
    for (int k = 0; k < 4; ++k) corners.col(k) << mesh.vertices.col(t[k]), 1;
    return (corners.inverse() * Eigen::Vector4d(point[0], point[1], point[2], 1)).minCoeff() >= 0;
  });
}

// The tetrahedra that `whole` has, and no others.
void expect_same_lattice(const EmbeddedSurface& e, const EmbeddedSurface& whole) {
  EXPECT_EQ(e.lattice.vertices, whole.lattice.vertices);
  EXPECT_EQ(e.lattice.tetrahedra, whole.lattice.tetrahedra);
}

TEST(Embed, FillsSurfacesWithHolesDoubledFacesAndTrianglesThatFaceTheOtherSide) {
  const TriangleSurface ball = boundary_surface(make_ball(1, 8));
  const EmbeddedSurface whole = embed(ball, {.cells = 12});
  TriangleSurface worn = ball;
  for (std::size_t k = 0; k < ball.triangles.size(); k += 50) {
    const Triangle t = ball.triangles[k];
    worn.triangles.push_back({t[0], t[2], t[1]});
    std::swap(worn.triangles[k + 1][0], worn.triangles[k + 1][1]);
  }
  expect_same_lattice(embed(worn, {.cells = 12}), whole);
  // Holes of one triangle in thirty, each smaller than a cell; then a cap is gone, 0.87 in radius.
  TriangleSurface pierced = worn;
  std::size_t count = 0;
  std::erase_if(pierced.triangles, [&](const Triangle&) { return count++ % 30 == 0; });
  ASSERT_FALSE(topology_of(pierced).is_closed());
  const EmbeddedSurface filled = embed(pierced, {.cells = 12});
  // But for what only the missing triangles touched, less than a thousandth.
  EXPECT_NEAR(volume(filled.lattice), volume(whole.lattice), 0.001 * volume(whole.lattice));
  TriangleSurface cut = ball;
  std::erase_if(cut.triangles, [&](const Triangle& t) { return ball.vertices(1, t[0]) > 0.5; });
  const EmbeddedSurface bowl = embed(cut, {.cells = 12});
  EXPECT_EQ(bowl.pieces, 1);
  EXPECT_TRUE(holds(bowl.lattice, {0.01, 0, 0.02}));
  EXPECT_TRUE(holds(bowl.lattice, {0.51, 0.2, -0.33}));
  EXPECT_FALSE(holds(bowl.lattice, {0.01, 0.95, 0.02})) << "above the opening";
}

TEST(Embed, FillsCubesThatShareAWall) {
  const TriangleSurface cube = boundary_surface(make_box({1, 1, 1}, {2, 2, 2}));
  TriangleSurface next = cube;
  next.vertices.row(0).array() += 1;
  const EmbeddedSurface both = embed(together(cube, next), {.cells = 8});
  EXPECT_GT(topology_of(both.surface).branching_edges, 0);
  expect_same_lattice(both, embed(boundary_surface(make_box({2, 1, 1}, {4, 2, 2})), {.cells = 8}));
}

TEST(WindingNumber, IsOneInsideZeroOutsideAndThatOfTheSolidAngleInBetween) {
  constexpr unsigned seed = 11;
  std::mt19937 random(seed);
  std::uniform_real_distribution<Real> place(-2, 2);
  const TriangleSurface ball = boundary_surface(make_ball(1, 12));
  const WindingNumber winding(ball);
  TriangleSurface half = ball;  // open, below y = 0
  std::erase_if(half.triangles, [&](const Triangle& t) {
    return ball.vertices(1, t[0]) + ball.vertices(1, t[1]) + ball.vertices(1, t[2]) > 0;
  });
  const WindingNumber of_half(half);
  for (int k = 0; k < 2000; ++k) {
    const Vector3 p(place(random), place(random), place(random));
    if (std::abs(p.norm() - 1) < 0.03) continue;
    EXPECT_NEAR(winding.at(p), p.norm() < 1 ? 1 : 0, 0.02) << p.transpose() << ", seed " << seed;
  }
  EXPECT_NEAR(of_half.at({0, 0, 0}), 0.5, 0.02) << "a hemisphere, from its centre";
  // From above on the axis: the cone through the rim, (1 - cos) / 2 of all directions, seen from inside out.
  for (const Real y : {0.5, 1.0, 3.0})
    EXPECT_NEAR(of_half.at({0, y, 0}), (1 - y / std::sqrt(1 + y * y)) / 2, 0.02) << y;
}

TEST(Enclosure, TellsSkinsOfSolidsFromSheets) {
  const TriangleSurface ball = boundary_surface(make_ball(1, 8));
  EXPECT_NEAR(enclosure(ball), 1, 0.01);
  EXPECT_NEAR(enclosure(inside_out(ball)), 1, 0.01);
  EXPECT_NEAR(enclosure(make_sheet(1, 2, 8, 16)), 0.5, 0.01);
  TriangleSurface pierced = ball;
  std::size_t count = 0;
  std::erase_if(pierced.triangles, [&](const Triangle&) { return count++ % 20 == 0; });
  EXPECT_GT(enclosure(pierced), 0.93);
  TriangleSurface tube = boundary_surface(make_box({0.01, 1, 0.01}, {1, 40, 1}));  // thin, without its ends
  std::erase_if(tube.triangles, [&](const Triangle& t) {
    return tube.vertices(1, t[0]) == tube.vertices(1, t[1]) && tube.vertices(1, t[1]) == tube.vertices(1, t[2]);
  });
  EXPECT_FALSE(topology_of(tube).is_closed());
  EXPECT_GT(enclosure(tube), 0.95);
}

TEST(Embed, NamesWhatItRefuses) {
  const TriangleSurface ball = boundary_surface(make_ball(1, 2));
  EXPECT_EQ(invalid_argument([&] { embed(ball, {.cells = 0}); }), "embed: cells is 0, not between 1 and 200");
  EXPECT_EQ(invalid_argument([&] { embed(ball, {.cells = 201}); }), "embed: cells is 201, not between 1 and 200");
  const EmbeddedSurface e = embed(ball, {.cells = 2});
  EXPECT_EQ(invalid_argument([&] { skin(e, Eigen::Matrix3Xd::Zero(3, 2)); }),
            "skin: 2 lattice positions for " + std::to_string(e.lattice.vertices.cols()) + " lattice vertices");
  for (Real spacing : {0.0, -1.0, std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity()})
    EXPECT_THROW(contact_samples(e, spacing), std::invalid_argument) << spacing;
}

TEST(ContactSamples, AreApartAndCloseToEveryVertex) {
  const EmbeddedSurface e = embed(boundary_surface(make_torus(0.7, 0.3, 8, 90)), {.cells = 8});
  for (Real spacing : {1e-6, 0.1, 0.35, 10.0}) {
    const std::vector<int> samples = contact_samples(e, spacing);
    EXPECT_TRUE(std::is_sorted(samples.begin(), samples.end()));
    for (std::size_t i = 0; i < samples.size(); ++i)
      for (std::size_t k = 0; k < i && spacing > 0.01; ++k)
        ASSERT_GE((e.surface.vertices.col(samples[i]) - e.surface.vertices.col(samples[k])).norm(), spacing);
    for (Eigen::Index v = 0; v < e.surface.vertices.cols() && spacing > 0.01; ++v) {
      Real nearest = std::numeric_limits<Real>::infinity();
      for (int s : samples) nearest = std::min(nearest, (e.surface.vertices.col(v) - e.surface.vertices.col(s)).norm());
      ASSERT_LT(nearest, spacing);
    }
    if (spacing < 0.01) {
      EXPECT_EQ(static_cast<Eigen::Index>(samples.size()), e.surface.vertices.cols());
    }
    if (spacing > 2) {
      EXPECT_EQ(samples, std::vector<int>{0});
    }
  }
}

TEST(BccLattice, EveryPointLiesInTheTetrahedronThatIsFoundForIt) {
  constexpr unsigned seed = 11;
  std::mt19937 random(seed);
  const Vector3 low(-1, 2, 5), high(2, 3, 7.2);
  const BccLattice lattice(low, high, 0.25);
  for (int i = 0; i < 20000; ++i) {
    Vector3 p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = std::uniform_real_distribution<Real>(low[axis], high[axis])(random);
    if (i % 2 == 0) p = (p.array() * 8).round() / 8;  // on corners, faces and planes between tetrahedra
    p = p.cwiseMax(low).cwiseMin(high);
    const BccLattice::Id id = lattice.tetrahedron_at(p);
    ASSERT_TRUE(id >= 0 && lattice.exists(id)) << "seed " << seed << " point " << p.transpose();
    const Points<4> t = lattice.points_of(id);
    Matrix3 sides;
    sides << t.col(1) - t.col(0), t.col(2) - t.col(0), t.col(3) - t.col(0);
    EXPECT_NEAR(sides.determinant() / 6, 0.25 * 0.25 * 0.25 / 12, 1e-15);
    const Vector3 w = sides.inverse() * (p - t.col(0));
    ASSERT_TRUE(w.minCoeff() > -1e-12 && w.sum() < 1 + 1e-12) << "seed " << seed << " point " << p.transpose();
  }
}

TEST(BccLattice, NeighboursShareAFaceAndEveryFaceHasANeighbour) {
  const BccLattice lattice(Vector3::Zero(), Vector3(3, 2, 4), 1);
  int inner = 0;
  for (BccLattice::Id id = 0; id < lattice.num_tetrahedra(); ++id) {
    if (!lattice.exists(id)) continue;
    const Tetrahedron t = lattice.vertices_of(id);
    std::set<std::set<int>> shared;
    int count = 0;
    for (BccLattice::Id next : lattice.neighbours(id)) {
      if (next < 0) continue;
      ++count;
      ASSERT_TRUE(lattice.exists(next));
      std::set<int> common;
      for (int v : lattice.vertices_of(next))
        if (std::find(t.begin(), t.end(), v) != t.end()) common.insert(v);
      ASSERT_EQ(common.size(), 3u);
      shared.insert(common);
    }
    ASSERT_EQ(static_cast<int>(shared.size()), count) << "two neighbours across one face";
    inner += count == 4;
  }
  EXPECT_GT(inner, 100);
}

TEST(TriangleTouchesTetrahedron, KnowsTouchingCrossingAndApart) {
  Points<4> corner;
  corner << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  const auto touches = [&](const Vector3& a, const Vector3& b, const Vector3& c) {
    Points<3> triangle;
    triangle << a, b, c;
    return triangle_touches_tetrahedron(triangle, corner, 1e-12);
  };
  EXPECT_TRUE(touches({0.1, 0.1, 0.1}, {0.2, 0.1, 0.1}, {0.1, 0.2, 0.1})) << "inside";
  EXPECT_TRUE(touches({-9, -9, 0.5}, {9, -9, 0.5}, {0, 9, 0.5})) << "cut through by a large one";
  EXPECT_TRUE(touches({0, 0, 0}, {-1, 0, 0}, {0, -1, 0})) << "at a corner";
  EXPECT_TRUE(touches({-1, 0.5, 0}, {1, 0.5, 0}, {0, 0.5, -1})) << "along a face";
  EXPECT_TRUE(touches({0.5, 0.5, -1}, {0.5, 0.5, 1}, {2, 2, 0})) << "across an edge";
  EXPECT_FALSE(touches({0.51, 0.51, -1}, {0.51, 0.51, 1}, {2, 2, 0})) << "past an edge, boxes overlap";
  EXPECT_FALSE(touches({0, 0, -0.01}, {1, 0, -0.01}, {0, 1, -0.01})) << "below a face";
  EXPECT_FALSE(touches({0.4, 0.4, 0.4}, {1, 0, 0.4}, {0.4, 1, 0.4})) << "beyond the slanted face";
  EXPECT_TRUE(touches({-1, 0.2, 0.2}, {1, 0.2, 0.2}, {1, 0.2, 0.2})) << "a line through it";
}

}  // namespace
}  // namespace penalty::testing
