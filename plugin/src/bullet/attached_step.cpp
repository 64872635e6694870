// One step: islands of soft bodies and the rigid bodies that they touch.
#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>

#include "attached_world.h"
#include "convert.h"
#include "surface_distance.h"

namespace penalty {
namespace {

// Slower than this [m/s], touching does not wake what sleeps.
constexpr Real waking_speed = 0.1;

struct Box {
  Vector3 low = Vector3::Constant(std::numeric_limits<Real>::infinity());
  Vector3 high = -low;

  void add(const Vector3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  bool overlaps(const Box& other, Real padding) const {
    return ((low.array() - padding) <= other.high.array()).all() &&
           ((other.low.array() - padding) <= high.array()).all();
  }
  bool contains(const Vector3& p, Real padding) const {
    return ((low.array() - padding) <= p.array()).all() && ((high.array() + padding) >= p.array()).all();
  }
};

Box bounds_of(const btCollisionObject& object) {
  btVector3 low, high;
  object.getCollisionShape()->getAabb(object.getWorldTransform(), low, high);
  return {to_vector(low), to_vector(high)};
}

// The collision objects that a soft body may touch, of those in a box.
class Candidates final : public btBroadphaseAabbCallback {
 public:
  explicit Candidates(const btSoftBody& body) : body_(body) {}

  bool process(const btBroadphaseProxy* proxy) override {
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (object->getInternalType() == btCollisionObject::CO_SOFT_BODY || !object->hasContactResponse()) return true;
    if (object->getCollisionShape()->isSoftBody()) return true;
    if (body_.m_collisionDisabledObjects.findLinearSearch(object) != body_.m_collisionDisabledObjects.size())
      return true;
    if (!object->checkCollideWith(&body_) || !body_.checkCollideWith(object)) return true;
    if (const btBroadphaseProxy* own = body_.getBroadphaseHandle())
      if (!(proxy->m_collisionFilterGroup & own->m_collisionFilterMask) ||
          !(own->m_collisionFilterGroup & proxy->m_collisionFilterMask))
        return true;
    objects.push_back(object);
    return true;
  }

  std::vector<btCollisionObject*> objects;

 private:
  const btSoftBody& body_;
};

std::vector<btCollisionObject*> candidates(btSoftBody& body, const Box& box, Real padding) {
  Candidates found(body);
  const Vector3 pad = Vector3::Constant(padding);
  body.getWorldInfo()->m_broadphase->aabbTest(to_bullet(Vector3(box.low - pad)), to_bullet(Vector3(box.high + pad)),
                                              found);
  // The broadphase has no order of its own; results must not depend on where objects lie in memory.
  std::sort(found.objects.begin(), found.objects.end(), [](const btCollisionObject* a, const btCollisionObject* b) {
    return a->getBroadphaseHandle()->m_uniqueId < b->getBroadphaseHandle()->m_uniqueId;
  });
  return std::move(found.objects);
}

Vector3 position_of(const ContactPoint& point, const PackedVectors& vectors) {
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k < point.num_particles; ++k) sum += point.weights[k] * vectors.col(point.particles[k]).head<3>();
  return sum;
}

Real radius_about_origin(const btCollisionShape& shape) {
  btVector3 center;
  btScalar radius = 0;
  shape.getBoundingSphere(center, radius);
  return center.length() + radius;
}

// What will accelerate the body besides contacts. The classic world adds all forces in its own solver, later; the deformable
// world has already added gravity to the velocity, and with it the forces of the application.
Vector3 known_acceleration(const btRigidBody& body, bool gravity_applied) {
  const Vector3 factor = to_vector(body.getLinearFactor());
  return gravity_applied ? Vector3(to_vector(body.getGravity()).cwiseProduct(factor))
                         : Vector3(Real(body.getInvMass()) * to_vector(body.getTotalForce()).cwiseProduct(factor));
}

Matrix3 inverse_inertia(const btRigidBody& body) {
  const Matrix3 factor = to_vector(body.getAngularFactor()).asDiagonal();
  return factor * to_matrix(body.getInvInertiaTensorWorld()) * factor;
}

}  // namespace

// The state of an object at the start of the step. Static, sleeping or not a rigid body at all: an obstacle at rest.
RigidBody AttachedBodies::World::start_of(const btCollisionObject& object, Real duration, bool gravity_applied) const {
  RigidBody start;
  start.position = to_vector(object.getWorldTransform().getOrigin());
  start.rotation = to_matrix(object.getWorldTransform().getBasis());
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body || body->isStaticObject()) return start;
  const bool is_dynamic = !body->isKinematicObject() && body->isActive() && body->getInvMass() > 0;
  if (!is_dynamic && !body->isKinematicObject()) return start;
  start.velocity = to_vector(body->getLinearVelocity());
  start.angular_velocity = to_vector(body->getAngularVelocity());
  if (!is_dynamic) return start;

