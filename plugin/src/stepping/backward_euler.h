// Backward Euler steps of a soft body and the rigid ones that it touches.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

class ImplicitContacts;
class ImplicitSurfaces;
struct RigidState;

/// Takes steps of `duration` [s]; whether their energy is right is for others to see.
class BackwardEuler {
 public:
  /// `surfaces`: those that may touch; null: none.
  BackwardEuler(Island& island, ImplicitSurfaces* surfaces, Real duration);

  /// Returns whether nothing has come through anything else.
  bool run();

  /// Of obstacles that move, of taking depth back, and of what turns a rigid body's axes, so far [J].
  Real outside_work() const { return outside_work_; }

  /// Takes energy beyond `allowed` [J] from the velocities relative to the rigid motion; of a body with pinned
  /// particles from all velocities.
  void cap_energy(Real allowed);

 private:
  void aim();
  void aim_rigid_bodies();
  template <class Derived>
  const PackedVectors& guess(const Eigen::MatrixBase<Derived>& positions, bool rigid_bodies_move);
  void choose_start();
  Real noise() const;
  void find_enough();
  Real residual();
  void minimize();
  void take_surfaces(ImplicitContacts& contacts);
  void begin_in_contact(ImplicitContacts& contacts);
  void minimize_in_contact(ImplicitContacts& contacts);
  void drift_rigid_bodies();
  void restore_momenta(const RigidState& before, const ImplicitContacts& contacts);
  bool is_free() const { return newton_.fixed().empty(); }
  Real stiffness_range() const;

  Island& island_;
  SteppedBody& body_;
  Particles& particles_;
  ImplicitState& state_;
  NewtonSolver& newton_;
  ImplicitSurfaces* surfaces_;
  Real duration_, outside_work_ = 0;
  bool touches_ = false;
  std::vector<Real> enough_;  // of the squared residual, for each body: the soft one, then rigid ones
};

}  // namespace penalty
