// A field is the sum of its batches, and its derivatives agree with each other and with differences.
#include "penalty/fields/potential_field.h"

#include "fields/meshes.h"
#include "math/eigenvalues.h"

namespace penalty::testing {
namespace {

constexpr StiffnessModel all_models[] = {StiffnessModel::gauss_newton, StiffnessModel::exact,
                                         StiffnessModel::psd_projected};

struct Body {
  TetMesh mesh;
  PotentialField field;
  PackedVectors x;

  static Body random(unsigned seed) {
    Random random(seed);
    TetMesh mesh = noisy_box({2, 2, 1}, 0.5, 0.1, random);
    PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1e3, .poisson = 0.4});
    PackedVectors x = deformed(field.rest_positions(), 0.03, random);
    return {std::move(mesh), std::move(field), std::move(x)};
  }
  Eigen::Index size() const { return x.cols(); }
  PackedVectors forces(const PackedVectors& at) const {
    PackedVectors f = PackedVectors::Zero(4, size());
    field.add_forces(at, f);
    return f;
  }
};

TEST(PotentialField, IsTheSumOfItsBatches) {
  const Body b = Body::random(1);
  ASSERT_EQ(b.field.potentials().size(), 2u);
  Random random(2);
  const PackedVectors v = random_packed(b.size(), 1, random);
  const std::vector<Real> inverse_masses = random_inverse_masses(b.size(), random);
  const auto none = [&] { return PackedVectors(PackedVectors::Zero(4, b.size())); };
  PackedVectors f = none(), damping = none(), dissipated = v;
  std::vector<Real> values;
  Real energy = 0;
  std::size_t elements = 0;
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(3 * b.size(), 3 * b.size());
  for (const auto& batch : b.field.potentials()) {
    energy += batch->add_forces(b.x, f);
    damping += damping_forces(*batch, b.x, v, 0.1);
    batch->dissipate(b.x, inverse_masses, 0.1, 0.1, dissipated);
    for (const Real strain : strains(*batch, b.x)) values.push_back(strain);
    elements += batch->num_elements();
    k += assembled(*batch, b.x, StiffnessModel::exact).to_dense();
  }
  PackedVectors sum_f = none(), sum_dissipated = v;
  EXPECT_GT(energy, 0);
  EXPECT_DOUBLE_EQ(b.field.add_forces(b.x, sum_f), energy);
  EXPECT_DOUBLE_EQ(b.field.energy(b.x), energy);
  b.field.dissipate(b.x, inverse_masses, 0.1, 0.1, sum_dissipated);
  for (const PackedVectors* value : {&f, &damping}) ASSERT_GT(value->norm(), 0);
  EXPECT_EQ(sum_f, f);
  EXPECT_LT(relative_error(damping_forces(b.field, b.x, v, 0.1), damping), 1e-14);
  EXPECT_EQ(sum_dissipated, dissipated);
  EXPECT_EQ(strains(b.field, b.x), values);
  EXPECT_EQ(b.field.num_elements(), elements);
  EXPECT_EQ(values.size(), elements);
  EXPECT_LT(relative_error(assembled(b.field, b.x, StiffnessModel::exact).to_dense(), k), 1e-15);
}

TEST(PotentialField, RestsInItsRestShape) {
  const Body b = Body::random(3);
  EXPECT_LT(b.field.energy(b.field.rest_positions()), 1e-25);
  EXPECT_LT(b.forces(b.field.rest_positions()).norm(), 1e-11);
  EXPECT_GT(b.forces(b.x).norm(), 1);
}

TEST(PotentialField, ForcesAreMinusTheDerivativeOfTheEnergy) {
  WorstError error;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Body b = Body::random(seed);
    const PackedVectors f = b.forces(b.x);
    PackedVectors differences = PackedVectors::Zero(4, b.size()), x = b.x;
    const Real step = 1e-6;
    for (Eigen::Index i = 0; i < b.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        x(axis, i) = b.x(axis, i) + step;
        const Real above = b.field.energy(x);
        x(axis, i) = b.x(axis, i) - step;
        differences(axis, i) = -(above - b.field.energy(x)) / (2 * step);
        x(axis, i) = b.x(axis, i);
      }
    ASSERT_GT(f.norm(), 0);
    error.see(relative_error(differences, f), seed);
  }
  error.expect_below(1e-7, "relative error");
}

