// Surfaces that may touch on the way through an implicit step.
#pragma once
#include "island_surfaces.h"

namespace penalty {

/// The first of the two columns of a rigid body of the island among the unknowns of an implicit step; -1: it is not dynamic.
Eigen::Index column_of(const RigidBody& body, const Island& island);

/// Takes surfaces along as Newton's method moves the bodies, and says how far they may go at once: every pair of features
/// that may meet on the way has a plane between it, so nothing crosses, wherever the iterations end. Vectors are columns
/// of particles, then translation and rotation vector of each dynamic rigid body since the step began.
class ImplicitSurfaces {
 public:
  explicit ImplicitSurfaces(Island& island) : island_(island), surfaces_(island) {}

  bool are_near = false;     // they may touch, as bodies move now, or as was found in the step
  bool may_be_near = false;  // if not, but by what acts on these, their contacts may be taken implicitly

  /// Whether their contacts can be taken implicitly, in a step of `duration` [s]: nothing has to be led out of anything, what
  /// is held stands still, and nothing spins.
  bool can_step(Real duration) const;

  /// Bodies begin a step, or go back to where it began, at the places that the island says.
  void begin(Eigen::Index num_columns);
  void undo();

  /// What bodies are to do next. Returns which share of that they may do.
  Real aim(const PackedVectors& displacement);

  /// Whether some of them would come as near as they touch, or through each other, if they did all of this from where the step
  /// began.
  bool meet(const PackedVectors& displacement);

  /// They did this share of it and are at `x`.
  void move(Real share, const PackedVectors& x);

  /// The step is over, and rigid bodies, not far from where they should be, are where the island says. Returns whether
  /// that is as far as the planes allow.
  bool end();

  /// The step, from there on, is over, and they did not meet.
  void pass(const PackedVectors& from);

  /// Calls visit(contact, features, reach) for what may come as near as `reach` [m] beyond its thickness, by what bodies
  /// were to do last.
  template <class Visit>
  void visit_near(const Visit& visit) {
    for (SurfaceContact& contact : island_.surfaces)
      contact.pair->visit_near([&](FeaturePair& q, Real reach) { visit(contact, q, reach); });
  }

  /// Between these features, where the step began [m].
  Real distance_at_start(const SurfaceContact& contact, const FeaturePair& q) const;

  /// Where the centre of a rigid body is now [m].
  Vector3 center_of(const RigidBody& body) const;

  /// Adds what is near to the reports of bodies.
  void report();

 private:
  void refresh();
  void take_ways_to_rigid_bodies();

  Island& island_;
  IslandSurfaces surfaces_;
  PackedVectors at_;  // only the columns of rigid bodies are kept
};

}  // namespace penalty
