// From a material to a body: what a pull on a cube measures.
#include <Eigen/SparseCholesky>
#include <numeric>

#include "fields/meshes.h"
#include "penalty/stepping/relax.h"

namespace penalty::testing {
namespace {

// The small displacement that makes the energy least, from the stiffness at rest: 3 x P. Coordinates of `fixed` keep
// what `displacement` says; `load` acts on the others [N].
Eigen::Matrix3Xd equilibrium(const PotentialField& field, Eigen::Matrix3Xd displacement,
                             const Eigen::Array<bool, 3, Eigen::Dynamic>& fixed, const Eigen::Matrix3Xd& load) {
  const System assembled_stiffness = assembled(field, field.rest_positions(), StiffnessModel::exact);
  const BlockMatrix& stiffness = assembled_stiffness.blocks();
  std::vector<int> unknown(static_cast<std::size_t>(fixed.size()));  // index among the free coordinates, or -1
  int num_unknown = 0;
  for (Eigen::Index c = 0; c < fixed.size(); ++c) unknown[c] = fixed.data()[c] ? -1 : num_unknown++;
  std::vector<Eigen::Triplet<Real>> entries;
  Eigen::VectorXd right_side = Eigen::VectorXd::Zero(num_unknown);
  for (std::size_t c = 0; c < unknown.size(); ++c)
    if (unknown[c] >= 0) right_side[unknown[c]] = load.data()[c];
  for (int i = 0; i < stiffness.num_particles(); ++i)
    stiffness.visit_row(i, [&](int j, const Matrix3& block) {
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          const int row = unknown[3 * i + a], column = unknown[3 * j + b];
          if (row < 0) continue;
          if (column < 0)
            right_side[row] -= block(a, b) * displacement(b, j);
          else
            entries.emplace_back(row, column, block(a, b));
        }
    });
  Eigen::SparseMatrix<Real> k(num_unknown, num_unknown);
  k.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<Real>> factors(k);
  EXPECT_EQ(factors.info(), Eigen::Success);
  const Eigen::VectorXd solution = factors.solve(right_side);
  for (std::size_t c = 0; c < unknown.size(); ++c)
    if (unknown[c] >= 0) displacement.data()[c] = solution[unknown[c]];
  return displacement;
}

struct Moduli {
  Real young, poisson;
};

// Of a unit cube between two smooth plates that pull it by a small strain. The sides are free; three more fixed
// coordinates stop rigid motion.
Moduli measured(const PotentialField& field) {
  const PackedVectors& rest = field.rest_positions();
  const Eigen::Index num_particles = rest.cols();
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, num_particles);
  Eigen::Array<bool, 3, Eigen::Dynamic> fixed =
      Eigen::Array<bool, 3, Eigen::Dynamic>::Constant(3, num_particles, false);
  for (Eigen::Index i = 0; i < num_particles; ++i) {
    const Vector3 p = rest.col(i).head<3>();
    const bool top = p.z() > 1 - 1e-9, bottom = p.z() < 1e-9;
    if (top) u(2, i) = 1;  // strain 1: linear, so any
    fixed(2, i) = top || bottom;
    if (p.norm() < 1e-9) fixed(0, i) = fixed(1, i) = true;
    if ((p - Vector3::UnitX()).norm() < 1e-9) fixed(1, i) = true;
  }
  u = equilibrium(field, u, fixed, Eigen::Matrix3Xd::Zero(3, num_particles));

  PackedVectors f = PackedVectors::Zero(4, num_particles);
  assembled(field, rest, StiffnessModel::exact).add_product(pack(u), 1, f);
  // Mean strain across, from the displacements of the four sides.
  Real across = 0;
  int on_sides = 0;
  for (Eigen::Index i = 0; i < num_particles; ++i)
    for (int axis : {0, 1})
      if (rest(axis, i) > 1 - 1e-9 || rest(axis, i) < 1e-9) {
        const Real mean = u.row(axis).mean();
        across += (u(axis, i) - mean) * (rest(axis, i) - 0.5) * 4;
        ++on_sides;
      }
  // u K u = 2 E = young * strain² * volume
  return {pack(u).cwiseProduct(f).sum(), -across / on_sides};
}

