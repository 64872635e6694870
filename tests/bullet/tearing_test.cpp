// Faces go with the elements that hold them: from rays and from contact, and come back with them.
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include "bullet/simulation.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

constexpr Real stretch = 1.01;

class Tearing : public WorldTest {
 protected:
  // A sheet 1 m wide in the plane y = 0, stretched, its rim pinned.
  static btSoftBody& add_sheet(Simulation& in, const TriangleSurface& sheet) {
    SoftBodyOptions options{.mass = 0.1, .margin = 0.005};
    for (int i = 0; i < sheet.vertices.cols(); ++i)
      if ((sheet.vertices.col(i) - Vector3(0.5, 0, 0.5)).cwiseAbs().maxCoeff() > 0.49) options.pinned.push_back(i);
    btSoftBody& body = in.add(make_soft_body(in.info(), sheet, options));
    PotentialField field(sheet.vertices);
    field.add<Length>(edges_of(sheet.triangles), 20);
    pull(body);
    in.penalty().attach(body, std::move(field), {.step = {.damping_time = 0.002}});
    return body;
  }
  static void pull(btSoftBody& body) {
    for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_x *= btScalar(stretch);
  }
  static TriangleSurface flat_sheet(int cells) {
    TriangleSurface sheet = make_sheet(1, 1, cells, cells);
    for (int i = 0; i < sheet.vertices.cols(); ++i)
      sheet.vertices.col(i) = Vector3(sheet.vertices(0, i), 0, sheet.vertices(1, i));
    return sheet;
  }

  static Real distance_from_middle(const TriangleSurface& sheet, const Edge& edge) {
    return ((sheet.vertices.col(edge[0]) + sheet.vertices.col(edge[1])) / 2 - Vector3(0.5, 0, 0.5)).norm();
  }

  // Breaks the springs within `radius` [m] of the middle in the next step; returns them.
  static std::vector<Edge> tear(Simulation& in, btSoftBody& body, const TriangleSurface& sheet, Real radius) {
    Batch<Length>& springs = in.penalty().edit(body).batch<Length>();
    std::vector<Edge> torn;
    for (int e = 0; e < static_cast<int>(springs.num_elements()); ++e)
      if (distance_from_middle(sheet, springs.stencils()[e]) < radius) {
        springs.set_breaking(e, {.upper = (stretch - 1) / 10});
        torn.push_back(springs.stencils()[e]);
      }
    return torn;
  }

  Real hit(const btSoftBody& body, const Vector3& from, const Vector3& to) {
    btCollisionWorld::ClosestRayResultCallback closest(to_bullet(from), to_bullet(to));
    sim.world().rayTest(to_bullet(from), to_bullet(to), closest);
    return closest.m_collisionObject == &body ? Real(closest.m_closestHitFraction) : infinite;
  }
};

Vector3 at(const btSoftBody& body, int node) { return to_vector(body.m_nodes[node].m_x); }

// Twice the area of all faces, and the volume that they enclose.
std::pair<Vector3, Real> enclosed_by_faces(const btSoftBody& body) {
  Vector3 area = Vector3::Zero();
  Real volume = 0;
  for (int k = 0; k < body.m_faces.size(); ++k) {
    Vector3 x[3];
    for (int c = 0; c < 3; ++c) x[c] = to_vector(body.m_faces[k].m_n[c]->m_x);
    const Vector3 twice = (x[1] - x[0]).cross(x[2] - x[0]);
    area += twice;
    volume += x[0].dot(twice) / 6;
  }
  return {area, volume};
}

