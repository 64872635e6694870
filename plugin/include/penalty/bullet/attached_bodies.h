// The soft bodies that the plugin steps, and their way through a Bullet world.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "penalty/bullet/body_contact.h"
#include "penalty/bullet/body_surface.h"
#include "penalty/contact/weighted_point.h"
#include "penalty/fields/ledger.h"
#include "penalty/stepping/particles.h"
#include "penalty/stepping/step_report.h"

class btDiscreteDynamicsWorld;
class btRigidBody;
class btSoftBody;

namespace penalty {

class HeldBodies;

struct AttachOptions {
  StepOptions step;
  /// Where the body may touch rigid bodies; empty: every node. Weighted points follow an embedded surface.
  std::vector<WeightedPoint> contact_points = {};
  /// What touches other soft bodies, and the body itself; empty: its faces, else the outer ones of its
  /// tetrahedra, else its links.
  BodySurface surface = {};
  /// Whether it touches itself. Unless said: if its surface is open, as that of cloth is.
  std::optional<bool> self_contact = {};
};

/// A point that a coupling holds: a node of an attached soft body, a point between its nodes, or one fixed in a rigid
/// body.
struct CouplingPoint {
  const btSoftBody* soft_body = nullptr;
  WeightedPoint point = {};  // of the soft body
  btRigidBody* rigid_body = nullptr;
  Vector3 anchor = Vector3::Zero();  // in the frame of the rigid body [m]

  static CouplingPoint at_node(const btSoftBody& body, int node) {
    return {.soft_body = &body, .point = WeightedPoint::at_particle(node)};
  }
  /// A point of a face, or of an embedded surface.
  static CouplingPoint between(const btSoftBody& body, const WeightedPoint& point) {
    return {.soft_body = &body, .point = point};
  }
  static CouplingPoint on(btRigidBody& body, const Vector3& anchor) { return {.rigid_body = &body, .anchor = anchor}; }
};

/// The name of an attached body: a value to keep or to drop, which changes nothing for the body. It stays good when
/// body and solver are deleted, in whatever order.
class AttachedBody {
 public:
  AttachedBody(const std::shared_ptr<const HeldBodies>& solver, const btSoftBody& body, std::uintptr_t serial_number,
               std::vector<std::string> unused_settings)
      : bodies_(solver), address_(&body), serial_number_(serial_number), unused_settings_(std::move(unused_settings)) {}

  /// Carried by this body and no other, whatever memory it lies in.
  std::uintptr_t serial_number() const { return serial_number_; }

  /// Whether the solver steps the body no more. After `detach` at once, after deletion or removal from the world from
  /// the next world step on; a body that is put back is there again.
  bool is_gone() const;

  /// What was set on the body when it was attached, and does nothing from then on: a line each, with what to use instead.
  const std::vector<std::string>& unused_settings() const { return unused_settings_; }

 private:
  std::weak_ptr<const HeldBodies> bodies_;
  const btSoftBody* address_;  // compared, never followed
  std::uintptr_t serial_number_;
  std::vector<std::string> unused_settings_;
};

/// What both solvers of the plugin offer: soft bodies, each with a potential field, stepped inside the world step.
///
/// The double-precision state kept here is authoritative. Of the Bullet nodes only the *difference* to what was last
/// written is read, so that a change by the application (a node moved, a velocity set, a force added through
/// btSoftBody::addForce, pinning through setMass) takes effect, and a world in single precision still carries a
/// simulation in double.
///
/// A body is known by a serial number that it carries, not by its address: it may be deleted, or removed from the
/// world, without `detach`, and so may bodies that are coupled. What remains of it here is never followed.
///
/// A step never throws. A body that cannot be stepped stays where it is, and StepReport::problem says why: nodes were
/// appended, a rigid body that it is coupled to has left the world, a constraint of the user threw, a setting or the
/// time step is not finite. The rest of the world goes on, and so does the body once that is mended.
class AttachedBodies {
 public:
  AttachedBodies();
  virtual ~AttachedBodies();
  AttachedBodies(const AttachedBodies&) = delete;
  AttachedBodies& operator=(const AttachedBodies&) = delete;

  /// Takes over a soft body that is, or will be, in the world of this solver. A further field for the same body is
  /// added to the first, options then being those of the last call. Throws std::invalid_argument if the field has
  /// another number of particles than the body has nodes, if a node's position, velocity or inverse mass is out of
  /// range, if another number or index is, or if the body's world info has no broadphase. The result may be dropped.
  AttachedBody attach(btSoftBody& body, PotentialField field, const AttachOptions& options = {});