  start.inverse_mass = Real(body->getInvMass()) * to_vector(body->getLinearFactor());
  start.inverse_inertia = inverse_inertia(*body);
  start.acceleration = known_acceleration(*body, gravity_applied);
  if (gravity_applied) start.velocity -= duration * start.acceleration;
  // What other contacts did to this body in the last step they will do again: without it a body that lies on the ground
  // would fall through every sub-cycle. Limited, so that an impact is not repeated.
  const auto expected = expectations_.find(object.getBroadphaseHandle()->m_uniqueId);
  if (expected != expectations_.end() && expected->second.step == step_count_ - 1) {
    Vector3 other = (start.velocity - expected->second.velocity) / duration;
    const Real limit =
        start.acceleration.norm() + expected->second.impulse.cwiseProduct(start.inverse_mass).norm() / duration;
    const Real size = other.norm();
    if (size > limit) other *= limit / size;
    start.acceleration += other;
  }
  return start;
}

// Returns the index of the object among the rigid bodies of the island, taking it in if it is new and waking it if a soft
// body comes at it.
int AttachedBodies::World::touch(btCollisionObject& object, bool approached, Island& island, Real duration,
                                 bool gravity_applied) {
  btRigidBody* body = btRigidBody::upcast(&object);
  const bool wake = approached && body && !body->isStaticOrKinematicObject() && !body->isActive();
  if (wake) body->activate();
  const int key = object.getBroadphaseHandle()->m_uniqueId;
  for (std::size_t k = 0; k < island.touched.size(); ++k)
    if (island.touched[k].key == key) {
      if (wake) island.touched[k].start = start_of(object, duration, gravity_applied);
      return static_cast<int>(k);
    }
  island.touched.push_back({body, key, start_of(object, duration, gravity_applied), {}});
  return static_cast<int>(island.touched.size()) - 1;
}

void AttachedBodies::World::detect_contacts(AttachedBody& attached, Island& island, Real duration,
                                            bool gravity_applied) {
  SteppedBody& stepped = attached.stepped;
  const Particles& particles = stepped.particles;
  btSoftBody& body = *attached.body;
  stepped.contacts.clear();
  if (!body.hasContactResponse()) return;

  const Real margin = body.getCollisionShape()->getMargin();
  const Real fall = stepped.gravity.norm() * duration * duration;
  Box box;
  Real fastest = 0;
  for (int i = 0; i < particles.size(); ++i) {
    box.add(particles.positions.col(i).head<3>());
    fastest = std::max(fastest, particles.velocities.col(i).head<3>().squaredNorm());
  }
  fastest = std::sqrt(fastest);
  const Real sweep = fastest * duration + fall + margin;
  if (!std::isfinite(sweep + box.low.sum() + box.high.sum())) return;

  // Bullet's boxes are those of the last step: look further around, then test each object where it is and as fast as it is.
  const Real around = std::max(sweep, (box.high - box.low).norm());
  std::vector<SurfacePoint> surface;
  for (btCollisionObject* object : candidates(body, box, around)) {
    const btRigidBody* rigid = btRigidBody::upcast(object);
    Real object_sweep = 0;
    if (rigid)
      object_sweep = duration * (Real(rigid->getLinearVelocity().length()) +
                                 Real(rigid->getAngularVelocity().length()) *
                                     std::min(radius_about_origin(*object->getCollisionShape()), 1e6)) +
                     Real(rigid->getGravity().length()) * duration * duration;
    const Box object_box = bounds_of(*object);
    if (!object_box.overlaps(box, sweep + object_sweep)) continue;

    const Vector3 origin = to_vector(object->getWorldTransform().getOrigin());
    const Matrix3 rotation = to_matrix(object->getWorldTransform().getBasis());
    const Real friction = Real(body.m_cfg.kDF) * Real(object->getFriction());
    const auto add_point = [&](const ContactPoint& point) {
      const Vector3 x = position_of(point, particles.positions);
      const Real reach = sweep + object_sweep;
      if (!object_box.contains(x, reach)) return;
      surface.clear();
      append_surface_points(*object->getCollisionShape(), rotation.transpose() * (x - origin), margin + reach, surface);
      const Vector3 v = surface.empty() ? Vector3(Vector3::Zero()) : position_of(point, particles.velocities);
      for (const SurfacePoint& nearest : surface) {
        const bool approached = -v.dot(rotation * nearest.normal) > waking_speed;
        Contact contact;
        contact.point = point;
        contact.rigid_body = touch(*object, approached, island, duration, gravity_applied);
        contact.radius = nearest.radius > 0 ? nearest.radius + margin : 0;
        contact.anchor = nearest.point + (margin - contact.radius) * nearest.normal;
        contact.normal = nearest.normal;
        contact.friction = friction;
        stepped.contacts.push_back(contact);
      }
    };
    if (attached.options.contact_points.empty()) {
      for (int i = 0; i < particles.size(); ++i)
        if (particles.inverse_masses[i] > 0) add_point(ContactPoint::at_particle(i));
    } else {
      for (const ContactPoint& point : attached.options.contact_points) add_point(point);
    }
  }
}

