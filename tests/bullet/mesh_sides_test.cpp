// Soft bodies and triangle meshes, which have two sides.
#include "bullet/meshes.h"

#include <cmath>
#include <functional>

#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

using std::numbers::pi;

struct MarginPair {
  Real mesh, soft;
};
constexpr MarginPair all_margins[] = {{0.04, 0.02}, {0, 0.02}, {0, 0}};

Vector3 center(const btSoftBody& body) {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += to_vector(body.m_nodes[i].m_x);
  return sum / body.m_nodes.size();
}

void throw_at(Simulation& sim, btSoftBody& body, const Vector3& velocity) {
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = to_bullet(velocity);
  sim.penalty().synchronize(body);
}

class MeshSides : public WorldTest {
 protected:
  static btRigidBody& add_mesh(Simulation& sim, const MeshData& data, Real margin) {
    return sim.add_rigid(std::make_unique<MeshShape>(data, margin), 0, {0, 0, 0});
  }

  const TetMesh cube = make_box({0.4, 0.4, 0.4}, {4, 4, 4});
};

// Down the y axis or up it, on the front or the back: a body lies on it.
TEST_P(MeshSides, ABodyLiesOnEitherSide) {
  for (const auto& [mesh_margin, margin] : all_margins)
    for (const bool turned : {false, true})
      for (const Real down : {-1.0, 1.0}) {
        SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << (turned ? ", turned" : "")
                                          << ", gravity " << down);
        Simulation other(GetParam());
        other.set_gravity({0, 9.81 * down, 0});
        add_mesh(other, turned ? sheet_mesh(2, 2, 8).turned() : sheet_mesh(2, 2, 8), mesh_margin);
        const Real start = down < 0 ? 0.3 : -0.7;
        btSoftBody& body = other.add_jelly(cube, jelly_with(margin, {0, start, 0}));
        const auto height = [&](const Vector3& x) { return -down * x.y(); };
        for (int k = 0; k < 180; ++k) {
          other.step(frame);
          ASSERT_TRUE(other.penalty().report(body).finite);
          ASSERT_GT(least(body, height), mesh_margin + margin - 2e-3) << "in step " << k;
        }
        EXPECT_NEAR(least(body, height), mesh_margin + margin, 1e-3);
        EXPECT_NEAR(height(center(body)), mesh_margin + margin + 0.2, 0.02);
        EXPECT_LT(2 * kinetic_energy(other.penalty().particles(body)), 1e-4);
      }
}

TEST_P(MeshSides, WhatIsThrownAtAWallStaysOnItsSide) {
  const MeshData wall = extruded_mesh({{0, -3}, {0, -1}, {0, 1}, {0, 3}}, 3);
  for (const auto& [mesh_margin, margin] : all_margins)
    for (const Real speed : {5, -5, 50, -50}) {
      SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << " at " << speed << " m/s");
      Simulation other(GetParam());
      add_mesh(other, wall, mesh_margin);
      btSoftBody& body = other.add_jelly(make_ball(0.3, 3), jelly_with(margin, {speed > 0 ? -1.1 : 1.1, 0.05, 0}, 0));
      throw_at(other, body, {speed, 0.1 * speed, 0});
      const Real start = other.totals().energy;
      for (int k = 0; k < 60; ++k) {
        other.step(frame);
        ASSERT_TRUE(other.penalty().report(body).finite);
        ASSERT_GT(least(body, [&](const Vector3& x) { return speed > 0 ? -x.x() : x.x(); }),
                  mesh_margin + margin - 2e-3)
            << "in step " << k;
        ASSERT_LT(other.totals().energy, 1.01 * start);
      }
      EXPECT_LT(linear_momentum(other.penalty().particles(body)).x() * speed, 0) << "bounced";
    }
}

