#include "obstacles.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "body_anchors.h"
#include "convert.h"
#include "held_bodies.h"
#include "rigid_surfaces.h"
#include "sleeping.h"
#include "surface_distance.h"
#include "world_island.h"

namespace penalty {
namespace {

constexpr Real margins_taken_back = 2, share_taken_back = 0.05;  // of depth in bodies that can move: of their size

Real size_of(const Box& box) { return (box.high - box.low).minCoeff(); }

// The collision objects that a soft body may touch, of those in a box.
class Candidates final : public btBroadphaseAabbCallback {
 public:
  explicit Candidates(const btSoftBody& body) : body_(body) {}

  bool process(const btBroadphaseProxy* proxy) override {
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (object->getInternalType() == btCollisionObject::CO_SOFT_BODY || object->getCollisionShape()->isSoftBody())
      return true;
    if (may_collide(*object, body_)) objects.push_back(object);
    return true;
  }

  std::vector<btCollisionObject*> objects;

 private:
  const btSoftBody& body_;
};

Real radius_about_origin(const btCollisionShape& shape) {
  btVector3 center;
  btScalar radius = 0;
  shape.getBoundingSphere(center, radius);
  return center.length() + radius;
}

}  // namespace

Real reach_of(const btRigidBody& rigid, Real duration) {
  return duration * (Real(rigid.getLinearVelocity().length()) +
                     Real(rigid.getAngularVelocity().length()) *
                         std::min(radius_about_origin(*rigid.getCollisionShape()), 1e6)) +
         Real(rigid.getGravity().length()) * duration * duration;
}

Box bounds_of(const btCollisionObject& object) {
  btVector3 low, high;
  object.getCollisionShape()->getAabb(object.getWorldTransform(), low, high);
  return {to_vector(low), to_vector(high)};
}

bool may_collide(const btCollisionObject& object, const btSoftBody& body) {
  if (!object.hasContactResponse() || !object.checkCollideWith(&body) || !body.checkCollideWith(&object)) return false;
  const auto& disabled = body.m_collisionDisabledObjects;
  if (disabled.findLinearSearch(&object) != disabled.size()) return false;
  const btBroadphaseProxy *one = object.getBroadphaseHandle(), *two = body.getBroadphaseHandle();
  return !one || !two ||
         ((one->m_collisionFilterGroup & two->m_collisionFilterMask) != 0 &&
          (two->m_collisionFilterGroup & one->m_collisionFilterMask) != 0);
}

std::vector<btCollisionObject*> obstacles_near(btSoftBody& body, const Box& box, Real padding) {
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

bool detect_contacts(HeldBody& held, WorldIsland& island, const RigidBodies& rigid_bodies,
                     RigidSurfaces& rigid_surfaces, Real duration) {
  SteppedBody& stepped = held.stepped;
  const Particles& particles = stepped.particles;
  btSoftBody& body = *held.body;
  held.mesh_sides.begin_step();
  if (!body.hasContactResponse()) return true;

  const Real margin = held.margin();
  const Real fall = stepped.gravity.norm() * duration * duration;
  const Box& box = held.box;
  const Real fastest = std::sqrt(held.fastest2);
  const Real sweep = fastest * duration + fall + margin, waking = waking_speed(stepped.size);
  if (!std::isfinite(sweep + box.low.sum() + box.high.sum())) return true;

  // Bullet's boxes are those of the last step: look further around, then test each object where it is and as fast as it
  // is.
  const Real around = std::max(sweep, (box.high - box.low).norm());
  bool friction_is_finite = true;
  std::vector<SurfacePoint> surface;
  for (btCollisionObject* object : obstacles_near(body, box, around)) {
    const btRigidBody* rigid = btRigidBody::upcast(object);
    const Box object_box = bounds_of(*object);
    const std::array<Vector3, 2> of_link = link_velocities(*object);  // and its spin
    const Real reach =
        sweep + (rigid
                     ? reach_of(*rigid, duration)
                     : duration * (of_link[0].norm() + of_link[1].norm() * (object_box.high - object_box.low).norm()));
    if (!object_box.overlaps(box, reach)) continue;

    const Pose pose = pose_at_start(*object, duration);
    const Vector3& origin = pose.origin;
    const Matrix3& rotation = pose.rotation;
    Real friction = Real(body.m_cfg.kDF) * Real(object->getFriction());
    if (!std::isfinite(friction)) {
      friction = 0;
      friction_is_finite = false;
    }
    Box reached = box;
    reached.low.array() -= reach;
    reached.high.array() += reach;
    // Corners and edges would push the triangles at an anchor off what it holds them to.
    const bool holds_some = is_anchored(held, *object);
    for (SurfacePair* pair : holds_some ? std::vector<SurfacePair*>{} : rigid_surfaces.near(held, *object, reached)) {
      pair->b().friction = std::isfinite(pair->b().friction) ? pair->b().friction : 0;
      const bool approached = fastest > waking && object_box.overlaps(box, 2 * margin);
      island.surfaces.push_back({pair, &held, nullptr, rigid_bodies.touch(*object, approached, island.touched)});
    }
    // That a point will go relative to the object, left to itself.
    const auto way_of = [&](const Vector3& v, const Vector3& x) {
      Vector3 of_object = of_link[0] + of_link[1].cross(x - origin);
      if (rigid && !stands_still(*rigid))
        of_object = to_vector(rigid->getVelocityInLocalPoint(to_bullet(Vector3(x - origin))));
      return Vector3(duration * (v - of_object + duration * stepped.gravity));
    };
    const bool is_movable = rigid ? !rigid->isStaticOrKinematicObject() : is_movable_link(*object);
    // What starts deep in a body that can move would be blown up around it, node by node.
    const Real deepest = is_movable ? std::max(margins_taken_back * margin, share_taken_back * size_of(object_box))
                                    : std::numeric_limits<Real>::infinity();
    held.mesh_sides.approach(*object, pose, {particles, held.field, held.options.contact_points}, margin + reach);
    const auto add_point = [&](int number, const WeightedPoint& point) {
      if (!is_movable && point.mobility(particles.inverse_masses) <= 0) return;  // two that are held
      if (holds_some && is_anchored(held, point, *object)) return;
      const Vector3 x = point.of(particles.positions);
      if (!object_box.contains(x, reach) && !held.mesh_sides.follows(number)) return;
      surface.clear();
      append_surface_points(*object->getCollisionShape(), rotation.transpose() * (x - origin), margin + reach, surface);
      const Vector3 v = point.of(particles.velocities);
      held.mesh_sides.append_planes(number, rotation.transpose() * way_of(v, x), margin, margin + reach, surface);
      for (const SurfacePoint& nearest : surface) {
        const bool approached = -v.dot(rotation * nearest.normal) > waking;
        const Real radius = nearest.radius > 0 ? nearest.radius + margin : 0;
        const Vector3 anchor = nearest.point + (margin - radius) * nearest.normal;
        const int touched = rigid_bodies.touch(*object, approached, island.touched);
        island.contacts.push_back({.a = Side::of_particles(0, point),
                                   .b = Side::of_rigid(touched, anchor),
                                   .normal = nearest.normal,
                                   .radius = radius,
                                   .friction = friction,
                                   .deepest = deepest});
      }
    };
    if (held.options.contact_points.empty()) {
      for (int i = 0; i < particles.size(); ++i) add_point(i, WeightedPoint::at_particle(i));
    } else {
      int number = 0;
      for (const WeightedPoint& point : held.options.contact_points) add_point(number++, point);
    }
  }
  return friction_is_finite;
}

}  // namespace penalty
