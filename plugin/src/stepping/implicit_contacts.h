// Contacts in the minimisation of an implicit step.
#pragma once
#include <span>
#include <vector>

#include "penalty/stepping/island.h"
#include "penalty/stepping/linear_solver.h"

namespace penalty {

/// Contacts of one body with what takes no impulse, as a potential over a step of h. The gap is taken linear in the
/// positions, with the normal of where the step begins,
///
///     g(x) = g0 + n . (J (x - x0) - u),   s(x) = (1 - n nᵀ) (J (x - x0) - u),
///
/// u the way of the obstacle there in the step, and pressed by f = max(0, l - rho g), rubbed by -rho s, shortened to a limit that
/// is held while Newton's method iterates: an energy with a continuous derivative, convex. The limit is what the linear
/// model of the last iteration presses, times the coefficient of friction; its stiffness at the limit is a secant, which
/// is never less than the energy's. The multipliers l, of which the friction has its own, begin with what the contact gave
/// in the last step, and end as what it gives in this one: what lies neither sinks nor creeps.
///
/// rho is `hardness` times the inertia and stiffness that the contact works against, of the particles and of the body as
/// a whole: more would be met by no motion of the body.
class ImplicitContacts {
 public:
  ImplicitContacts(Island& island, std::vector<RememberedContact>& memory, Real duration);

  bool is_empty() const { return rows_.empty(); }

  /// Sets rho, from the diagonal blocks of the stiffness, inertia included.
  void set_hardness(const NewtonSolver& newton);

  /// Marks what the body meets in this step for the first time at `velocities`, and would pass on its way to `targets`:
  /// the first direction of Newton's method then ends at the obstacle, not beyond it.
  void predict(const PackedVectors& velocities, const PackedVectors& targets, Real negligible_speed);

  /// Returns the energy [J] and adds its gradient [N].
  Real evaluate(const PackedVectors& x, PackedVectors& gradient) const;

  /// Adds the stiffness at `x`, and what is predicted to `forces`.
  void linearize(const PackedVectors& x, std::vector<ContactStiffness>& stiffness, PackedVectors& forces);

  /// After a step of this length along `direction`: what contacts press by their linear model.
  void follow(Real length, const PackedVectors& direction);

  struct Change {
    Real limits = 0, sum = 0;  // of the limits of friction, and their sum [N]
    Real gap = 0;              // largest of what presses [m]
  };
  Change limit_change(const PackedVectors& x) const;

  /// Takes the limits anew, and, if `converged`, the multipliers.
  void update(const PackedVectors& x, bool converged);

  /// Books what contacts gave until the positions `x`, and remembers it.
  void finish(const PackedVectors& x, std::vector<RememberedContact>& memory);

  Vector3 impulse() const { return impulse_; }         // on the body [N s]
  Real work() const { return work_; }                  // on the body [J],
  Real outside_work() const { return outside_work_; }  // and of what moves, and of taking depth back

 private:
  struct Row {
    Contact* contact = nullptr;
    Vector3 normal = Vector3::Zero();
    Vector3 start = Vector3::Zero();  // J x0
    Vector3 way = Vector3::Zero();    // u
    Real gap = 0, depth = 0;          // g0; what was lost when the step began [m]
    Real hardness = 0, friction = 0, limit = 0;
    Real pressing = 0;                    // l
    Vector3 rubbing = Vector3::Zero();    // its part across the normal
    Vector3 force = Vector3::Zero();      // of the last linearisation
    Matrix3 stiffness = Matrix3::Zero();  // likewise
    Real linear_pressing = 0;
    bool is_new = true, is_predicted = false;
  };
  struct Force {
    Vector3 force;
    Real energy;
    Real pressing;
    Real rubbing_share;  // of what friction would be without its limit
  };
  Force force_of(const Row& row, const Vector3& point) const;
  Real gap_of(const Row& row, const Vector3& point) const {
    return row.gap + row.normal.dot(point - row.start - row.way);
  }

  const SteppedBody& body_;
  Real duration_;
  std::vector<Row> rows_;
  std::vector<Real> shares_;  // of each particle: sum of squared weights in all points
  Vector3 impulse_ = Vector3::Zero();
  Real work_ = 0, outside_work_ = 0;
};

}  // namespace penalty
