#include "penalty/stepping/linear_solver.h"

#include <Eigen/Cholesky>
#include <deque>

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// The stiffness of deformed bodies, some inertia, and whatever is asked for besides.
struct Problem {
  PackedVectors x, b;  // of all bodies
  std::deque<BodyMatrix> bodies;
  LinearSystem system;

  explicit Problem(unsigned seed, const std::array<int, 3>& cells = {3, 2, 2}, Real inertia = 1e-3) {
    add_body(seed, cells, inertia);
  }
  Problem(const Problem&) = delete;

  void add_body(unsigned seed, const std::array<int, 3>& cells = {3, 2, 2}, Real inertia = 1e-3) {
    Random random(seed);
    const TetMesh mesh = noisy_box(cells, 0.5, 0.1, random);
    const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 100});
    const PackedVectors positions = deformed(field.rest_positions(), 0.02, random);
    BodyMatrix& body = bodies.emplace_back();
    body.values = assembled(field, positions, StiffnessModel::psd_projected);
    for (int i = 0; i < positions.cols(); ++i) body.values.add_to_diagonal(i, inertia * random.uniform(1, 2));
    system.bodies.push_back(&body);
    x.conservativeResize(4, x.cols() + positions.cols());
    x.rightCols(positions.cols()) = positions;
    b = random_packed(x.cols(), 1, random);
  }

  void add_term(unsigned seed, Real coefficient) {
    Random random(seed);
    std::vector<int> everyone;
    const int size = bodies.front().num_particles();
    everyone.reserve(size);
    for (int i = 0; i < size; ++i) everyone.push_back(i);
    bodies.front().values.add_term(coefficient, everyone, random.vectors<Eigen::Dynamic>(size, 1));
  }

  // Contacts of this stiffness between the first body and the second.
  void add_contacts_between_bodies(unsigned seed, Real stiffness) {
    Random random(seed);
    for (int k = 0; k < 5; ++k) {
      ContactSides sides;
      sides.add({{k, k + 7, k + 12}, {0.5, 0.2, 0.3}, 3}, 1);
      sides.add({{k, k + 9, k + 13}, {0.1, 0.2, 0.7}, 3}, -1, bodies.front().num_particles());
      EXPECT_EQ(sides.num_particles, 6);
      const Matrix3 m = random.vectors<3>(3, 1);
      system.contacts.push_back({sides, stiffness * m * m.transpose()});
    }
  }

  // Two rigid bodies, one between the particles and the other, and contacts of all of them of this stiffness.
  void add_rigid_bodies(unsigned seed, Real stiffness) {
    Random random(seed);
    const auto positive = [&random] {
      const Matrix3 m = random.vectors<3>(3, 1);
      return Matrix3(m * m.transpose() + Matrix3::Identity());
    };
    const int first = static_cast<int>(x.cols()), second = first + 2;
    system.rigid_bodies = {{positive(), positive()}, {positive(), positive()}};
    b = random_packed(second + 2, 1, random);
    for (int k = 0; k < 2; ++k) {  // of the particles among themselves, one of which is on both sides
      ContactSides sides;
      sides.add({{k, k + 7, k + 12, k + 20}, {0.4, 0.3, 0.2, 0.1}, 4}, 1);
      sides.add({{k + 3, k + 7, k + 25}, {0.5, 0.2, 0.3}, 3}, -1);
      EXPECT_EQ(sides.num_particles, 6);
      system.contacts.push_back({sides, stiffness * positive()});
    }
    for (int k = 0; k < 7; ++k) {
      ContactSides sides;
      sides.turn = k == 6;
      sides.rigid[0] = {.column = k % 2 == 0 ? first : second, .sign = -1, .arm = random.vectors<1>(1, 1)};
      sides.num_rigid = 1;
      if (k < 4)
        sides.add({{k, k + 7, k + 12}, {0.5, 0.3, 0.2}, 3}, 1);
      else
        sides.rigid[sides.num_rigid++] = {.column = k % 2 == 0 ? second : first, .sign = 1, .arm = {0.3, -1, 0.2}};
      system.contacts.push_back({sides, stiffness * positive()});
    }
  }

  // Columns of particles that do not move.
  std::vector<int> fixed() const {
    std::vector<int> columns;
    int first = 0;
    for (const BodyMatrix& body : bodies) {
      for (const int i : body.fixed) columns.push_back(first + i);
      first += body.num_particles();
    }
    return columns;
  }

  Eigen::MatrixXd dense() const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3 * system.num_columns(), 3 * system.num_columns());
    Eigen::Index row = 0;
    for (const BodyMatrix& body : bodies) {
      const Eigen::Index size = 3 * body.num_particles();
      a.block(row, row, size, size) = body.values.to_dense();
      row += size;
    }
    for (const auto& [translation, rotation] : system.rigid_bodies) {
      a.block<3, 3>(row, row) = translation;
      a.block<3, 3>(row + 3, row + 3) = rotation;
      row += 6;
    }
    for (const auto& [sides, stiffness] : system.contacts) {
      Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, a.cols());
      for (int k = 0; k < sides.num_particles; ++k)
        jacobian.middleCols<3>(3 * sides.particles[k]).diagonal().setConstant(sides.weights[k]);
      for (int k = 0; k < sides.num_rigid; ++k) {
        const auto& [column, sign, arm] = sides.rigid[k];
        jacobian.middleCols<3>(3 * column).diagonal().setConstant(sides.turn ? 0 : sign);
        for (int axis = 0; axis < 3; ++axis)
          jacobian.col(3 * column + 3 + axis) =
              sign * (sides.turn ? Vector3::Unit(axis) : Vector3::Unit(axis).cross(arm));
      }
      a += jacobian.transpose() * stiffness * jacobian;
    }
    for (const int i : fixed()) {
      a.middleRows<3>(3 * i).setZero();
      a.middleCols<3>(3 * i).setZero();
      a.block<3, 3>(3 * i, 3 * i).setIdentity();
    }
    return a;
  }

  PackedVectors exact() const {
    PackedVectors right = b;
    system.clear_fixed(right);
    const Eigen::VectorXd solution = dense().ldlt().solve(Eigen::VectorXd(right.topRows<3>().reshaped()));
    return pack(solution.reshaped(3, b.cols()));
  }

  PackedVectors solved(int* iterations = nullptr, const LinearOptions& options = {2000, 1e-12}) {
    Eigen::Index first = 0;
    for (BodyMatrix& body : bodies) {
      body.make_groups();
      body.factorize(x.middleCols(first, body.num_particles()));
      first += body.num_particles();
    }
    LinearSolver solver;
    solver.factorize(system);
    PackedVectors y;
    const int used = solver.solve(system, b, options, y);
    if (iterations) *iterations = used;
    return y;
  }
};

