#include "rigid_bodies.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <cmath>
#include <set>

#include "convert.h"
#include "obstacles.h"

namespace penalty {
namespace {

// What will accelerate the body besides contacts. The classic world adds all forces in its own solver, later; the
// deformable world has already added gravity to the velocity, and with it the forces of the application.
Vector3 known_acceleration(const btRigidBody& body, bool gravity_applied) {
  const Vector3 factor = to_vector(body.getLinearFactor());
  return gravity_applied ? Vector3(to_vector(body.getGravity()).cwiseProduct(factor))
                         : Vector3(Real(body.getInvMass()) * to_vector(body.getTotalForce()).cwiseProduct(factor));
}

Matrix3 inverse_inertia(const btRigidBody& body) {
  const Matrix3 factor = to_vector(body.getAngularFactor()).asDiagonal();
  return factor * to_matrix(body.getInvInertiaTensorWorld()) * factor;
}

// Likewise, with what Bullet's solver adds to the spin of a body with unequal moments of inertia.
Vector3 known_angular_acceleration(const btRigidBody& body, bool forces_applied, Real duration) {
  const auto step = static_cast<btScalar>(duration);
  Vector3 change = Vector3::Zero();
  if (body.getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY)
    change = to_vector(body.computeGyroscopicImpulseImplicit_Body(step));
  else if (body.getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD)
    change = to_vector(body.computeGyroscopicImpulseImplicit_World(step));
  if (!forces_applied) change += duration * (inverse_inertia(body) * to_vector(body.getTotalTorque()));
  return change.allFinite() ? Vector3(change / duration) : Vector3::Zero();
}

// The unique ids of the proxies in a box.
class Present final : public btBroadphaseAabbCallback {
 public:
  bool process(const btBroadphaseProxy* proxy) override {
    ids.insert(proxy->m_uniqueId);
    return true;
  }
  std::set<int> ids;
};

void correct(const TouchedRigidBody& t, Real duration) {
  RigidBody end = t.start;  // where the end velocities lead
  end.velocity = t.state.velocity;
  end.angular_velocity = t.state.angular_velocity;
  end.drift(duration);
  const Vector3 shift = t.state.position - end.position;
  const Eigen::AngleAxis<Real> turn(Matrix3(t.state.rotation * end.rotation.transpose()));
  if (!shift.allFinite() || !std::isfinite(turn.angle())) return;
  btTransform transform = t.body->getWorldTransform();
  transform.setOrigin(transform.getOrigin() + to_bullet(shift));
  if (turn.angle() > 1e-12)
    transform.setRotation(
        (btQuaternion(to_bullet(turn.axis()), static_cast<btScalar>(turn.angle())) * transform.getRotation())
            .normalized());
  t.body->setWorldTransform(transform);
  t.body->setInterpolationWorldTransform(transform);
}

}  // namespace

bool stands_still(const btRigidBody& body) { return body.isStaticObject() && !body.isKinematicObject(); }

Pose pose_at_start(const btCollisionObject& object, Real duration) {
  Pose pose{to_vector(object.getWorldTransform().getOrigin()), to_matrix(object.getWorldTransform().getBasis())};
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body || !body->isKinematicObject()) return pose;
  RigidBody back;
  back.position = pose.origin;
  back.rotation = pose.rotation;
  back.velocity = -to_vector(body->getLinearVelocity());
  back.angular_velocity = -to_vector(body->getAngularVelocity());
  if (!back.velocity.allFinite() || !back.angular_velocity.allFinite()) return pose;
  back.drift(duration);
  return {back.position, back.rotation};
}

void RigidBodies::begin_step(Real duration, bool gravity_applied) {
  ++step_;
  links_.begin_step(step_);
  duration_ = duration;
  gravity_applied_ = gravity_applied;
  std::erase_if(expectations_, [this](const auto& entry) { return entry.second.step < step_ - 1; });
}

