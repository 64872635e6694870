// The attached bodies of one solver, and one step of them.
#pragma once
#include <BulletSoftBody/btSoftBody.h>

#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "penalty/bullet/attached_bodies.h"

class btRigidBody;

namespace penalty {

struct AttachedBody {
  AttachedBody(btSoftBody& soft_body, PotentialField potential_field, const AttachOptions& attach_options);

  btSoftBody* body;
  PotentialField field;
  AttachOptions options;
  SteppedBody stepped;
  bool stale = true;                    // the stability estimate is to be made anew
  std::uint64_t estimated_version = 0;  // of the field's stiffness

  // What was last written to the nodes: only differences to it are read.
  btAlignedObjectArray<btVector3> written_positions, written_velocities;
  std::vector<btScalar> read_inverse_masses;
  int rejected_particle = -1;  // whose node held something that is not finite, and was set back

  void read_nodes();         // adds what others changed
  void read_forces();        // takes the forces of btSoftBody::addForce
  void remember(int node) {  // the node now says what the particle says
    written_positions[node] = body->m_nodes[node].m_x;
    written_velocities[node] = body->m_nodes[node].m_v;
  }
};

/// A rigid body that soft contacts touched in this step.
struct TouchedRigidBody {
  btRigidBody* body;
  int key;  // unique id of its broadphase proxy
  RigidBody start, state;
};

/// A coupling and what it holds.
struct AttachedCoupling {
  int number;
  std::vector<CouplingPoint> points;
  PotentialField field;
  Coupling stepped;
  std::uint64_t estimated_version = 0;

  bool holds(const btSoftBody& body) const;
};

class AttachedBodies::World {
 public:
  AttachedBody* find(const btSoftBody& body);
  AttachedBody& get(const btSoftBody& body);
  void attach(btSoftBody& body, PotentialField field, const AttachOptions& options);
  void detach(const btSoftBody& body);
  int couple(std::vector<CouplingPoint> points, PotentialField field, Real damping_time);
  void uncouple(int number);
  void wake(const AttachedCoupling& coupling);
  AttachedCoupling& coupling(int number);

  /// Steps the attached and active ones of `bodies`, all soft bodies of the world, from what their nodes say, together with the
  /// rigid bodies that they touch, whose velocities change. `gravity_applied`: the world has already added gravity to the
  /// velocities of rigid bodies. Returns the bodies that were stepped; their nodes are still to be written.
  std::span<AttachedBody* const> step(std::span<btSoftBody* const> bodies, Real duration, bool gravity_applied);

  /// Moves touched rigid bodies from where Bullet's integration with the end velocity put them to where the sub-cycle took them.
  /// Call after Bullet has integrated the transforms.
  void correct_rigid_bodies(Real duration);

 private:
  struct Island {
    std::vector<SteppedBody*> bodies;
    std::vector<TouchedRigidBody> touched;
    std::vector<RigidBody> states;  // those of `touched`, in one array for the integrator
    std::vector<AttachedCoupling*> couplings;
  };

  // What was expected of a rigid body after the last step: the difference is what other contacts did to it.
  struct Expectation {
    int step;
    Vector3 velocity, impulse;
  };

  void detect_contacts(AttachedBody& attached, Island& island, Real duration, bool gravity_applied);
  RigidBody start_of(const btCollisionObject& object, Real duration, bool gravity_applied) const;
  int touch(btCollisionObject& object, bool approached, Island& island, Real duration, bool gravity_applied);
  void wake_if_hit(btSoftBody& body);
  void wake_coupled();
  void join_coupled(Real duration, bool gravity_applied);
  void absorb(Island& into, Island& from);
  void merge_islands();
  void advance_island(Island& island, Real duration);
  void hand_back(Island& island, Real duration, bool gravity_applied);

  std::unordered_map<const btSoftBody*, std::unique_ptr<AttachedBody>> bodies_;
  std::vector<std::unique_ptr<AttachedCoupling>> couplings_;
  int next_coupling_ = 0;
  std::vector<AttachedBody*> stepped_;
  std::vector<Island> islands_;
  std::unordered_map<int, Expectation> expectations_;
  int step_count_ = 0;
};

}  // namespace penalty