Real measured_young(const PotentialField& field) { return measured(field).young; }

// The end of the beam 4 x 1 x 1 m, clamped at x = 0, under a shear load on its end face, over that of Timoshenko's
// beam.
Real tip_over_timoshenko(int cells_across, const Material& material, ElasticModel model) {
  const TetMesh mesh = make_beam(cells_across);
  const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, material, model);
  const Eigen::Index num_particles = mesh.vertices.cols();
  const Vector3 low = mesh.vertices.rowwise().minCoeff(), high = mesh.vertices.rowwise().maxCoeff();
  Eigen::Array<bool, 3, Eigen::Dynamic> fixed =
      Eigen::Array<bool, 3, Eigen::Dynamic>::Constant(3, num_particles, false);
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, num_particles);
  Real weight = 0;
  for (Eigen::Index i = 0; i < num_particles; ++i) {
    const Vector3 p = mesh.vertices.col(i);
    if (p.x() < low.x() + 1e-9) fixed.col(i) = true;
    if (p.x() < high.x() - 1e-9) continue;
    // Shares of the end face: inner vertices 1, those of an edge 1/2, of a corner 1/4.
    load(1, i) = 1;
    for (int axis : {1, 2})
      if (p[axis] < low[axis] + 1e-9 || p[axis] > high[axis] - 1e-9) load(1, i) /= 2;
    weight += load(1, i);
  }
  load /= weight;
  const Eigen::Matrix3Xd u = equilibrium(field, Eigen::Matrix3Xd::Zero(3, num_particles), fixed, load);
  const Real tip = load.cwiseProduct(u).sum();
  const Real nu = material.poisson, length = 4, inertia = 1.0 / 12, shape = 10 * (1 + nu) / (12 + 11 * nu);
  const Real bending = length * length * length / (3 * material.young * inertia);
  const Real shear = length / (shape * material.lame_mu());
  return tip / (bending + shear);
}

TetMesh cube(int cells) { return make_box({1, 1, 1}, {cells, cells, cells}); }

TEST(Material, StiffnessOfABodyDoesNotDependOnItsMesh) {
  for (const Real poisson : {0.25, 0.35, 0.45}) {
    SCOPED_TRACE("Poisson's ratio " + std::to_string(poisson));
    const Material material{.young = 2e5, .poisson = poisson};
    std::vector<Real> young;
    for (const int cells : {2, 4, 8}) {
      const TetMesh mesh = cube(cells);
      young.push_back(measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, material)) / material.young);
    }
    const auto [least, most] = std::minmax_element(young.begin(), young.end());
    RecordProperty("poisson_" + std::to_string(poisson).substr(2, 2),
                   std::to_string(young[0]) + " " + std::to_string(young[1]) + " " + std::to_string(young[2]));
    EXPECT_LT(*most / *least, 1.03) << young[0] << " " << young[1] << " " << young[2];
    // Tetrahedra cut from cubes are not isotropic, so the springs are up to a quarter too stiff along the axes.
    EXPECT_GT(*least, 1);
    EXPECT_LT(*most, 1.26);
  }
}

TEST(Material, NeoHookeanHasExactModuliOnAnyMesh) {
  for (const Real poisson : {0.0, 0.25, 0.35, 0.45, 0.49})
    for (const int cells : {2, 4, 8}) {
      SCOPED_TRACE("Poisson's ratio " + std::to_string(poisson) + ", cells " + std::to_string(cells));
      const TetMesh mesh = cube(cells);
      const Moduli m = measured(make_elastic_field(
          mesh.vertices, mesh.tetrahedra, Material{.young = 1, .poisson = poisson}, ElasticModel::neo_hookean));
      EXPECT_NEAR(m.young, 1, 1e-3);
      EXPECT_NEAR(m.poisson, poisson, 1e-3);
    }
}

TEST(Material, SpringsWithAreasDoNotDependOnTheMeshEither) {
  for (const Real poisson : {0.3, 0.4}) {
    std::vector<Real> young;
    for (const int cells : {2, 4, 8}) {
      const TetMesh mesh = cube(cells);
      young.push_back(
          measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1, .poisson = poisson},
                                            ElasticModel::springs_areas_volumes)));
    }
    const auto [least, most] = std::minmax_element(young.begin(), young.end());
    EXPECT_LT(*most / *least, 1.03) << young[0] << " " << young[1] << " " << young[2];
    EXPECT_GT(*least, 0.9);
    EXPECT_LT(*most, 1.3);
  }
}