// A sleeping soft body wakes when something that moves comes near.
void AttachedBodies::World::wake_if_hit(btSoftBody& body) {
  if (body.getActivationState() != ISLAND_SLEEPING) return;
  Box box;
  for (int i = 0; i < body.m_nodes.size(); ++i) box.add(to_vector(body.m_nodes[i].m_x));
  const Real margin = body.getCollisionShape()->getMargin();
  for (btCollisionObject* object : candidates(body, box, margin)) {
    const btRigidBody* rigid = btRigidBody::upcast(object);
    if (!rigid || !rigid->isActive() || rigid->isStaticObject()) continue;
    if (Real(rigid->getLinearVelocity().length()) > waking_speed && bounds_of(*object).overlaps(box, 2 * margin))
      body.activate(true);
  }
}

void AttachedBodies::World::absorb(Island& into, Island& from) {
  std::vector<int> renumbered;
  for (const TouchedRigidBody& touched : from.touched) {
    const auto known = std::find_if(into.touched.begin(), into.touched.end(),
                                    [&](const TouchedRigidBody& t) { return t.key == touched.key; });
    renumbered.push_back(static_cast<int>(known - into.touched.begin()));
    if (known == into.touched.end()) into.touched.push_back(touched);
  }
  for (SteppedBody* body : from.bodies) {
    for (Contact& contact : body->contacts) contact.rigid_body = renumbered[contact.rigid_body];
    into.bodies.push_back(body);
  }
  into.couplings.insert(into.couplings.end(), from.couplings.begin(), from.couplings.end());
  from = {};
}

// Bodies that touch the same movable rigid body are stepped together.
void AttachedBodies::World::merge_islands() {
  const auto share = [](const Island& a, const Island& b) {
    for (const TouchedRigidBody& first : a.touched)
      for (const TouchedRigidBody& second : b.touched)
        if (first.key == second.key && first.start.is_dynamic()) return true;
    return false;
  };
  for (std::size_t i = 0; i < islands_.size(); ++i)
    for (std::size_t j = i + 1; j < islands_.size();)
      if (!islands_[j].bodies.empty() && share(islands_[i], islands_[j])) {
        absorb(islands_[i], islands_[j]);
        j = i + 1;  // what came in may touch more
      } else {
        ++j;
      }
}

void AttachedBodies::World::advance_island(Island& island, Real duration) {
  island.states.clear();
  for (const TouchedRigidBody& touched : island.touched) island.states.push_back(touched.start);
  std::vector<Coupling*> couplings;
  for (AttachedCoupling* coupling : island.couplings) {
    for (std::size_t k = 0; k < coupling->points.size(); ++k) {
      const CouplingPoint& point = coupling->points[k];
      CoupledPoint& coupled = coupling->stepped.points[k];
      if (point.soft_body) {
        const auto body = std::find(island.bodies.begin(), island.bodies.end(), &get(*point.soft_body).stepped);
        coupled = {.body = static_cast<int>(body - island.bodies.begin()), .particle = point.node};
      } else {
        const auto touched = std::find_if(island.touched.begin(), island.touched.end(), [&](const TouchedRigidBody& t) {
          return t.key == point.rigid_body->getBroadphaseHandle()->m_uniqueId;
        });
        coupled = {.rigid_body = static_cast<int>(touched - island.touched.begin()), .anchor = point.anchor};
      }
    }
    const std::uint64_t version = coupling->field.stiffness_version();
    estimate_stability(coupling->stepped, island.bodies, island.states, coupling->field.rest_positions(),
                       version != coupling->estimated_version);
    coupling->estimated_version = version;
    couplings.push_back(&coupling->stepped);
  }
  advance(island.bodies, island.states, duration, couplings);
}

