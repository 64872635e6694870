// Bodies of triangles only: cloth that lands, hangs and keeps its lengths; errors that say what is wrong.
#include <numbers>

#include "bullet/simulation.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

/// A sheet of 1 kg, its plane turned level, at height y.
TriangleSurface level_sheet(int cells, Real y) {
  TriangleSurface sheet = make_sheet(1, 1, cells, cells);
  const Eigen::Matrix3Xd upright = sheet.vertices;
  sheet.vertices.row(1).setConstant(y);
  sheet.vertices.row(2) = -upright.row(1);
  return sheet;
}

PotentialField springs(const TriangleSurface& sheet, Real stiffness) {
  PotentialField field(sheet.vertices);
  field.add<Length>(edges_of(sheet.triangles), stiffness);
  return field;
}

Real largest_strain(const TriangleSurface& sheet, const Particles& particles) {
  Real largest = 0;
  for (const auto& [a, b] : edges_of(sheet.triangles)) {
    const Real rest = (sheet.vertices.col(b) - sheet.vertices.col(a)).norm();
    const Real now = (particles.positions.col(b) - particles.positions.col(a)).norm();
    largest = std::max(largest, std::abs(now / rest - 1));
  }
  return largest;
}

class SurfaceBody : public WorldTest {};
INSTANTIATE_TEST_SUITE_P(World, SurfaceBody, both_worlds(), param_name);

TEST_P(SurfaceBody, NodesAndFacesAreThoseOfTheSurface) {
  const TriangleSurface sheet = make_sheet(2, 1, 4, 3);
  const btSoftBody& body = sim.add(make_soft_body(sim.info(), sheet, {.mass = 3, .pinned = {0}}));
  ASSERT_EQ(body.m_nodes.size(), sheet.vertices.cols());
  ASSERT_EQ(body.m_faces.size(), static_cast<int>(sheet.triangles.size()));
  EXPECT_EQ(body.m_links.size(), 0);
  EXPECT_EQ(body.m_tetras.size(), 0);
  for (int f = 0; f < body.m_faces.size(); ++f)
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(body.m_faces[f].m_n[k], &body.m_nodes[sheet.triangles[static_cast<std::size_t>(f)][k]]);
  for (int i = 0; i < body.m_nodes.size(); ++i)
    EXPECT_NEAR((to_vector(body.m_nodes[i].m_x) - sheet.vertices.col(i)).norm(), 0, 1e-6);
  EXPECT_EQ(body.m_nodes[0].m_im, 0);
  EXPECT_NEAR(Real(body.m_nodes[1].m_im), 20 / 3.0, 1e-6);
}

TEST_P(SurfaceBody, MassesByAreaAddUpAndFollowTheTriangles) {
  const TriangleSurface sheet = make_sheet(2, 1, 2, 1, Diagonals::one_way);
  const auto body = make_soft_body(sim.info(), sheet, {.mass = 12, .equal_masses = false});
  // Four triangles of 3 kg, 1 kg to each corner; both diagonals rise, so that corners 0 and 5 get two shares.
  const Real expected[6] = {2, 3, 1, 1, 3, 2};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(1 / Real(body->m_nodes[i].m_im), expected[i], 1e-6) << i;
}

TEST_P(SurfaceBody, AsksBulletForLinksOnlyWhereBulletsSolverWantsThem) {
  const auto body = make_soft_body(sim.info(), make_sheet(1, 1, 3, 3), {.stock_deformable = true});
  EXPECT_EQ(body->m_links.size(), 3 * 4 + 4 * 3 + 9);
}

TEST_P(SurfaceBody, ASheetFallsFreelyAndThenLiesFlat) {
  sim.set_gravity({0, -9.81, 0});
  sim.add_ground();
  const TriangleSurface sheet = level_sheet(8, 1);
  btSoftBody& body = sim.add(make_soft_body(sim.info(), sheet));
  sim.penalty().attach(body, springs(sheet, 1), {.step = {.damping_time = 0.01}});
  sim.step(frame, 15);
  const Particles& particles = sim.penalty().particles(body);
  const Real fallen = 9.81 / 2 * 0.25 * 0.25;
  EXPECT_NEAR(particles.positions.row(1).minCoeff(), 1 - fallen, 1e-5);
  EXPECT_NEAR(particles.positions.row(1).maxCoeff(), 1 - fallen, 1e-5);
  sim.step(frame, 105);
  ASSERT_TRUE(sim.penalty().report(body).finite);
  EXPECT_GT(particles.positions.row(1).minCoeff(), 0);
  EXPECT_LT(particles.positions.row(1).maxCoeff(), 0.04) << "within the margin of 0.02 m and a little";
  EXPECT_LT(kinetic_energy(particles), 1e-3);
  EXPECT_LT(largest_strain(sheet, particles), 1e-3);
}