TEST_P(MeshSides, NothingLeavesAClosedRoom) {
  const Vector3 half(1, 0.8, 1.2);
  for (const auto& [mesh_margin, margin] : all_margins)
    for (const bool turned : {false, true})
      for (const Real speed : {5, 50}) {
        SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << " at " << speed << " m/s"
                                          << (turned ? ", turned" : ""));
        Simulation other(GetParam());
        other.set_gravity({0, -9.81, 0});
        add_mesh(other, turned ? box_mesh(half).turned() : box_mesh(half), mesh_margin);
        btSoftBody& body = other.add_jelly(make_ball(0.3, 3), jelly_with(margin, {-0.2, 0.1, 0.1}, 0.002));
        throw_at(other, body, speed * Vector3(0.7, -0.4, 0.6));
        Real depth = -1e9;
        for (int k = 0; k < 120; ++k) {
          other.step(frame);
          ASSERT_TRUE(other.penalty().report(body).finite);
          depth = std::max(depth, -least(body, [&](const Vector3& x) { return (half - x.cwiseAbs()).minCoeff(); }));
          ASSERT_LT(depth, 0.02) << "in step " << k;
        }
        EXPECT_GT(depth, -mesh_margin - margin - 1e-3) << "touched a wall";
        EXPECT_LE(depth, 1e-3);
      }
}

TEST_P(MeshSides, DepthIsTakenBackOnTheSideWhereMostOfTheBodyIs) {
  for (const MarginPair& margins : all_margins)
    for (const bool turned : {false, true})
      for (const Real down : {-1.0, 1.0}) {
        const auto most_substeps = [&](Real height_of_lowest) {
          Simulation other(GetParam());
          other.set_gravity({0, 10 * down, 0});
          add_mesh(other, turned ? sheet_mesh(2, 2, 7).turned() : sheet_mesh(2, 2, 7), margins.mesh);
          btSoftBody& body = other.add_jelly(
              cube,
              jelly_with(margins.soft, {-0.2, down < 0 ? height_of_lowest : -0.4 - height_of_lowest, -0.2}, 0.002));
          int most = 0;
          for (int k = 0; k < 120; ++k) {
            other.step(frame);
            most = std::max(most, other.penalty().report(body).substeps);
          }
          const Real lowest = least(body, [&](const Vector3& x) { return -down * x.y(); });
          EXPECT_NEAR(lowest, margins.mesh + margins.soft, 1.5e-3) << "from " << height_of_lowest;
          return most;
        };
        SCOPED_TRACE(::testing::Message() << "margins " << margins.mesh << ", " << margins.soft
                                          << (turned ? ", turned" : "") << ", gravity " << down);
        const int at_rest = most_substeps(margins.mesh + margins.soft + 1e-4);
        for (const Real depth : {0.0005, 0.005, 0.02, 0.05})
          EXPECT_LE(most_substeps(margins.mesh + margins.soft - depth), 2 * at_rest) << depth << " m deep";
        for (const Real depth : {0.0, 0.0005, 0.01, 0.05, 0.12})
          EXPECT_LE(most_substeps(-depth), 2 * at_rest) << depth << " m behind the triangles";
      }
}

TEST_P(MeshSides, DepthOfPointsOnALatticeIsTakenBack) {
  sim.set_gravity({0, -10, 0});
  add_mesh(sim, sheet_mesh(2, 2, 7).turned(), 0);
  // Points of the lower face, in the middle of the cells; the lattice reaches below them.
  JellyOptions options = jelly_with(0, {-0.2, -0.05, -0.2});
  for (const Tetrahedron& t : cube.tetrahedra)
    options.attach.contact_points.push_back({{t[0], t[1], t[2], t[3]}, {0.25, 0.25, 0.25, 0.25}, 4});
  btSoftBody& body = sim.add_jelly(cube, options);
  sim.step(frame, 120);
  Real lowest_point = 1;
  for (const WeightedPoint& point : options.attach.contact_points)
    lowest_point = std::min(lowest_point, point.of(sim.penalty().particles(body).positions).y());
  EXPECT_NEAR(lowest_point, 0, 1.5e-3);
}