void AttachedBodies::World::hand_back(Island& island, Real duration, bool gravity_applied) {
  for (std::size_t k = 0; k < island.touched.size(); ++k) {
    TouchedRigidBody& touched = island.touched[k];
    touched.state = island.states[k];
    if (!touched.start.is_dynamic()) continue;
    const Vector3 dv = touched.state.impulse.cwiseProduct(touched.start.inverse_mass);
    const Vector3 dw = touched.state.angular_velocity - touched.start.angular_velocity;
    btRigidBody& body = *touched.body;
    body.setLinearVelocity(body.getLinearVelocity() + to_bullet(dv));
    body.setAngularVelocity(body.getAngularVelocity() + to_bullet(dw));
    expectations_[touched.key] = {step_count_,
                                  touched.start.velocity + dv + duration * known_acceleration(body, gravity_applied),
                                  touched.state.impulse};
  }
}

std::span<AttachedBody* const> AttachedBodies::World::step(std::span<btSoftBody* const> bodies, Real duration,
                                                           bool gravity_applied) {
  ++step_count_;
  std::erase_if(expectations_, [this](const auto& entry) { return entry.second.step < step_count_ - 1; });
  stepped_.clear();
  islands_.clear();
  for (btSoftBody* body : bodies)
    if (find(*body)) wake_if_hit(*body);
  wake_coupled();
  for (btSoftBody* body : bodies) {
    AttachedBody* attached = find(*body);
    if (!attached || !body->isActive()) continue;
    attached->read_nodes();
    attached->read_forces();
    SteppedBody& stepped = attached->stepped;
    const Vector3 gravity = to_vector(body->getWorldInfo()->m_gravity) * Real(body->m_gravityFactor);
    stepped.gravity = gravity;
    if (attached->stale || attached->estimated_version != attached->field.stiffness_version()) {
      estimate_stability(stepped, attached->field.rest_positions());
      attached->stale = false;
      attached->estimated_version = attached->field.stiffness_version();
    }
    Island island;
    island.bodies.push_back(&stepped);
    detect_contacts(*attached, island, duration, gravity_applied);
    // Sleeps only after what it carries, which in turn waits, as one island of Bullet's, for the soft body.
    for (const TouchedRigidBody& touched : island.touched)
      if (touched.start.is_dynamic() && touched.body->getActivationState() != WANTS_DEACTIVATION)
        body->setDeactivationTime(0);
    islands_.push_back(std::move(island));
    stepped_.push_back(attached);
  }
  join_coupled(duration, gravity_applied);
  merge_islands();
  std::erase_if(islands_, [](const Island& island) { return island.bodies.empty(); });
  for (Island& island : islands_) {
    advance_island(island, duration);
    hand_back(island, duration, gravity_applied);
  }
  for (AttachedBody* attached : stepped_)
    if (attached->rejected_particle >= 0) {
      attached->stepped.report.finite = false;
      attached->stepped.report.first_bad_particle = attached->rejected_particle;
    }
  return stepped_;
}

void AttachedBodies::World::correct_rigid_bodies(Real duration) {
  for (Island& island : islands_)
    for (TouchedRigidBody& touched : island.touched) {
      if (!touched.start.is_dynamic() || !touched.body->isActive()) continue;  // who fell asleep was not moved
      const Vector3 shift = touched.state.position - touched.start.position - duration * touched.state.velocity;
      const Vector3 turn = touched.state.turn - duration * touched.state.angular_velocity;
      btTransform transform = touched.body->getWorldTransform();
      transform.setOrigin(transform.getOrigin() + to_bullet(shift));
      const Real angle = turn.norm();
      if (angle > 1e-12)
        transform.setRotation(
            (btQuaternion(to_bullet(Vector3(turn / angle)), static_cast<btScalar>(angle)) * transform.getRotation())
                .normalized());
      touched.body->setWorldTransform(transform);
      touched.body->setInterpolationWorldTransform(transform);
    }
  islands_.clear();
}

}  // namespace penalty
