// From a material to a body: what a pull on a cube measures.
#include <Eigen/SparseCholesky>
#include <numeric>

#include "assembly/meshes.h"

namespace penalty::testing {
namespace {

// Young's modulus of a unit cube between two smooth plates that pull it by a small strain: the displacement that makes
// the energy least, from the stiffness at rest. The sides are free; three more fixed coordinates stop rigid motion.
Real measured_young(const PotentialField& field) {
  const PackedVectors& rest = field.rest_positions();
  const Eigen::Index num_particles = rest.cols();
  const BlockMatrix stiffness = assembled(field, rest, StiffnessModel::exact);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * num_particles);
  std::vector<int> unknown(3 * num_particles, 0);  // index among the free coordinates, or -1
  for (Eigen::Index i = 0; i < num_particles; ++i) {
    const Vector3 p = rest.col(i).head<3>();
    const bool top = p.z() > 1 - 1e-9, bottom = p.z() < 1e-9;
    if (top) u[3 * i + 2] = 1;  // strain 1: linear, so any
    if (top || bottom) unknown[3 * i + 2] = -1;
    if (p.norm() < 1e-9) unknown[3 * i] = unknown[3 * i + 1] = -1;
    if ((p - Vector3::UnitX()).norm() < 1e-9) unknown[3 * i + 1] = -1;
  }
  int num_unknown = 0;
  for (int& index : unknown)
    if (index == 0) index = num_unknown++;

  std::vector<std::pair<int, int>> pattern;
  field.append_pattern(pattern);
  std::sort(pattern.begin(), pattern.end());
  pattern.erase(std::unique(pattern.begin(), pattern.end()), pattern.end());
  std::vector<Eigen::Triplet<Real>> entries;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(num_unknown);
  for (auto [i, j] : pattern) {
    const Matrix3 block = stiffness.block(i, j);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const int row = unknown[3 * i + a], column = unknown[3 * j + b];
        if (row < 0) continue;
        if (column < 0)
          load[row] -= block(a, b) * u[3 * j + b];
        else
          entries.emplace_back(row, column, block(a, b));
      }
  }
  Eigen::SparseMatrix<Real> k(num_unknown, num_unknown);
  k.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<Real>> factors(k);
  EXPECT_EQ(factors.info(), Eigen::Success);
  const Eigen::VectorXd solution = factors.solve(load);
  for (std::size_t c = 0; c < unknown.size(); ++c)
    if (unknown[c] >= 0) u[c] = solution[unknown[c]];

  PackedVectors displacement = pack(u.reshaped(3, num_particles)), f = PackedVectors::Zero(4, num_particles);
  stiffness.add_product(displacement, 1, f);
  return displacement.cwiseProduct(f).sum();  // u K u = 2 E = young * strain² * volume
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

TEST(Material, StiffnessScalesWithYoungsModulus) {
  const TetMesh mesh = cube(2);
  const Real soft = measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1}));
  const Real hard = measured_young(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1e9}));
  EXPECT_NEAR(hard / soft, 1e9, 1e-3);
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

}  // namespace
}  // namespace penalty::testing