TEST(Cantilever, ConvergesToTimoshenkosBeam) {
  // Linear tetrahedra are too stiff in bending, the less so the finer they are.
  const Material material{.young = 1, .poisson = 0.25};
  Real last = 0;
  std::string tips;
  for (const int cells : {1, 2, 4, 8}) {
    const Real tip = tip_over_timoshenko(cells, material, ElasticModel::neo_hookean);
    EXPECT_GT(tip, last) << cells;
    last = tip;
    tips += std::to_string(tip) + " ";
  }
  RecordProperty("neo_hookean", tips);
  EXPECT_NEAR(last, 1, 0.05);
  RecordProperty("springs", std::to_string(tip_over_timoshenko(8, material, ElasticModel::springs_volumes)));
}

TEST(Material, StiffnessScalesWithYoungsModulus) {
  const TetMesh mesh = cube(2);
  const Real soft = measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1}));
  const Real hard = measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1e9}));
  EXPECT_NEAR(hard / soft, 1e9, 1e-3);
}

// A bar of 0.03 x 0.03 x 1 m, its lower half of one material, its upper half of another.
PotentialField bar(const Material& lower, const Material& upper, ElasticModel model) {
  const TetMesh mesh = make_box({0.03, 0.03, 1}, {2, 2, 66});
  Materials materials{.kinds = {lower, upper}, .kind_of = {}};
  for (const Tetrahedron& t : mesh.tetrahedra)
    materials.kind_of.push_back(mesh.vertices(Eigen::all, t).row(2).mean() < 0.5 ? 0 : 1);
  return make_elastic_field(mesh.vertices, mesh.tetrahedra, materials, model);
}

// Where they meet, the softer one cannot contract as it would, over a width or so: the bar is a little too stiff.
TEST(Materials, OfTwoHalvesOfABarActAsSpringsInSeries) {
  const Material soft{.young = 1e5, .poisson = 0.35};
  for (const ElasticModel model :
       {ElasticModel::neo_hookean, ElasticModel::springs_volumes, ElasticModel::springs_areas_volumes})
    for (const Material& stiff : {Material{.young = 1e6, .poisson = 0.3}, Material{.young = 1e8, .poisson = 0.35}}) {
      SCOPED_TRACE(Material::name_of(model) + std::string(", ") + std::to_string(stiff.young));
      // On this mesh springs have moduli of their own along the bar.
      const Real first = measured_young(bar(soft, soft, model)), second = measured_young(bar(stiff, stiff, model));
      const Real ratio = measured_young(bar(soft, stiff, model)) * (1 / first + 1 / second) / 2;
      RecordProperty("times series", std::to_string(ratio));
      EXPECT_GT(ratio, 1);
      EXPECT_LT(ratio, 1.01);
    }
  const Material one{.young = 2, .poisson = 0}, other{.young = 300, .poisson = 0};  // contract not at all
  EXPECT_NEAR(measured_young(bar(one, other, ElasticModel::neo_hookean)) / (0.03 * 0.03), 2 / (1.0 / 2 + 1.0 / 300),
              1e-6);
}

TEST(Materials, ShareTheEdgesBetweenThem) {
  // Two tetrahedra on one face: an edge of it stands for a sixth of both, any other of one.
  Eigen::Matrix3Xd vertices(3, 5);
  vertices << 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, -2;
  const std::vector<Tetrahedron> tetrahedra{{0, 1, 2, 3}, {0, 2, 1, 4}};
  const Material soft{.young = 1e5, .poisson = 0.25, .damping = 0.01}, stiff{.young = 3e5, .poisson = 0.4};
  const PotentialField field = make_elastic_field(vertices, tetrahedra, Materials{{soft, stiff}, {0, 1}});
  const auto k = [](const Material& m, Real volume) { return 15 * m.young / (2 * (1 + m.poisson)) * volume / 6; };
  const ElementBatch& springs = field.batch<Length>();
  const std::vector<Edge> edges = edges_of(tetrahedra);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const bool of_soft = edges[e][1] != 4, of_stiff = edges[e][1] != 3;
    EXPECT_NEAR(springs.stiffness(static_cast<int>(e)), of_soft * k(soft, 1.0 / 6) + of_stiff * k(stiff, 1.0 / 3),
                1e-9);
  }
  EXPECT_EQ(field.batch<TetrahedronVolume>().num_elements(), 1u);  // the soft one has the ratio of its springs
  EXPECT_TRUE(field.damps());
}