TEST_P(Tearing, RaysPassFacesOfBrokenSpringsUntilTheseAreMended) {
  const TriangleSurface sheet = flat_sheet(8);
  btSoftBody& body = add_sheet(sim, sheet);
  const auto expect_hits_but_at = [&](const std::vector<Edge>& torn) {
    int missing = 0;
    for (const Triangle& t : sheet.triangles) {
      const bool is_torn = std::any_of(torn.begin(), torn.end(), [&](const Edge& edge) {
        return std::find(t.begin(), t.end(), edge[0]) != t.end() && std::find(t.begin(), t.end(), edge[1]) != t.end();
      });
      const Vector3 middle = (at(body, t[0]) + at(body, t[1]) + at(body, t[2])) / 3;
      EXPECT_EQ(hit(body, middle + Vector3(0, 1, 0), middle - Vector3(0, 1, 0)) == infinite, is_torn);
      missing += is_torn;
    }
    EXPECT_EQ(body.m_faces.size(), static_cast<int>(sheet.triangles.size()));
    return missing;
  };
  sim.step(frame);
  EXPECT_EQ(expect_hits_but_at({}), 0);
  const std::vector<Edge> torn = tear(sim, body, sheet, 0.2);
  sim.step(frame);
  EXPECT_GT(expect_hits_but_at(torn), 8);

  Batch<Length>& springs = sim.penalty().edit(body).batch<Length>();
  springs.set_breaking({.upper = 10});
  for (const Break& b : std::vector<Break>(springs.breaks())) springs.set_enabled(b.element, true);
  sim.step(frame);
  EXPECT_EQ(expect_hits_but_at({}), 0);

  tear(sim, body, sheet, 0.2);
  sim.step(frame, 2);
  sim.penalty().detach(body);
  EXPECT_EQ(expect_hits_but_at({}), 0) << "at once";
}

TEST_P(Tearing, WhatASheetHoldsFallsThroughTheHole) {
  const TriangleSurface sheet = flat_sheet(16);
  Real heights[2];
  for (const bool is_torn : {false, true}) {
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    btSoftBody& body = add_sheet(own, sheet);
    btRigidBody& ball = own.add_rigid(std::make_unique<btSphereShape>(btScalar(0.05)), 0.02, {0.505, 0.15, 0.505});
    if (is_torn) {
      tear(own, body, sheet, 0.22);
      // Particles that nothing holds any more are not to lie in the way.
      for (int i = 0; i < sheet.vertices.cols(); ++i)
        if ((sheet.vertices.col(i) - Vector3(0.5, 0, 0.5)).norm() < 0.15) body.m_nodes[i].m_v = btVector3(0, -10, 0);
    }
    own.step(frame, 60);
    heights[is_torn] = Real(ball.getWorldTransform().getOrigin().y());
    EXPECT_TRUE(own.penalty().report(body).finite);
  }
  EXPECT_GT(heights[0], -0.2);
  EXPECT_LT(heights[1], -2) << "falls freely";
}

TEST_P(Tearing, TheFacesBehindBrokenTetrahedraCloseTheBody) {
  const TetMesh box = make_box({1, 1, 1}, {4, 4, 4});
  btSoftBody& body = sim.add(make_soft_body(sim.info(), box, {.mass = 10}));
  const int skin = body.m_faces.size();
  PotentialField field(box.vertices);
  field.add<TetrahedronVolume>(box.tetrahedra, 0.01);  // still stretched when it is looked at
  pull(body);
  sim.penalty().attach(body, std::move(field));
  sim.step(frame);  // Bullet makes its trees in the first step, and follows them from then on
  std::vector<Tetrahedron> whole;
  Batch<TetrahedronVolume>& volumes = sim.penalty().edit(body).batch<TetrahedronVolume>();
  for (int e = 0; e < static_cast<int>(box.tetrahedra.size()); ++e) {
    const Tetrahedron& t = box.tetrahedra[e];
    Vector3 middle = Vector3::Zero();
    for (const int i : t) middle += box.vertices.col(i) / 4;
    if (middle.minCoeff() > 0.5)
      volumes.set_breaking(e, {.upper = 0.01});
    else
      whole.push_back(t);
  }
  sim.step(frame);

  const auto [area, by_faces] = enclosed_by_faces(body);
  Real by_tetrahedra = 0;
  int num_whole = 0;
  for (int k = 0; k < body.m_faces.size(); ++k) num_whole += body.m_faces[k].m_n[0] != body.m_faces[k].m_n[1];
  for (const auto& [a, b, c, d] : whole)
    by_tetrahedra += (at(body, b) - at(body, a)).dot((at(body, c) - at(body, a)).cross(at(body, d) - at(body, a))) / 6;
  EXPECT_LT(area.norm(), limit(1e-12, 1e-6));
  EXPECT_NEAR(by_faces, by_tetrahedra, limit(1e-12, 1e-6));
  EXPECT_LT(by_faces, 0.95);
  EXPECT_GT(body.m_faces.size(), skin);
  EXPECT_LT(num_whole, body.m_faces.size());
  // From above into the notch, and beside it.
  EXPECT_NEAR(2 * hit(body, {0.8, 2, 0.83}, {0.8, 0, 0.83}), 2 - stretch / 2, 0.02);
  EXPECT_NEAR(2 * hit(body, {0.3, 2, 0.33}, {0.3, 0, 0.33}), 2 - stretch, 0.02);
}