TEST(LinearSolver, SolvesWhatADenseFactorisationSolves) {
  WorstError plain, fixed, terms;
  for (unsigned seed = 0; seed < 10; ++seed) {
    Problem problem(seed);
    plain.see(relative_error(problem.solved(), problem.exact()), seed);
    problem.bodies.front().fixed = {0, 5, 17};
    const PackedVectors y = problem.solved();
    fixed.see(relative_error(y, problem.exact()), seed);
    for (const int i : problem.fixed()) EXPECT_TRUE(y.col(i).isZero(0));
    problem.add_term(seed, 1e4);
    problem.add_term(seed + 100, 3);
    terms.see(relative_error(problem.solved(), problem.exact()), seed);
  }
  plain.expect_below(1e-8, "free");
  fixed.expect_below(1e-8, "some fixed");
  terms.expect_below(1e-8, "dense terms");
}

TEST(LinearSolver, SolvesWithRigidBodiesAndContactsHoweverHard) {
  WorstError error;
  for (unsigned seed = 0; seed < 10; ++seed)
    for (const Real stiffness : {1e-2, 1e2, 1e6}) {
      Problem problem(seed);
      problem.bodies.front().fixed = {0, 5, 17};
      problem.add_rigid_bodies(seed, stiffness);
      error.see(relative_error(problem.solved(), problem.exact()), seed);
    }
  error.expect_below(1e-6, "solution");
}

