// Conjugate gradients for the systems of the implicit step.
#pragma once
#include <span>
#include <vector>

#include "penalty/contact/weighted_point.h"
#include "penalty/stepping/body_matrix.h"
#include "penalty/stepping/step_options.h"

namespace penalty {

/// The two sides of a contact: points of particles, of one side or of both, and points of up to two rigid bodies. What x
/// says of the way from the second to the first is J x, the sum of w_k x_k over the particles and of s (t + theta x arm) over
/// the rigid bodies, whose columns of x are their translation t [m] and their rotation vector theta [rad]. Between two rigid
/// bodies it may also be how they turn, the sum of s theta; then G is in N m, and what is below a force is a moment.
struct ContactSides {
  static constexpr int most_particles = 16;  // two edges, or a point and a triangle, of an embedded surface
  struct OnRigid {
    int column = 0;  // of t; that of theta is the next
    Real sign = 0;   // s: 1 on the first side, -1 on the second
    Vector3 arm = Vector3::Zero();

    Vector3 way(const PackedVectors& x, bool turns) const {
      const Vector3 theta = x.col(column + 1).head<3>();
      return sign * (turns ? theta : Vector3(x.col(column).head<3>() + theta.cross(arm)));
    }
  };
  bool turn = false;
  int num_rigid = 0, num_particles = 0;
  std::array<OnRigid, 2> rigid = {};
  std::array<int, most_particles> particles{};  // their columns
  std::array<Real, most_particles> weights{};   // w_k

  /// Adds a point with this weight, which is negative on the second side; points may share particles.
  /// `first`: the column of the first particle of its body.
  void add(const WeightedPoint& point, Real weight, Eigen::Index first = 0) {
    for (int k = 0; k < point.size; ++k) {
      const int column = static_cast<int>(first) + point.particles[k];
      int at = 0;
      while (at < num_particles && particles[at] != column) ++at;
      if (at == num_particles) particles[num_particles++] = column;
      weights[at] += weight * point.weights[k];
    }
  }

  /// J x, and what of it is the particles'.
  Vector3 distance(const PackedVectors& x) const {
    Vector3 sum = distance_of_particles(x);
    for (int k = 0; k < num_rigid; ++k) sum += rigid[k].way(x, turn);
    return sum;
  }
  Vector3 distance_of_particles(const PackedVectors& x) const {
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < num_particles; ++k) sum += weights[k] * x.col(particles[k]).head<3>();
    return sum;
  }

  /// y += Jᵀ force.
  void push(const Vector3& force, PackedVectors& y) const {
    for (int k = 0; k < num_particles; ++k) y.col(particles[k]).head<3>() += weights[k] * force;
    for (int k = 0; k < num_rigid; ++k) {
      const auto& [column, sign, arm] = rigid[k];
      if (!turn) y.col(column).head<3>() += sign * force;
      y.col(column + 1).head<3>() += sign * (turn ? force : arm.cross(force));
    }
  }
};

/// What a contact adds to a system: Jᵀ G J.
struct ContactStiffness {
  ContactSides sides;
  Matrix3 stiffness;  // G, positive semidefinite [N/m]
};

/// What a rigid body adds to a system: two blocks on the diagonal.
struct RigidInertia {
  Matrix3 translation;  // [N/m]
  Matrix3 rotation;     // [N m]
};

/// A positive definite system: matrices of soft bodies + rigid bodies + contacts. The columns of particles come first, body
/// by body, then two for each rigid body. The rows and columns of particles that do not move count as those of the identity.
struct LinearSystem {
  std::vector<const BodyMatrix*> bodies = {};
  std::vector<RigidInertia> rigid_bodies = {};
  std::vector<ContactStiffness> contacts = {};

  Eigen::Index num_particles() const;
  Eigen::Index num_columns() const { return num_particles() + 2 * static_cast<Eigen::Index>(rigid_bodies.size()); }

  /// Calls visit(body, first, count) with the columns of each body.
  template <class Visit>
  void visit_bodies(const Visit& visit) const {
    Eigen::Index first = 0;
    for (const BodyMatrix* body : bodies) {
      visit(*body, first, Eigen::Index(body->num_particles()));
      first += body->num_particles();
    }
  }

  /// y = A x but for the rows of fixed particles, which are zero; those of x are to be zero.
  void multiply(const PackedVectors& x, PackedVectors& y) const;

  /// Sets the columns of fixed particles to zero.
  void clear_fixed(PackedVectors& v) const;
};

/// Preconditioned conjugate gradients. The preconditioner is additive: the inverses of the 3 x 3 blocks on the diagonal
/// take care of what is stiff and near, and a coarse space of what is smooth: the groups of each BodyMatrix, which move as
/// rigid bodies (6 unknowns a group, a dense Cholesky factorisation); rigid bodies are groups, too. Deterministic, and
/// without allocation once a system of the same size has been solved.
class LinearSolver {
 public:
  /// Prepares the preconditioner for the values of the system, whose bodies have made their parts of it. Returns whether it is
  /// positive definite, as that of a positive definite system is.
  bool factorize(const LinearSystem& system);

  /// Solves A x = b from x = 0; the columns of fixed particles become zero. Returns the number of iterations; whatever it
  /// is, b . x > 0 unless b is zero or not finite.
  int solve(const LinearSystem& system, const PackedVectors& b, const LinearOptions& options, PackedVectors& x);

  /// Whether the last solution met positive curvature only.
  bool was_positive() const { return was_positive_; }

  /// r . P⁻¹ r, P the preconditioner.
  Real squared_norm(const PackedVectors& r);
  /// What some columns have of that, when it was computed last.
  Real share_of_norm(const PackedVectors& r, Eigen::Index first, Eigen::Index count) const {
    return r.middleCols(first, count).cwiseProduct(preconditioned_.middleCols(first, count)).sum();
  }

 private:
  void precondition(const PackedVectors& r, PackedVectors& z);
  void gather(const LinearSystem& system);
  bool invert_diagonal(const LinearSystem& system);
  bool factorize_coarse(const LinearSystem& system);
  void add_coarse_contact(const ContactStiffness& contact);

  bool was_positive_ = true;
  Eigen::Index num_particles_ = 0;
  int num_groups_ = 0;         // of particles
  std::vector<int> group_of_;  // of each particle
  std::vector<Real> moves_;    // 1, of fixed particles 0
  PackedVectors arms_;         // from the centre of the group, in units of its size
  std::vector<Matrix3> inverse_diagonal_;
  Eigen::MatrixXd coarse_;  // the Cholesky factor of the coarse matrix, in the lower triangle
  Eigen::VectorXd coarse_scale_, coarse_vector_;
  std::vector<std::pair<int, Eigen::Matrix<Real, 3, 6>>> coarse_motions_;  // of a contact: by group
  PackedVectors residual_, preconditioned_, search_, product_;
};

}  // namespace penalty