TEST(Materials, OfTwoHalvesFindBackFromAPlane) {
  const TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
  Materials materials{.kinds = {{.young = 1e5, .poisson = 0.3}, {.young = 1e6, .poisson = 0.45}}, .kind_of = {}};
  for (const Tetrahedron& t : mesh.tetrahedra)
    materials.kind_of.push_back(mesh.vertices(Eigen::all, t).row(2).mean() < 0.5 ? 0 : 1);
  PotentialField field = make_recovering_field(mesh.vertices, mesh.tetrahedra, materials);
  PackedVectors x = field.rest_positions();
  x.row(1).setZero();
  relax(field, x);
  const std::vector<Edge> edges = edges_of(mesh.tetrahedra);
  for (const auto& [a, b] : edges) {
    const Real rest = (mesh.vertices.col(b) - mesh.vertices.col(a)).norm();
    EXPECT_NEAR((x.col(b) - x.col(a)).norm(), rest, 1e-3 * rest);
  }
}

TEST(Materials, NameWhatIsWrong) {
  const TetMesh mesh = make_box({1, 1, 1}, {1, 1, 1});
  const auto refusal = [&](const Materials& materials) -> std::string {
    try {
      make_elastic_field(mesh.vertices, mesh.tetrahedra, materials);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const std::size_t size = mesh.tetrahedra.size();
  std::vector<int> all(size, 0);
  EXPECT_EQ(refusal({{Material{}}, {0}}), "materials: they are those of 1 tetrahedra, not of " + std::to_string(size));
  PotentialField field(mesh.vertices);
  EXPECT_THROW(
      field.add<StableNeoHookean>(std::vector<StableNeoHookean>{}, mesh.tetrahedra, std::vector<Real>(size, 1)),
      std::invalid_argument);
  EXPECT_EQ(refusal({{}, all}), "materials: tetrahedron 0 is of material 0, there are 0");
  EXPECT_EQ(refusal({{Material{}, Material{.young = -1}}, all}),
            "material 1: Young's modulus is -1, must be positive and finite [Pa]");
}

TEST(SameStiffnessForAll, GrowsStifferAsTheMeshIsRefined) {
  // Of half the size, there are eight times as many elements that each hold the same energy at a strain.
  Real last = 0;
  for (const int cells : {2, 4, 8}) {
    const TetMesh mesh = cube(cells);
    const Real young = measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, 1.0));
    if (last > 0) {
      EXPECT_GT(young / last, 5.5);
      EXPECT_LT(young / last, 8);
    }
    last = young;
  }
}

TEST(ElasticField, SharesTheStiffnessOutByVolume) {
  Random random(5);
  const TetMesh mesh = noisy_box({2, 1, 3}, 0.4, 0.1, random);
  const Material material{.young = 3e4, .poisson = 0.4};
  const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, material);
  const Batch<Length>* lengths = field.find<Length>();
  const Batch<TetrahedronVolume>* volumes = field.find<TetrahedronVolume>();
  ASSERT_TRUE(lengths && volumes);
  EXPECT_EQ(lengths->stencils(), edges_of(mesh.tetrahedra));
  EXPECT_EQ(volumes->stencils(), mesh.tetrahedra);
  const std::vector<Real> v = signed_volumes(mesh.vertices, mesh.tetrahedra);
  const Real volume = std::accumulate(v.begin(), v.end(), 0.0);
  const auto sum = [](const std::vector<Real>& k) { return std::accumulate(k.begin(), k.end(), 0.0); };
  EXPECT_NEAR(sum(lengths->stiffnesses()), 15 * material.lame_mu() * volume, 1e-9);
  EXPECT_NEAR(sum(volumes->stiffnesses()), (material.lame_lambda() - material.lame_mu()) * volume, 1e-9);
  for (std::size_t t = 0; t < v.size(); ++t)
    EXPECT_NEAR(volumes->stiffnesses()[t], (material.lame_lambda() - material.lame_mu()) * v[t], 1e-10);
}

