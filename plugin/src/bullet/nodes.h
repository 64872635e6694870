// The nodes of a soft body, read and written: the only place where both worlds' steps touch them.
#pragma once
#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <vector>

#include "penalty/stepping/particles.h"

namespace penalty {

/// Index of a node, -1 if the body has none there: Bullet leaves tetrahedra and anchors of the deformable world behind when
/// it moves the nodes of a body to append one.
int index_of(const btSoftBody& body, const btSoftBody::Node* node);

/// What an application changed since the nodes were last written.
struct NodeChanges {
  bool moved = false;    // positions
  bool lighter = false;  // larger inverse masses
};

/// A pinned node in a step that takes it to where the application put it.
struct LedNode {
  int node;
  Vector3 place;     // where it will be [m]
  Vector3 velocity;  // that it has besides, again when it is there [m/s]
};

/// A number in a node that is no number, and was set back to what it was.
struct RejectedNode {
  int node = -1;          // -1: none was
  const char* what = "";  // is wrong
};

/// Of the nodes only differences to what was last written are read, so that a world in single precision still carries a
/// simulation in double. Nothing that is not finite in Bullet's precision is written, and nothing that is not finite is
/// read.
class Nodes {
 public:
  /// Fills `particles` from the nodes. Throws std::invalid_argument that names the node whose position, velocity or
  /// inverse mass is out of range, or the face or link that has a node of another body.
  Nodes(btSoftBody& body, Particles& particles);

  /// Adds what others changed. Numbers that are not finite, and inverse masses that are negative, are set back, see
  /// `rejected`. Pinned nodes that were moved, while no free one was, get the velocity that takes them there in
  /// `duration` [s]: until `arrive` they are where they were. Without a duration, or a free node, they jump. Throws
  /// std::logic_error if the body has another number of nodes than it had, or a new face or link with a node of another.
  NodeChanges read(Particles& particles, Real duration = 0);

  /// Ends the ways that `read` began: these particles are where they were led to, and so is where a failed step goes
  /// back to, at the velocities that the application gave them.
  void arrive(Particles& particles, PackedVectors& start);

  /// Whether somebody moved pinned nodes since the nodes were last written.
  bool has_moved_pins() const;

  /// Takes the forces of btSoftBody::addForce; empty if there are none. Returns whether they, or those of the last
  /// step, count.
  bool read_forces(PackedVectors& forces);

  /// The first number that `read` or `read_forces` set back since `read` began.
  const RejectedNode& rejected() const { return rejected_; }

  /// Whether the particles can be written: all finite in Bullet's precision.
  static bool can_hold(const Particles& particles);

  /// Gives the nodes their place before the step and the mean velocity [m/s] that leads from `start` to the particles
  /// in `duration` [s]: what Bullet's prediction is to follow. `gravity_dv` is what that prediction adds to free nodes
  /// by itself.
  void write_mean_velocities(const Particles& particles, const PackedVectors& start, Real duration,
                             const Vector3& gravity_dv);

  /// Whatever Bullet makes of the velocities from here on counts.
  void remember_velocities();

  /// Writes the particles; `lead` [s]: previous positions from which the velocities lead to the present ones in that
  /// time.
  void write(const Particles& particles, Real lead = 0);

  /// Adds to the particles what was done to the mean velocities, those of split impulses included, over `duration` [s].
  /// What is not finite is left out and rejected. Returns whether anything was added.
  bool read_velocity_changes(Particles& particles, Real duration);

  /// Turns what position constraints did into velocities.
  void positions_to_velocities(Real inverse_duration);

  /// A step that is none: from `freeze` to `thaw` Bullet finds nodes without velocity and contacts, whatever their
  /// number, which then have the velocities that were last read or written; after `stop` none.
  void freeze();
  void thaw();
  void stop();

  /// Of Bullet's, from an earlier step; nodes then meet what is to come with their own masses.
  void forget_contacts();

 private:
  void reject(int node, const char* what);
  void lead(Particles& particles, Real duration, NodeChanges& changes);

  btSoftBody* body_;
  std::array<int, 2> checked_parts_;  // how many faces and links had nodes of this body only
  btAlignedObjectArray<btVector3> written_positions_, written_velocities_;
  std::vector<btScalar> read_inverse_masses_;
  std::vector<LedNode> led_;
  RejectedNode rejected_;
};

}  // namespace penalty