// The application moves it: a long way, through the sheet or into it, has nothing to do with where it belongs.
TEST_P(MeshSides, ABodyThatIsPutElsewhereBelongsWhereMostOfItIs) {
  for (const auto& [mesh_margin, margin] : all_margins)
    for (const Real height : {0.05, -0.1, -0.3, -0.6}) {
      SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << ", to " << height);
      Simulation other(GetParam());
      other.set_gravity({0, height > -0.2 ? -9.81 : 9.81, 0});
      add_mesh(other, sheet_mesh(2, 2, 7), mesh_margin);
      btSoftBody& body = other.add_jelly(cube, jelly_with(margin, {-0.2, 0.6, -0.2}));
      other.step(frame, 2);
      body.translate(btVector3(0, static_cast<btScalar>(height - lowest(body)), 0));
      other.step(frame, 150);
      const Real side = height > -0.2 ? 1 : -1;
      EXPECT_NEAR(least(body, [&](const Vector3& x) { return side * x.y(); }), mesh_margin + margin, 2e-3);
    }
}

// Put half through a wall of two sheets it stays where it is, and nothing is squeezed out or torn.
TEST_P(MeshSides, ABodyMayStraddleAThinWall) {
  const MeshData sheet = extruded_mesh({{0, -3}, {0, 3}}, 3);
  for (const auto& [mesh_margin, margin] : all_margins)
    for (const Real thickness : {0.01, 0.05}) {
      SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << ", " << thickness << " m");
      Simulation other(GetParam());
      add_mesh(other, sheet.shifted({-thickness / 2, 0, 0}).with(sheet.turned().shifted({thickness / 2, 0, 0})),
               mesh_margin);
      btSoftBody& body = other.add_jelly(cube, jelly_with(margin, {-0.25, 0, 0}));
      Real largest = 0;
      int substeps = 0;
      for (int k = 0; k < 120; ++k) {
        other.step(frame);
        ASSERT_TRUE(other.penalty().report(body).finite);
        largest = std::max(largest, other.penalty().report(body).elastic_energy);
        substeps = std::max(substeps, other.penalty().report(body).substeps);
      }
      EXPECT_LT(largest, 200) << "of nodes that keep both margins from both sides";
      EXPECT_LE(substeps, 100);
      const PackedVectors before = other.penalty().particles(body).positions;
      other.step(frame);
      EXPECT_LT((other.penalty().particles(body).positions - before).cwiseAbs().maxCoeff(), 1e-4) << "at rest";
      EXPECT_NEAR(center(body).x(), -0.05, 0.1);
    }
}

TEST_P(MeshSides, ATorusHangsOnAPole) {
  // A closed pole through the hole, a step wider further down.
  const MeshData pole = box_mesh({0.2, 1, 0.2}), step = box_mesh({0.6, 0.1, 0.6}).shifted({0, -0.5, 0});
  for (const bool turned : {false, true}) {
    Simulation other(GetParam());
    other.set_gravity({0, -9.81, 0});
    const MeshData both = pole.with(step);
    add_mesh(other, turned ? both.turned() : both, 0.01);
    btSoftBody& body = other.add_jelly(make_torus(0.7, 0.25, 2, 18), jelly_with(0.02, {0.1, 0.2, 0}));
    throw_at(other, body, {-3, 0, 0.5});
    for (int k = 0; k < 180; ++k) {
      other.step(frame);
      ASSERT_TRUE(other.penalty().report(body).finite);
      const Real outside = least(body, [](const Vector3& x) {
        return std::min(box_distance(x, {0.2, 1, 0.2}), box_distance(x - Vector3(0, -0.5, 0), {0.6, 0.1, 0.6}));
      });
      ASSERT_GT(outside, 0.03 - 2e-3) << "in step " << k;
    }
    EXPECT_NEAR(center(body).y(), -0.4 + 0.03 + 0.25, 0.05) << "lies on the step";
    EXPECT_LT(std::hypot(center(body).x(), center(body).z()), 0.3);
  }
}