TEST(ElasticField, AtPoissonOneQuarterHasNoVolumeBatch) {
  const TetMesh mesh = cube(2);
  for (const Real young : {1.0, 1e5, 3e7, 1.7e11}) {
    const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{young, 0.25, 1000});
    EXPECT_NE(field.find<Length>(), nullptr);
    EXPECT_EQ(field.find<TetrahedronVolume>(), nullptr) << young;
  }
}

TEST(ElasticField, DampsAsItsMaterialSays) {
  const TetMesh mesh = cube(1);
  for (const ElasticModel model :
       {ElasticModel::springs_volumes, ElasticModel::springs_areas_volumes, ElasticModel::neo_hookean}) {
    EXPECT_FALSE(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{}, model).damps());
    const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.damping = 0.02}, model);
    EXPECT_TRUE(field.damps());
    Random random(1);
    const PackedVectors v = random_packed(8, 1, random);
    const PackedVectors own = damping_forces(field, field.rest_positions(), v, 0);
    const PackedVectors of_step = damping_forces(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{}, model),
                                                 field.rest_positions(), v, 0.02);
    ASSERT_GT(own.norm(), 0);
    EXPECT_LT(relative_error(own, of_step), 1e-14);
  }
}

TEST(ElasticField, AreasTakeTheirShareOfTheShearModulus) {
  Random random(6);
  const TetMesh mesh = noisy_box({2, 2, 1}, 0.5, 0.1, random);
  const Material material{.young = 2e4, .poisson = 0.4};
  const PotentialField field =
      make_elastic_field(mesh.vertices, mesh.tetrahedra, material, ElasticModel::springs_areas_volumes);
  const std::vector<Real> v = signed_volumes(mesh.vertices, mesh.tetrahedra);
  const Real volume = std::accumulate(v.begin(), v.end(), 0.0);
  const auto sum = [](const std::vector<Real>& k) { return std::accumulate(k.begin(), k.end(), 0.0); };
  const Real mu = material.lame_mu(), a = Material::area_share;
  EXPECT_NEAR(sum(field.find<Length>()->stiffnesses()), 15 * (1 - a) * mu * volume, 1e-9 * mu);
  EXPECT_NEAR(sum(field.find<TriangleArea>()->stiffnesses()), 15 * a * mu * volume, 1e-9 * mu);
  EXPECT_NEAR(sum(field.find<TetrahedronVolume>()->stiffnesses()), (material.lame_lambda() - (1 + 5 * a) * mu) * volume,
              1e-9 * mu);
}

TEST(ElasticField, TakesLeftHandedTetrahedra) {
  TetMesh mesh = cube(1);
  const Material material{.young = 1, .poisson = 0.4};
  const Real right_handed = measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, material));
  for (Tetrahedron& t : mesh.tetrahedra) std::swap(t[0], t[1]);
  EXPECT_NEAR(measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, material)), right_handed, 1e-12);
}

TEST(ElasticField, RefusesWhatItsMaterialRefuses) {
  const TetMesh mesh = cube(1);
  EXPECT_THROW(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.poisson = 0.2}), std::invalid_argument);
  EXPECT_EQ(complaint<std::invalid_argument>([&] { make_elastic_field(mesh.vertices, mesh.tetrahedra, -1.0); }),
            "length 0: stiffness is -1 J, must be positive and finite");
}

TEST(ElasticField, NamesTheTetrahedronThatIsFlat) {
  TetMesh mesh = cube(1);
  mesh.tetrahedra[3] = {0, 1, 2, 1};
  for (const ElasticModel model :
       {ElasticModel::springs_volumes, ElasticModel::springs_areas_volumes, ElasticModel::neo_hookean})
    EXPECT_EQ(complaint<std::invalid_argument>(
                  [&] { make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.poisson = 0.4}, model); }),
              "elastic field: tetrahedron 3 has no volume at rest");
}

}  // namespace
}  // namespace penalty::testing
