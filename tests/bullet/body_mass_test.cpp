// The mass of a body by the density of its material.
#include <limits>

#include "bullet/simulation.h"
#include "penalty/mesh/regions.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

constexpr Material wood{.density = 800};

Real mass_of_node(const btSoftBody& body, int node) { return 1 / Real(body.m_nodes[node].m_im); }

Real mass_of(const btSoftBody& body) {
  Real mass = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) mass += mass_of_node(body, i);
  return mass;
}

class MassByDensity : public WorldTest {
 protected:
  template <class... Arguments>
  std::string refusal(const Arguments&... arguments) {
    return complaint<std::invalid_argument>([&] { make_soft_body(sim.info(), arguments...); });
  }
};

TEST_P(MassByDensity, IsDensityTimesVolumeHoweverFineTheMesh) {
  for (const int cells : {1, 3})
    for (const bool equal : {true, false}) {
      const TetMesh box = make_box({1, 2, 3}, {cells, 2 * cells, cells});
      const auto body = make_soft_body(sim.info(), box, wood, {.equal_masses = equal});
      EXPECT_NEAR(mass_of(*body) / (800 * 1 * 2 * 3), 1, limit(1e-12, 1e-5)) << cells << equal;
    }
}

TEST_P(MassByDensity, IsSharedOutAlikeUnlessVolumesAreAskedFor) {
  // Two tetrahedra on the same base, of heights 1 and 3 m: 1/6 and 1/2 m³.
  TetMesh mesh;
  mesh.vertices.resize(3, 5);
  mesh.vertices << 0, 1, 0, 0, 0,  //
      0, 0, 1, 0, 0,               //
      0, 0, 0, 1, -3;
  mesh.tetrahedra = {{0, 1, 2, 3}, {0, 2, 1, 4}};
  const auto alike = make_soft_body(sim.info(), mesh, Material{.density = 600});
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(mass_of_node(*alike, i), 400 / 5.0, 1e-4) << i;
  const auto shares = make_soft_body(sim.info(), mesh, Material{.density = 600}, {.equal_masses = false});
  for (const int base : {0, 1, 2}) EXPECT_NEAR(mass_of_node(*shares, base), 100, 1e-4) << base;
  EXPECT_NEAR(mass_of_node(*shares, 3), 25, 1e-4);
  EXPECT_NEAR(mass_of_node(*shares, 4), 75, 1e-4);
}

TEST_P(MassByDensity, LeavesTheOtherOptionsAlone) {
  const TetMesh box = make_box({1, 1, 1}, {1, 1, 1});
  const auto body = make_soft_body(sim.info(), box, wood, {.pinned = {2}, .margin = 0.01, .friction = 0.25});
  EXPECT_EQ(body->m_nodes[2].m_im, 0);
  EXPECT_NEAR(mass_of_node(*body, 3), 100, 1e-4) << "a pinned node keeps its share to itself";
  EXPECT_FLOAT_EQ(static_cast<float>(body->getCollisionShape()->getMargin()), 0.01f);
  EXPECT_FLOAT_EQ(static_cast<float>(body->m_cfg.kDF), 0.25f);
}

TEST_P(MassByDensity, OfASurfaceTakesItsThickness) {
  const auto sheet = make_soft_body(sim.info(), make_sheet(2, 1.5, 4, 3), wood, 0.01);
  EXPECT_NEAR(mass_of(*sheet), 800 * 2 * 1.5 * 0.01, limit(1e-12, 1e-4));
  const TriangleSurface ball = make_sphere(0.5, 4);
  Real area = 0;
  for (const auto& [a, b, c] : ball.triangles) {
    const Vector3 ab = ball.vertices.col(b) - ball.vertices.col(a), ac = ball.vertices.col(c) - ball.vertices.col(a);
    area += ab.cross(ac).norm() / 2;
  }
  const auto balloon = make_soft_body(sim.info(), ball, wood, 0.002);
  EXPECT_NEAR(mass_of(*balloon) / (800 * area * 0.002), 1, limit(1e-12, 1e-5)) << "the air inside weighs nothing";
}

// A bar of 0.2 x 1 x 0.2 m, its upper half of one material, its lower half of another.
struct TwoHalves {
  TetMesh mesh = make_box({0.2, 1, 0.2}, {2, 10, 2});
  Materials materials;

  TwoHalves(const Material& upper, const Material& lower) {
    mesh.regions = {{"upper", {}}, {"lower", {}}};
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
      mesh.regions[is_lower(t)].members.push_back(static_cast<int>(t));
    mesh.vertex_sets = {{"top", {}}};
    for (int v = 0; v < mesh.vertices.cols(); ++v)
      if (mesh.vertices(1, v) > 1 - 1e-9) mesh.vertex_sets[0].members.push_back(v);
    materials = materials_of(mesh, {{"lower", lower}, {"upper", upper}});
  }
  bool is_lower(std::size_t t) const { return mesh.vertices(Eigen::all, mesh.tetrahedra[t]).row(1).mean() < 0.5; }
};