TEST(PotentialField, ForcesHaveNoNetForceAndNoNetTorque) {
  WorstError net, torque;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const Body b = Body::random(seed);
    const PackedVectors f = b.forces(b.x);
    Vector3 sum = Vector3::Zero();
    for (Eigen::Index i = 0; i < b.size(); ++i) sum += b.x.col(i).head<3>().cross(f.col(i).head<3>());
    const Real scale = f.colwise().norm().sum();
    net.see(f.rowwise().sum().norm() / scale, seed);
    torque.see(sum.norm() / (scale * b.x.colwise().norm().maxCoeff()), seed);
  }
  net.expect_below(1e-14, "net force");
  torque.expect_below(1e-14, "net torque");
}

TEST(PotentialField, DifferentialOfTheForcesIsTheStiffnessTimesTheDisplacement) {
  WorstError difference_error;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Body b = Body::random(seed);
    Random random(seed + 100);
    const PackedVectors dx = random_packed(b.size(), 1, random);
    PackedVectors product = PackedVectors::Zero(4, b.size());
    assembled(b.field, b.x, StiffnessModel::exact).add_product(dx, -0.5, product);
    const Real step = 1e-6;
    const PackedVectors df = b.forces(b.x + step * dx) - b.forces(b.x - step * dx);
    difference_error.see(relative_error(df / (2 * step), 2 * product), seed);
  }
  difference_error.expect_below(1e-8, "product and differences");
}

TEST(PotentialField, AssembledStiffnessIsSymmetricAndSemidefiniteWhereItShouldBe) {
  int indefinite = 0;
  for (unsigned seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Body b = Body::random(seed);
    for (const StiffnessModel model : all_models) {
      const Eigen::MatrixXd k = assembled(b.field, b.x, model).to_dense();
      EXPECT_LT((k - k.transpose()).norm(), 1e-14 * k.norm());
      const Real smallest = smallest_eigenvalue(k);
      if (model == StiffnessModel::exact)
        indefinite += smallest < -1e-3 * k.norm();
      else
        EXPECT_GT(smallest, -1e-13 * k.norm());
    }
  }
  EXPECT_GT(indefinite, 0);
}

TEST(PotentialField, DiagonalIsThatOfTheGaussNewtonStiffness) {
  const Body b = Body::random(4);
  PackedVectors diagonal = PackedVectors::Constant(4, b.size(), 1);
  assembled(b.field, b.x, StiffnessModel::gauss_newton).add_diagonal(2, diagonal);
  const Eigen::VectorXd expected = assembled(b.field, b.x, StiffnessModel::gauss_newton).to_dense().diagonal();
  ASSERT_GT(expected.minCoeff(), 0);
  EXPECT_LT(relative_error((diagonal.topRows<3>().array() - 1).matrix().reshaped() / 2, expected), 1e-14);
}

TEST(PotentialField, BoundsAreNeverBelowTheLargestEigenvalue) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Body b = Body::random(seed);
    Random random(seed);
    for (const PackedVectors& x : {b.x, b.field.rest_positions()}) {
      const std::vector<Real> inverse_masses = random_inverse_masses(b.size(), random);
      std::vector<Real> bounds(b.size(), 0.0);
      assembled(b.field, x, StiffnessModel::taut).add_bounds(bounds);
      Real bound = 0;
      for (Eigen::Index i = 0; i < b.size(); ++i) bound = std::max(bound, bounds[i] * inverse_masses[i]);
      const Real largest = true_largest_eigenvalue(b.field, x, inverse_masses);
      EXPECT_GE(bound, largest);
      EXPECT_LE(bound, 9 * largest);  // nor uselessly far above: the substep is at most three times too small
    }
  }
}

