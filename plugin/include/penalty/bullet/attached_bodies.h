// The soft bodies that the plugin steps, and their way through a Bullet world.
#pragma once
#include <memory>
#include <vector>

#include "penalty/assembly/potential_field.h"
#include "penalty/solvers/explicit_step.h"

class btSoftBody;

namespace penalty {

struct AttachOptions {
  StepOptions step;
  /// Where the body may touch rigid bodies; empty: every node. Weighted points follow an embedded surface.
  std::vector<ContactPoint> contact_points = {};
};

/// What both solvers of the plugin offer: soft bodies, each with a potential field, stepped inside the world step.
///
/// The double-precision state kept here is authoritative. Of the Bullet nodes only the *difference* to what was last
/// written is read, so that a change by the application (a node moved, a velocity set, a force added through
/// btSoftBody::addForce, pinning through setMass) takes effect, and a world in single precision still carries a
/// simulation in double.
class AttachedBodies {
 public:
  AttachedBodies();
  virtual ~AttachedBodies();
  AttachedBodies(const AttachedBodies&) = delete;
  AttachedBodies& operator=(const AttachedBodies&) = delete;

  /// Takes over a soft body that is, or will be, in the world of this solver. A further field for the same body is added to the
  /// first, options then being those of the last call. Throws std::invalid_argument if the field has another number of
  /// particles than the body has nodes, if a number is out of range, or if the body's world info has no broadphase.
  void attach(btSoftBody& body, PotentialField field, const AttachOptions& options = {});

  /// Gives the body back to Bullet. Call before the body is deleted; detaching a body that is not attached does nothing.
  void detach(const btSoftBody& body);

  bool is_attached(const btSoftBody& body) const;

  /// State at the end of the last step, in double: node i is column i. Throws std::invalid_argument for a body that is not attached.
  const Particles& particles(const btSoftBody& body) const;
  const PotentialField& field(const btSoftBody& body) const;
  const StepReport& report(const btSoftBody& body) const;

  /// The substep count is estimated anew at the next step: call after a change of masses or of the field.
  void refresh(const btSoftBody& body);

  /// Reads what the application changed since the last step now rather than at the next step, so that `particles` shows it.
  void synchronize(const btSoftBody& body);

 protected:
  class World;  // the step of both worlds, behind the header
  std::unique_ptr<World> attached_;
};

}  // namespace penalty