TEST(LinearSolver, SolvesForSeveralBodiesAtOnce) {
  WorstError apart, in_contact;
  for (unsigned seed = 0; seed < 10; ++seed)
    for (const Real stiffness : {1e-2, 1e2, 1e6}) {
      Problem problem(seed);
      problem.add_body(seed + 100, {2, 2, 3});
      problem.bodies.front().fixed = {0, 5, 17};
      problem.bodies.back().fixed = {1, 13};
      apart.see(relative_error(problem.solved(), problem.exact()), seed);
      problem.add_contacts_between_bodies(seed, stiffness);
      problem.add_rigid_bodies(seed, stiffness);
      in_contact.see(relative_error(problem.solved(), problem.exact()), seed);
    }
  apart.expect_below(1e-8, "apart");
  in_contact.expect_below(1e-6, "in contact");
}

TEST(LinearSolver, LeadsDownhillHoweverEarlyItStops) {
  Problem problem(3);
  for (int most = 1; most < 12; ++most) {
    int iterations = 0;
    const PackedVectors y = problem.solved(&iterations, {most, 1e-12});
    EXPECT_EQ(iterations, most);
    EXPECT_GT(y.cwiseProduct(problem.b).sum(), 0);
  }
}

TEST(LinearSolver, CoarseSpaceKeepsTheIterationsOfALongBarFew) {
  // A bar four, then sixteen times as long as wide, nearly without inertia: block Jacobi alone needs more iterations
  // the longer it is. Groups of 40 that move as rigid bodies carry the smooth part.
  const auto without_coarse_space = [](const Problem& problem) {
    // The same recurrence with the block diagonal alone.
    const LinearSystem& a = problem.system;
    PackedVectors r = problem.b, z = r, q(4, r.cols());
    const auto precondition = [&] {
      for (int i = 0; i < r.cols(); ++i)
        z.col(i).head<3>() = a.bodies.front()->values.blocks().diagonal(i).ldlt().solve(Vector3(r.col(i).head<3>()));
    };
    precondition();
    PackedVectors p = z;
    Real rz = r.cwiseProduct(z).sum();
    const Real enough = 1e-12 * rz;
    int iterations = 0;
    for (; rz > enough && iterations < 5000; ++iterations) {
      a.multiply(p, q);
      const Real length = rz / p.cwiseProduct(q).sum();
      r -= length * q;
      precondition();
      const Real next = r.cwiseProduct(z).sum();
      p = z + next / rz * p;
      rz = next;
    }
    return iterations;
  };
  int with = 0;
  Problem bar(1, {32, 2, 2}, 1e-7);
  bar.solved(&with, {5000, 1e-6});
  const int without = without_coarse_space(bar);
  RecordProperty("with", with);
  RecordProperty("without", without);
  EXPECT_LT(3 * with, without);
}

TEST(LinearSolver, HasNothingToDoForZero) {
  Problem problem(1);
  problem.b.setZero();
  int iterations = -1;
  EXPECT_TRUE(problem.solved(&iterations).isZero(0));
  EXPECT_EQ(iterations, 0);
}

TEST(LinearSolver, EveryParticleMayBeFixed) {
  Problem problem(1);
  for (int i = 0; i < problem.x.cols(); ++i) problem.bodies.front().fixed.push_back(i);
  EXPECT_TRUE(problem.solved().isZero(0));
}

TEST(LinearSolver, ParticlesInOnePlaceAreNoObstacle) {
  Problem problem(2);
  const PackedVectors expected = problem.exact();
  problem.x.setConstant(0.25);  // the groups have no size then, and cannot turn
  EXPECT_LT(relative_error(problem.solved(), expected), 1e-8);
}

TEST(LinearSolver, GivesTheSameBitsTwice) {
  Problem problem(4);
  EXPECT_EQ(problem.solved(nullptr, {25, 1e-3}), problem.solved(nullptr, {25, 1e-3}));
}

}  // namespace
}  // namespace penalty::testing