/// Cloth 1.6 m wide, of so many cells each way, at height y.
class Draped : public MeshSides {
 protected:
  static btSoftBody& add_cloth(Simulation& sim, int cells, Real y, Real margin) {
    TriangleSurface surface = make_sheet(1.6, 1.6, cells, cells);
    const Eigen::Matrix3Xd flat = surface.vertices.colwise() - surface.vertices.rowwise().mean();
    surface.vertices.row(0) = flat.row(0);
    surface.vertices.row(1).setConstant(y);
    surface.vertices.row(2) = -flat.row(1);
    auto& body = sim.add(make_soft_body(sim.info(), surface, SoftBodyOptions{.margin = margin, .friction = 1}));
    PotentialField field(surface.vertices);
    field.add<Length>(edges_of(surface.triangles), 2.0);
    field.add<BendingAngle>(hinges_of(surface.triangles), 0.001);
    sim.penalty().attach(body, std::move(field), {.step = {.damping_time = 0.005, .drag = 0.5}});
    return body;
  }
  // `outside`: distance of a point from the mesh, negative where it must not be.
  void drape(const MeshData& mesh, Real top, const std::function<Real(const Vector3&)>& outside) {
    for (const auto& [mesh_margin, margin] : all_margins)
      for (const bool turned : {false, true}) {
        SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << (turned ? ", turned" : ""));
        Simulation other(GetParam());
        other.set_gravity({0, -9.81, 0});
        add_mesh(other, turned ? mesh.turned() : mesh, mesh_margin).setFriction(1);
        btSoftBody& body = add_cloth(other, 12, top + 0.1, margin);
        for (int k = 0; k < 90; ++k) {
          other.step(frame);
          ASSERT_TRUE(other.penalty().report(body).finite);
          ASSERT_GT(least(body, outside), mesh_margin + margin - 2.5e-3) << "in step " << k;
        }
        EXPECT_GT(center(body).y(), top - 0.8) << "is still up there";
        EXPECT_LT(lowest(body), top - 0.2) << "hangs down";
      }
  }
};

TEST_P(Draped, OverARidge) {
  // Of two slopes, half a right angle at the top, open below.
  const Real t = std::tan(pi / 8);
  const MeshData ridge = extruded_mesh({{-t, -1}, {0, 0}, {t, -1}}, 2);
  drape(ridge, 0, [&](const Vector3& x) {
    const Vector3 down = Vector3(x.x() < 0 ? -t : t, -1, 0).normalized(),
                  out(-down.y() * (x.x() < 0 ? -1 : 1), t * -down.y(), 0);
    const Real along = x.dot(down), height = x.dot(out);
    return along < 0 ? std::hypot(x.x(), x.y()) : height;
  });
}

TEST_P(Draped, OverACubeSmallerThanItself) {
  const Vector3 half(0.3, 0.3, 0.3);
  drape(box_mesh(half), 0.3, [&](const Vector3& x) { return box_distance(x, half); });
}

TEST_P(Draped, OverTwoTriangles) {
  // Hangs over the rims of a table without thickness, and may swing in under it, but not through it.
  constexpr Real half = 0.4;
  for (const auto& [mesh_margin, margin] : all_margins)
    for (const bool turned : {false, true}) {
      SCOPED_TRACE(::testing::Message() << "margins " << mesh_margin << ", " << margin << (turned ? ", turned" : ""));
      Simulation other(GetParam());
      other.set_gravity({0, -9.81, 0});
      add_mesh(other, turned ? sheet_mesh(half, half).turned() : sheet_mesh(half, half), mesh_margin).setFriction(1);
      btSoftBody& body = add_cloth(other, 12, 0.1, margin);
      std::vector<int> side(body.m_nodes.size(),
                            1);  // where it was last seen beside the mesh; 0: beyond its rims since
      for (int k = 0; k < 90; ++k) {
        other.step(frame);
        ASSERT_TRUE(other.penalty().report(body).finite);
        for (int i = 0; i < body.m_nodes.size(); ++i) {
          const Vector3 x = to_vector(body.m_nodes[i].m_x);
          if (std::max(std::abs(x.x()), std::abs(x.z())) > half - 5e-3) {
            side[i] = 0;
          } else if (std::abs(x.y()) > 2.5e-3) {
            const int now = x.y() > 0 ? 1 : -1;
            ASSERT_NE(now, -side[i]) << "node " << i << " at " << x.transpose() << " in step " << k;
            side[i] = now;
          }
        }
      }
      EXPECT_GT(center(body).y(), -0.6) << "is still up there";
      EXPECT_LT(lowest(body), -0.2) << "hangs down";
    }
}

INSTANTIATE_TEST_SUITE_P(World, MeshSides, both_worlds(), param_name);
INSTANTIATE_TEST_SUITE_P(World, Draped, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