TEST(PotentialField, FindGivesTheBatchOfAKindOrNull) {
  PotentialField field(Eigen::Matrix3Xd::Identity(3, 3));
  EXPECT_EQ(field.find<Length>(), nullptr);
  const std::vector<Edge> edges{{0, 1}, {1, 2}};
  const Batch<Length>& added = field.add<Length>(edges, 2);
  EXPECT_EQ(field.find<Length>(), &added);
  EXPECT_EQ(field.find<TetrahedronVolume>(), nullptr);
  EXPECT_EQ(added.stiffnesses(), (std::vector<Real>{2, 2}));
  EXPECT_NEAR(added.kinds()[0].rest_length(), std::sqrt(2.0), 1e-15);
}

TEST(PotentialField, BatchGivesTheBatchOrSaysWhatThereIs) {
  PotentialField field(Eigen::Matrix3Xd::Identity(3, 3));
  EXPECT_EQ(complaint<std::invalid_argument>([&] { field.batch<Length>(); }),
            "field: no batch of the kind \"length\"; there is nothing");
  Batch<Length>& added = field.add<Length>(std::vector<Edge>{{0, 1}, {1, 2}}, 2);
  field.add<Length>(std::vector<Edge>{{0, 2}}, 1, "brace");
  EXPECT_EQ(&field.batch<Length>(), &added);
  EXPECT_EQ(field.batch("brace").num_elements(), 1u);
  EXPECT_EQ(complaint<std::invalid_argument>([&] { field.batch<TetrahedronVolume>(); }),
            "field: no batch of the kind \"tetrahedron volume\"; there is \"length\", \"brace\"");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { std::as_const(field).batch("muscle"); }),
            "field: no batch \"muscle\"; there is \"length\", \"brace\"");
}

// Who steps a field remembers what he knows of it.
static_assert(!std::is_assignable_v<PotentialField&, PotentialField>);

TEST(PotentialField, TakesInAnotherFieldOfTheSameParticles) {
  const Body b = Body::random(6);
  PotentialField both = make_elastic_field(b.mesh.vertices, b.mesh.tetrahedra, 2.0);
  const Real of_one = both.energy(b.x);
  both.add(make_elastic_field(b.mesh.vertices, b.mesh.tetrahedra, Material{.young = 1e3, .poisson = 0.4}));
  EXPECT_DOUBLE_EQ(both.energy(b.x), of_one + b.field.energy(b.x));
  EXPECT_EQ(both.potentials().size(), 4u);
  EXPECT_EQ(complaint<std::invalid_argument>([&] { both.add(PotentialField(Eigen::Matrix3Xd::Zero(3, 7))); }),
            "field: the field to be added has 7 particles, this one " + std::to_string(both.num_particles()));
}

// The least that a potential of a user's own has to have: gravity as a potential, -m g . x.
class Weight final : public Potential {
 public:
  Weight() : Potential("weight") {}
  Real energy(const Positions& x) const override { return 9.81 * x.row(1).sum(); }
  Real add_forces(const Positions& x, Forces f) const override {
    f.row(1).array() -= 9.81;
    return energy(x);
  }
  void add_stiffness(const Positions&, StiffnessModel, System&) const override {}
};

TEST(PotentialField, TakesAnyPotential) {
  Body b = Body::random(7);
  const Real before = b.field.energy(b.x);
  b.field.add(std::make_unique<Weight>());
  EXPECT_DOUBLE_EQ(b.field.energy(b.x), before + 9.81 * b.x.row(1).sum());
  EXPECT_EQ(ledger(b.field, b.x).back().name, "weight");
  EXPECT_EQ(b.field.state().values.size(), 10u) << "five counts a batch, and nothing of the weight";
  EXPECT_FALSE(b.field.damps() || b.field.evolves());
}