TEST_P(Tearing, FacesLookOutOfWhatIsLeftAndAreGivenBack) {
  constexpr Real hardly_moved = 1e-3;  // in three frames, soft as it is [m³]; a cell has 1/64
  const TetMesh box = make_box({1, 1, 1}, {4, 4, 4});
  btSoftBody& body = sim.add(make_soft_body(sim.info(), box, {.mass = 10}));
  const int skin = body.m_faces.size();
  PotentialField field(box.vertices);
  field.add<TetrahedronVolume>(box.tetrahedra, 0.01);
  pull(body);
  sim.penalty().attach(body, std::move(field));
  const auto is_above = [&](int e) {
    Real sum = 0;
    for (const int i : box.tetrahedra[e]) sum += box.vertices(1, i);
    return sum / 4 > 0.5;
  };
  for (const bool above : {true, false, true}) {  // the half that goes; the other is mended
    Batch<TetrahedronVolume>& volumes = sim.penalty().edit(body).batch<TetrahedronVolume>();
    for (int e = 0; e < static_cast<int>(box.tetrahedra.size()); ++e) {
      volumes.set_breaking(e, {.upper = is_above(e) == above ? 0.01 : 10});
      volumes.set_enabled(e, true);
    }
    sim.step(frame);
    const auto [area, volume] = enclosed_by_faces(body);
    EXPECT_LT(area.norm(), limit(1e-12, 1e-6));
    EXPECT_NEAR(volume, std::pow(stretch, 3) / 2, hardly_moved) << (above ? "below" : "above");
    EXPECT_GT(body.m_faces.size(), skin);
  }
  sim.penalty().detach(body);
  EXPECT_EQ(body.m_faces.size(), skin);
  EXPECT_NEAR(enclosed_by_faces(body).second, std::pow(stretch, 3), hardly_moved);
  EXPECT_NEAR(2 * hit(body, {0.3, 2, 0.33}, {0.3, 0, 0.33}), 2 - stretch, 0.02);
}

// Far from its rest shape a body goes by its soft phase, whose elements must not hold what broke in the stiff one.
TEST_P(Tearing, PiecesOfABodyOfTwoPhasesFlyWithWhatTheyHad) {
  sim.set_gravity({0, 0, 0});
  const TetMesh cube = make_box({1, 1, 1}, {2, 2, 2});
  btSoftBody& body = sim.add(make_soft_body(sim.info(), cube, {.mass = 1}));
  PotentialField field = make_recovering_field(cube.vertices, cube.tetrahedra, Material{.young = 1e5, .poisson = 0.45});
  field.batch<StableNeoHookean>().set_breaking({.upper = 0.5});
  sim.penalty().attach(body, std::move(field));
  sim.step(frame);
  body.scale({btScalar(1.35), btScalar(1.35), 1});
  sim.step(frame);
  const auto flows = [&] { return sim.penalty().flows(body); };
  const Real given = flows().changes;
  ASSERT_GT(flows().inelastic, 0.1 * given);
  for (int k = 0; k < 30; ++k) {
    sim.step(frame);
    const StepReport& report = sim.penalty().report(body);
    ASSERT_TRUE(report.finite) << report.problem;
    ASSERT_NEAR(flows().changes, given, limit(1e-9, 1e-4) * given) << "frame " << k;
    ASSERT_LE(report.elastic_energy + report.kinetic_energy + flows().inelastic, 1.01 * given) << "frame " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, Tearing, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