TEST_P(MassByDensity, OfSeveralMaterialsLiesWhereTheyAre) {
  const TwoHalves bar({.density = 3000}, {.density = 1000});
  for (const bool equal : {true, false}) {
    const auto body = make_soft_body(sim.info(), bar.mesh, bar.materials, {.equal_masses = equal});
    Real mass = 0, moment = 0;
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      mass += mass_of_node(*body, i);
      moment += mass_of_node(*body, i) * bar.mesh.vertices(1, i);
    }
    EXPECT_NEAR(mass, 0.02 * 3000 + 0.02 * 1000, limit(1e-9, 1e-3));
    // 0.75 of the mass at 0.75 m, the rest at 0.25 m; or in eleven layers of equal nodes, five of them three times as
    // heavy as the lowest five, one twice.
    EXPECT_NEAR(moment / mass, equal ? (3 * 4.0 + 2 * 0.5 + 1) / (3 * 5 + 2 + 5) : 0.625, limit(1e-9, 1e-5)) << equal;
  }
  EXPECT_EQ(refusal(bar.mesh, bar.materials, SoftBodyOptions{.mass = 2}),
            "soft body: mass is 2 kg, but the density of the material decides: leave one of them out");
  EXPECT_EQ(refusal(bar.mesh, Materials{{wood}, {0}}),
            "materials: they are those of 1 tetrahedra, not of " + std::to_string(bar.mesh.tetrahedra.size()));
}

TEST_P(MassByDensity, OfSeveralMaterialsStretchesAHangingBarAsBeamTheorySays) {
  const Real heavy = 2000, light = 500, stiff = 8e5, soft = 2e5, g = 9.81, half = 0.5;
  const Material upper{.young = stiff, .poisson = 0, .density = light, .damping = 0.02};
  const Material lower{.young = soft, .poisson = 0, .density = heavy, .damping = 0.02};
  const TwoHalves bar(upper, lower);
  btSoftBody& body = sim.add(make_soft_body(sim.info(), bar.mesh, bar.materials,
                                            {.equal_masses = false, .pinned = bar.mesh.vertex_set("top")}));
  sim.set_gravity({0, -g, 0});
  sim.penalty().attach(
      body, make_elastic_field(bar.mesh.vertices, bar.mesh.tetrahedra, bar.materials, ElasticModel::neo_hookean));
  sim.step(1.0 / 60, 240);
  // A section is pulled by all that hangs below it: strain = g (mass below) / (E area), which is linear in strains of up to
  // 5 %.
  const Real at_half = g * (heavy * half * half + light * half * half / 2) / stiff;
  const Real at_end = at_half + g * heavy * half * half / 2 / soft;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const Real y = bar.mesh.vertices(1, i), sunk = y - Real(body.m_nodes[i].m_x.y());
    if (std::abs(y - half) < 1e-9) {
      EXPECT_NEAR(sunk / at_half, 1, 0.02);
    } else if (y < 1e-9) {
      EXPECT_NEAR(sunk / at_end, 1, 0.02);
    }
  }
}

TEST_P(MassByDensity, NeedsNumbersThatMakeAMass) {
  const TetMesh box = make_box({1, 1, 1}, {1, 1, 1});
  const TriangleSurface sheet = make_sheet(1, 1, 1, 1);
  EXPECT_EQ(refusal(box, wood, SoftBodyOptions{.mass = 3}),
            "soft body: mass is 3 kg, but the density of the material decides: leave one of them out");
  EXPECT_EQ(refusal(sheet, wood, 0.1, SoftBodyOptions{.mass = 3}),
            "soft body: mass is 3 kg, but the density of the material decides: leave one of them out");
  EXPECT_EQ(refusal(box, Material{.density = 0}), "soft body: density is 0, must be positive and finite [kg/m³]");
  EXPECT_EQ(refusal(box, Material{.density = std::numeric_limits<Real>::quiet_NaN()}),
            "soft body: density is nan, must be positive and finite [kg/m³]");
  EXPECT_EQ(refusal(sheet, wood, 0.0), "soft body: thickness is 0, must be positive and finite [m]");
  EXPECT_EQ(refusal(TetMesh{}, wood), "soft body: volume is 0, must be positive and finite [m³] for a mass by density");
  TetMesh broken = box;
  broken.tetrahedra[1][3] = 8;
  EXPECT_EQ(refusal(broken, wood), "soft body: tetrahedron 1: vertex index 8 is outside the 8 vertices");
  EXPECT_EQ(refusal(broken), "soft body: tetrahedron 1: vertex index 8 is outside the 8 vertices");
}

INSTANTIATE_TEST_SUITE_P(World, MassByDensity, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