TEST(OwnKinds, AreRegisteredByName) {
  std::set<std::string_view> names;
  for (const KindEntry& kind : own_kinds()) {
    names.insert(kind.name);
    const auto batch = kind.make(9, "mine");
    EXPECT_EQ(batch->name(), "mine");
    EXPECT_EQ(batch->num_elements(), 0u);
  }
  EXPECT_EQ(names.size(), own_kinds().size()) << "two kinds of one name";
  EXPECT_TRUE(names.contains(Length::name) && names.contains(ShapeMatch::name) &&
              names.contains(StableNeoHookean::name));
}

TEST(PotentialField, PositionsThatAreNotFiniteGiveAnEnergyThatIsNotFinite) {
  const Body b = Body::random(5);
  for (const Real bad : {std::nan(""), std::numeric_limits<Real>::infinity()}) {
    PackedVectors x = b.x;
    x(1, 4) = bad;
    EXPECT_FALSE(std::isfinite(b.field.energy(x)));
    EXPECT_FALSE(b.forces(x).allFinite());
  }
}

// What a field of three points on a line, one tetrahedron beside it and a stencil list says.
template <class Kind>
std::string refusal(const std::vector<std::array<int, Kind::num_points>>& stencils,
                    const std::vector<Real>& stiffnesses) {
  Eigen::Matrix3Xd rest(3, 5);
  rest << 0, 1, 0, 0, 0,  //
      0, 0, 1, 0, 0,      //
      0, 0, 0, 1, 0;      // particles 0 and 4 coincide
  PotentialField field(rest);
  const std::string message = complaint<std::invalid_argument>([&] { field.add<Kind>(stencils, stiffnesses); });
  EXPECT_TRUE(field.potentials().empty()) << "a refused batch was added";
  return message;
}

TEST(PotentialField, RefusedElementsNameKindElementIndexAndValue) {
  EXPECT_EQ(refusal<Length>({{0, 1}, {1, 9}}, {1, 1}), "length 1: index 9 is outside the 5 particles");
  EXPECT_EQ(refusal<Length>({{0, 1}, {-2, 1}}, {1, 1}), "length 1: index -2 is outside the 5 particles");
  EXPECT_EQ(refusal<TetrahedronVolume>({{0, 1, 2, 5}}, {1}),
            "tetrahedron volume 0: index 5 is outside the 5 particles");
  EXPECT_EQ(refusal<Length>({{0, 1}, {1, 2}}, {1, -3}), "length 1: stiffness is -3 J, must be positive and finite");
  EXPECT_EQ(refusal<Length>({{0, 1}, {1, 2}, {2, 3}}, {1, 1, std::nan("")}),
            "length 2: stiffness is nan J, must be positive and finite");
  EXPECT_EQ(refusal<Length>({{0, 1}, {0, 4}}, {1, 1}), "length 1: length: rest length is 0");
  EXPECT_EQ(refusal<TetrahedronVolume>({{0, 1, 2, 3}, {0, 1, 2, 4}}, {1, 1}),
            "tetrahedron volume 1: tetrahedron volume: rest volume is 0");
  EXPECT_EQ(refusal<Length>({{0, 1}, {1, 2}}, {1}), "length: 1 stiffnesses for 2 stencils");
}

TEST(PotentialField, ARepeatedIndexIsNamedAndNotReportedAsAZeroRestValue) {
  EXPECT_EQ(refusal<Length>({{0, 1}, {2, 2}}, {1, 1}), "length 1: index 2 appears twice");
  EXPECT_EQ(refusal<TetrahedronVolume>({{0, 1, 2, 1}}, {1}), "tetrahedron volume 0: index 1 appears twice");
}

TEST(PotentialField, RefusesRestPositionsThatAreNotFinite) {
  Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 4);
  rest(1, 2) = std::nan("");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { PotentialField field(rest); }),
            "field: rest position 2: coordinate y is nan");
  PotentialField empty(Eigen::Matrix3Xd(3, 0));
  EXPECT_EQ(empty.num_particles(), 0);
  EXPECT_THROW(empty.add(nullptr), std::invalid_argument);
}

}  // namespace
}  // namespace penalty::testing