TEST_P(SurfaceBody, APinnedSheetHangsStretchedByItsWeight) {
  // A strip one cell wide and upright: no diagonal can buckle sideways, gravity pulls along the columns.
  sim.set_gravity({0, -9.81, 0});
  const int cells = 6;
  const TriangleSurface strip = make_sheet(0.25, 1.5, 1, cells);
  const std::vector<int> top{2 * cells, 2 * cells + 1};
  btSoftBody& body = sim.add(make_soft_body(sim.info(), strip, {.mass = 1, .pinned = top}));
  const Real stiffness = 20;
  sim.penalty().attach(body, springs(strip, stiffness), {.step = {.damping_time = 0.02, .drag = 2}});
  sim.step(frame, 600);
  const Particles& particles = sim.penalty().particles(body);
  ASSERT_TRUE(sim.penalty().report(body).finite);
  EXPECT_LT(kinetic_energy(particles), 1e-8);
  for (const int i : top) EXPECT_EQ(particles.velocities.col(i).norm(), 0);
  // Equilibrium: what the springs pull at the pinned corners is the weight of the other nodes.
  PackedVectors forces = PackedVectors::Zero(4, particles.size());
  sim.penalty().field(body).add_forces(particles.positions, forces);
  const Real weight = 9.81 * 12 / 14;
  EXPECT_NEAR(forces(1, top[0]) + forces(1, top[1]), -weight, 1e-3 * weight);
  EXPECT_NEAR(forces(0, top[0]) + forces(0, top[1]), 0, 1e-3 * weight);
  // Each row carries what hangs below it by two columns and a diagonal: the strain grows upwards.
  Real below = 0;
  for (int j = 0; j < cells; ++j) {
    const Real row = particles.positions(1, 2 * j + 2) - particles.positions(1, 2 * j);
    EXPECT_GT(row, below);
    EXPECT_GT(row, 0.25);
    below = row;
  }
}

TEST_P(SurfaceBody, ABalloonOfSpringsKeepsItsMomenta) {
  const TriangleSurface sphere = make_sphere(0.5, 4);
  btSoftBody& body = sim.add(make_soft_body(sim.info(), sphere, {.equal_masses = false}));
  sim.penalty().attach(body, springs(sphere, 1));
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const btVector3 x = body.m_nodes[i].m_x;
    body.m_nodes[i].m_v = btVector3(btScalar(0.3), 0, 0) + btVector3(0, 2, 1).cross(x) + btScalar(0.5) * x;
  }
  sim.penalty().synchronize(body);
  const Totals before = sim.totals();
  ASSERT_GT(before.angular_momentum.norm(), 0.1);
  sim.step(frame, 60);
  EXPECT_GT(largest_strain(sphere, sim.penalty().particles(body)), 1e-3) << "it does swing";
  const Real bound = limit(1e-12, 1e-6);
  EXPECT_LT((sim.totals().momentum - before.momentum).norm(), bound);
  EXPECT_LT((sim.totals().angular_momentum - before.angular_momentum).norm(), bound);
}

TEST_P(SurfaceBody, NamesWhatItRefuses) {
  const auto complaint = [&](const TriangleSurface& surface, const SoftBodyOptions& options = {}) {
    try {
      make_soft_body(sim.info(), surface, options);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const TriangleSurface sheet = make_sheet(1, 1, 1, 1);
  EXPECT_EQ(complaint(sheet), "");
  EXPECT_EQ(complaint({}), "soft body: the mesh has no vertices");
  EXPECT_EQ(complaint(sheet, {.mass = 0}), "soft body: mass is 0, must be positive and finite [kg]");
  EXPECT_EQ(complaint(sheet, {.pinned = {4}}), "soft body: pinned node 4 is outside the 4 vertices");
  TriangleSurface broken = sheet;
  broken.triangles[1][2] = 7;
  EXPECT_EQ(complaint(broken), "soft body: triangle 1: vertex index 7 is outside the 4 vertices");
  TriangleSurface loose = sheet;
  loose.triangles.pop_back();
  EXPECT_EQ(complaint(loose), "") << "a loose node may carry an equal share";
  EXPECT_EQ(complaint(loose, {.equal_masses = false}),
            "soft body: node 2 has mass 0 kg: no triangle of the mesh holds it");
}

}  // namespace
}  // namespace penalty::testing
