#include "penalty/stepping/newton.h"

#include <Eigen/Eigenvalues>

#include "fields/meshes.h"
#include "math/random.h"

namespace penalty::testing {
namespace {

PotentialField make_box_field() {
  Random random(3);
  const TetMesh mesh = noisy_box({3, 2, 2}, 0.5, 0.1, random);
  return make_elastic_field(mesh.vertices, mesh.tetrahedra, 100);
}

// A box of tetrahedra, deformed, that is to come as near to its rest shape as its inertia lets it.
struct Minimisation {
  PotentialField field = make_box_field();
  NewtonBody body;
  NewtonSolver solver;
  Real inertia;  // [N/m]

  Minimisation(Real scale, Real inertia_of_each, bool tries_exact) : inertia(inertia_of_each) {
    const PackedVectors start = scale * field.rest_positions();
    body.set_pattern(field);
    body.weights.assign(static_cast<std::size_t>(field.num_particles()), inertia);
    solver.objective.bodies = {&body};
    solver.objective.targets = start;
    solver.tries_exact = tries_exact;
    solver.linear = {1000, 1e-10};
    solver.prepare();
    solver.start(start);
  }

  // Of the exact matrix [N/m].
  Real least_eigenvalue() const {
    const System matrix = assembled(field, solver.positions(), StiffnessModel::exact);
    const Eigen::Index n = field.num_particles();
    Eigen::MatrixXd dense(3 * n, 3 * n);
    for (Eigen::Index k = 0; k < 3 * n; ++k) {
      PackedVectors unit = PackedVectors::Zero(4, n), column = unit;
      unit(k % 3, k / 3) = 1;
      matrix.add_product(unit, 1, column);
      dense.col(k) = column.topRows<3>().reshaped();
    }
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense, Eigen::EigenvaluesOnly).eigenvalues()[0] + inertia;
  }

  // What is left of all forces [N].
  Real imbalance() const {
    PackedVectors forces = PackedVectors::Zero(4, field.num_particles());
    field.add_forces(solver.positions(), forces);
    forces -= inertia * (solver.positions() - solver.objective.targets);
    return forces.topRows<3>().norm();
  }

  int iterations_to(Real small) {
    int count = 0;
    while (imbalance() > small && count < 200 && solver.iterate().length > 0) ++count;
    EXPECT_LE(imbalance(), small);
    return count;
  }
};

TEST(NewtonSolver, TakesFewerIterationsWithTheExactStiffness) {
  Minimisation projected(1.2, 1500, false), exact(1.2, 1500, true);
  ASSERT_GT(exact.least_eigenvalue(), 0);
  const int fewer = exact.iterations_to(1e-8), more = projected.iterations_to(1e-8);
  EXPECT_LT(fewer, more);
  EXPECT_LE(fewer, 6) << "quadratic convergence";
  EXPECT_LT((exact.solver.positions() - projected.solver.positions()).norm(), 1e-8);
}

TEST(NewtonSolver, FindsTheMinimumFromWhereTheExactStiffnessIsIndefinite) {
  for (const Real scale : {0.5, 0.7}) {
    SCOPED_TRACE(scale);
    Minimisation projected(scale, 0.1, false), exact(scale, 0.1, true);
    ASSERT_LT(exact.least_eigenvalue(), 0);
    EXPECT_LT(exact.iterations_to(1e-8), 100);
    EXPECT_LT(projected.iterations_to(1e-8), 100);
    EXPECT_GT(exact.least_eigenvalue(), 0) << "no saddle";
    EXPECT_NEAR(exact.solver.value(), projected.solver.value(), 1e-9);
  }
}

}  // namespace
}  // namespace penalty::testing
