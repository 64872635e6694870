// Implicit steps of soft bodies and the rigid ones that they touch: backward Euler, or TR-BDF2 where nothing touches.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

class ImplicitContacts;
class ImplicitSurfaces;
struct RigidState;

/// The columns of a body among those of all unknowns.
template <class Columns>
auto columns_of(const SteppedBody& body, Columns& all) {
  return all.middleCols(body.implicit.first, body.particles.size());
}

inline bool is_free(const SteppedBody& body) { return body.implicit.newton.fixed().empty(); }

/// What a potential gives a body as a whole: nothing where it is its own.
struct FromOutside {
  Vector3 force, torque;  // about `center`
  FromOutside(const Positions& forces, const Positions& positions, const Vector3& center);
};

/// Takes steps of `duration` [s]; whether their energy is right is for others to see.
class BackwardEuler {
 public:
  BackwardEuler(Island& island, ImplicitSurfaces& surfaces, Real duration);

  /// Returns whether nothing has come through anything else; if not, bodies may be anywhere.
  bool run();

  /// Of obstacles that move, of taking depth back, and of what turns a rigid body's axes, so far [J].
  Real outside_work() const { return outside_work_; }

  /// Takes energy beyond `allowed` [J] from the velocities relative to the rigid motion of each body; of one with pinned
  /// particles from all its velocities.
  void cap_energy(Real allowed);

 private:
  void prepare(SteppedBody& body);
  void set_inertia_time(Real duration);
  void take_at_once(ImplicitContacts& contacts);
  void take_stages();
  void take_trapezoid();
  void take_difference();
  void minimize_stage(Real interval, const PackedVectors& positions, const PackedVectors& velocities);
  void aim();
  void aim(SteppedBody& body);
  void aim_rigid_bodies();
  const PackedVectors& guess(bool rigid_bodies_move);
  void choose_start();
  void offer_rigid_motion(Real interval, const PackedVectors& positions, const PackedVectors& velocities);
  void keep_stiffness();
  void forget_stiffness();
  void book(const NewtonIteration& iteration);
  void find_enough();
  Real residual();
  void minimize();
  void take_surfaces(ImplicitContacts& contacts);
  void begin_in_contact(ImplicitContacts& contacts);
  void minimize_in_contact(ImplicitContacts& contacts);
  void drift_rigid_bodies();
  void end(std::size_t body, const ImplicitContacts& contacts);
  void restore_momenta(std::size_t body, const RigidState& before, const ImplicitContacts& contacts);

  Island& island_;
  ImplicitState& state_;
  NewtonSolver& newton_;
  ImplicitSurfaces& all_surfaces_;
  ImplicitSurfaces* surfaces_;        // if they may touch
  Real duration_, inertia_time_ = 0;  // t: of masses / t² beside the stiffness
  Real outside_work_ = 0;
  Real gravity_ = 0;  // largest of a body [m/s²]
  int most_iterations_ = 0;
  bool touches_ = false, is_second_order_ = false, in_stages_ = false;
  std::vector<Real>& enough_;  // of the squared residual, for each body: the soft ones, then rigid ones
};

}  // namespace penalty