  /// Gives the body back to Bullet, whose links know of nothing that broke, with all its faces, and lets those that it is
  /// coupled to wake in the next step. Detaching a body that is not attached does nothing. A deleted body need not be
  /// detached; its memory here is given back when another body stands at its address, or with the solver.
  void detach(const btSoftBody& body);

  bool is_attached(const btSoftBody& body) const;

  /// State at the end of the last step, in double: node i is column i. Throws std::invalid_argument for a body that is
  /// not attached.
  const Particles& particles(const btSoftBody& body) const;
  const PotentialField& field(const btSoftBody& body) const;
  const StepReport& report(const btSoftBody& body) const;

  /// What pressed on the body in its last step: what asks nothing of it, because it is further off than the margins, is not
  /// among them. Of a body that sleeps it is what holds it. A contact between soft bodies is one of each, with opposite
  /// normals and impulses, and one of a body with itself is there twice, so that the impulses add up to what the body was
  /// given. Anchors and couplings are no contacts; what rigid bodies do to each other is in Bullet's manifolds, without
  /// impulses where a soft body touches one of them. Good until the next step, or until the body is detached.
  std::span<const BodyContact> contacts(const btSoftBody& body) const;

  /// The sum of what soft bodies did to an object in the last step, over its duration: impulses of contacts.
  ContactForce contact_force(const btCollisionObject& object) const;

  /// Will be called at the end of every internal step of the world, once for each body that was stepped and touches
  /// something, or did in its step before: with no contacts when it has come off. In it bodies may be changed, detached,
  /// and removed from the world. What it throws goes no further than the report of the body, as a problem. Empty: nobody
  /// is told.
  void set_contact_callback(ContactCallback callback);

  /// Energy that came and went since the body was attached [J].
  const EnergyFlows& flows(const btSoftBody& body) const;

  /// One entry a batch, at the present positions.
  std::vector<LedgerEntry> ledger(const btSoftBody& body) const;

  /// Elastic forces on the nodes at the present positions, those of couplings left out: column i on node i [N].
  PackedVectors forces(const btSoftBody& body) const;

  /// The field, for changes: targets, stiffnesses, elements switched off. Wakes the body; call it anew for each change.
  /// The field is to be changed, not to be assigned to.
  PotentialField& edit(const btSoftBody& body);

  /// From now on joints (typed constraints) of the world of this solver are in its steps wherever they hold a rigid body
  /// that a soft one touches, or one that is reached from it by joints and contacts. Their parameters mean what they mean
  /// in Bullet, for a world step; what they give, what breaks and their feedback are told as Bullet does. Call once, when
  /// the world is made, and again for the next if the solver outlives this one to serve another: Bullet's bodies do not
  /// know their joints. Otherwise these stay with Bullet's own solver, which hears once a step of what soft bodies do.
  /// Constraints of multibodies always do, and joints that are switched off stay off.
  void take_joints_of(btDiscreteDynamicsWorld& world);

  /// Adds a potential over points of several bodies of this solver: particle i of the field is points[i], its rest
  /// positions those of the field. Rigid bodies get the reaction. Returns the number of the coupling. Throws
  /// std::invalid_argument for a body that is not attached, a node outside it, a rigid body in no world, a point that
  /// appears twice, no soft body at all, or another number of points than the field has particles.
  int couple(const std::vector<CouplingPoint>& points, PotentialField field, Real damping_time = 0);

  /// Removes a coupling; its bodies wake in the next step. Detaching or deleting a soft body does it by itself, and
  /// nothing is left to do then. While a rigid body of the coupling is not in the world, its soft bodies cannot be
  /// stepped; while a soft one is not, the coupling rests. Throws std::invalid_argument for a number that `couple` never
  /// returned.
  void uncouple(int coupling);
  const PotentialField& coupling_field(int coupling) const;
  PotentialField& edit_coupling(int coupling);  // its bodies wake in the next step
  Real coupling_energy(int coupling) const;     // at the end of the last step [J]

  /// The substep count is estimated anew at the next step: call after a change of masses or of the field.
  void refresh(const btSoftBody& body);

  /// Reads what the application changed since the last step now rather than at the next step, so that `particles` shows
  /// it. Pinned nodes that were moved jump then: without this call they move through the next step.
  void synchronize(const btSoftBody& body);

 protected:
  class World;  // the step of both worlds
  std::unique_ptr<World> attached_;
};

}  // namespace penalty