// The state of an object at the start of the step. Static, sleeping or not a rigid body at all: an obstacle at rest.
RigidBody RigidBodies::start_of(const btCollisionObject& object) const {
  RigidBody start;
  const Pose pose = pose_at_start(object, duration_);
  start.position = pose.origin;
  start.rotation = pose.rotation;
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body || stands_still(*body)) return start;
  const bool is_dynamic = !body->isKinematicObject() && body->isActive() && body->getInvMass() > 0;
  if (!is_dynamic && !body->isKinematicObject()) return start;
  start.velocity = to_vector(body->getLinearVelocity());
  start.angular_velocity = to_vector(body->getAngularVelocity());
  if (!is_dynamic) return start;

  start.inverse_mass = Real(body->getInvMass()) * to_vector(body->getLinearFactor());
  start.inverse_inertia = inverse_inertia(*body);
  start.acceleration = known_acceleration(*body, gravity_applied_);
  if (gravity_applied_) start.velocity -= duration_ * start.acceleration;
  // What other contacts did to this body in the last step they will do again: without it a body that lies on the ground
  // would fall through every sub-cycle. Limited, so that an impact is not repeated.
  const auto expected = expectations_.find(object.getBroadphaseHandle()->m_uniqueId);
  if (expected != expectations_.end() && expected->second.step == step_ - 1) {
    Vector3 other = (start.velocity - expected->second.velocity) / duration_;
    const Real limit =
        start.acceleration.norm() + expected->second.impulse.cwiseProduct(start.inverse_mass).norm() / duration_;
    const Real size = other.norm();
    if (size > limit) other *= limit / size;
    start.acceleration += other;
  }
  return start;
}

int RigidBodies::touch(btCollisionObject& object, bool approached, std::vector<TouchedRigidBody>& touched) const {
  btRigidBody* body = btRigidBody::upcast(&object);
  const bool wake = approached && body && !body->isStaticOrKinematicObject() && !body->isActive();
  if (wake) body->activate();
  if (approached && !body) Links::wake(object);
  const int key = object.getBroadphaseHandle()->m_uniqueId;
  for (std::size_t k = 0; k < touched.size(); ++k)
    if (touched[k].key == key) {
      if (wake) touched[k].start = start_of(object);
      return static_cast<int>(k);
    }
  touched.push_back({&object, body, key, bounds_of(object), start_of(object), {}, {}});
  links_.read(touched.back(), duration_);
  return static_cast<int>(touched.size()) - 1;
}

void RigidBodies::expect_no_others(TouchedRigidBody& touched) const {
  touched.start.acceleration = known_acceleration(*touched.body, gravity_applied_);
  touched.start.angular_acceleration = known_angular_acceleration(*touched.body, gravity_applied_, duration_);
}

void RigidBodies::hand_back(std::span<TouchedRigidBody> touched, std::span<const RigidBody> states) {
  for (std::size_t k = 0; k < touched.size(); ++k) {
    TouchedRigidBody& t = touched[k];
    t.state = states[k];
    if (!t.start.is_dynamic() || t.articulation) continue;
    const Vector3 dv = t.state.impulse.cwiseProduct(t.start.inverse_mass);
    const Vector3 dw = t.state.angular_velocity - t.start.angular_velocity -
                       duration_ * t.start.angular_acceleration;  // which Bullet's solver adds
    if (!dv.allFinite() || !dw.allFinite()) continue;
    btRigidBody& body = *t.body;
    body.setLinearVelocity(body.getLinearVelocity() + to_bullet(dv));
    body.setAngularVelocity(body.getAngularVelocity() + to_bullet(dw));
    const Vector3 expected = t.start.velocity + dv + duration_ * known_acceleration(body, gravity_applied_);
    if (expected.allFinite()) expectations_[t.key] = {step_, expected, t.state.impulse};
  }
  links_.hand_back(touched);
}

void RigidBodies::correct(std::span<const TouchedRigidBody> touched, btBroadphaseInterface& world, Real duration) {
  Box box;
  for (const TouchedRigidBody& t : touched)
    if (t.start.is_dynamic() && (t.bounds.high - t.bounds.low).allFinite()) box.add(t.bounds);
  if (!(box.high - box.low).allFinite()) return;  // none
  Present present;
  world.aabbTest(to_bullet(box.low), to_bullet(box.high), present);
  for (const TouchedRigidBody& t : touched) {
    if (!t.start.is_dynamic() || !present.ids.contains(t.key)) continue;
    if (t.articulation)
      links_.observe(t);
    else if (t.body->isActive())  // who fell asleep was not moved
      penalty::correct(t, duration);
  }
}

}  // namespace penalty
