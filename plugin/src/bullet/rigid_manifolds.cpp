#include "rigid_manifolds.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "convert.h"
#include "obstacles.h"
#include "rigid_joints.h"
#include "shape_edges.h"
#include "surface_distance.h"
#include "world_island.h"

namespace penalty {
namespace {

constexpr Real same_point = 0.05, most_same_point = 0.02;  // share of the size of a body, and Bullet's distance [m]
constexpr Real same_normal = 0.99;                         // cosine, for balls, which have no points

Real size_of(const btCollisionObject& object) {
  const Box box = bounds_of(object);
  return (box.high - box.low).norm();
}

int id_of(const btCollisionObject& object) { return object.getBroadphaseHandle()->m_uniqueId; }

// Links of multibodies are left to Bullet: here they would be walls.
bool is_rigid(const btCollisionObject& object) {
  return object.hasContactResponse() && object.getBroadphaseHandle() &&
         (btRigidBody::upcast(&object) || object.getInternalType() == btCollisionObject::CO_COLLISION_OBJECT);
}

// Pairs whose boxes overlap, by each of their objects.
std::map<int, std::vector<btBroadphasePair*>> pairs_by_object(btOverlappingPairCache& cache) {
  std::map<int, std::vector<btBroadphasePair*>> pairs;
  btBroadphasePairArray& all = cache.getOverlappingPairArray();
  for (int k = 0; k < all.size(); ++k) {
    const auto& one = *static_cast<btCollisionObject*>(all[k].m_pProxy0->m_clientObject);
    const auto& two = *static_cast<btCollisionObject*>(all[k].m_pProxy1->m_clientObject);
    if (!is_rigid(one) || !is_rigid(two)) continue;
    pairs[id_of(one)].push_back(&all[k]);
    pairs[id_of(two)].push_back(&all[k]);
  }
  return pairs;
}

// Islands by their rigid bodies that may move.
class Owners {
 public:
  explicit Owners(std::vector<WorldIsland>& islands) {
    for (WorldIsland& island : islands)
      for (const TouchedRigidBody& touched : island.touched)
        if (touched.start.is_dynamic()) islands_.try_emplace(touched.key, &island);
  }
  WorldIsland* of(int key) const {
    const auto found = islands_.find(key);
    return found == islands_.end() ? nullptr : found->second;
  }
  void add(int key, WorldIsland& island) { islands_[key] = &island; }
  void merge(WorldIsland& into, WorldIsland& from) {
    into.absorb(from);
    for (auto& [key, island] : islands_)
      if (island == &from) island = &into;
  }
  std::vector<int> keys() const {
    std::vector<int> keys;
    keys.reserve(islands_.size());
    for (const auto& [key, island] : islands_) keys.push_back(key);
    return keys;
  }

 private:
  std::map<int, WorldIsland*> islands_;
};

struct Point {
  const btCollisionObject *a, *b;
  btVector3 on_a, on_b, normal;  // the latter from b to a
  btScalar friction = 0, restitution = 0, rolling = 0, spinning = 0;

  static Point between(const btCollisionObject* a, const btCollisionObject* b, const btVector3& on_a,
                       const btVector3& on_b, const btVector3& normal) {
    return {a,
            b,
            on_a,
            on_b,
            normal,
            btManifoldResult::calculateCombinedFriction(a, b),
            btManifoldResult::calculateCombinedRestitution(a, b),
            btManifoldResult::calculateCombinedRollingFriction(a, b),
            btManifoldResult::calculateCombinedSpinningFriction(a, b)};
  }
  // What the application made of it, when it was told of a new point.
  void take_settings(const btManifoldPoint& point) {
    friction = point.m_combinedFriction;
    restitution = point.m_combinedRestitution;
    rolling = point.m_combinedRollingFriction;
    spinning = point.m_combinedSpinningFriction;
  }
};

// All points that an algorithm finds, of which a manifold would keep four: too few for the corners of two boxes. They go
// into no manifold: the dispatcher, which is about to find them in the same places, tells the application of each once.
class AllPoints final : public btManifoldResult {
 public:
  AllPoints(const btCollisionObjectWrapper& one, const btCollisionObjectWrapper& two, std::vector<Point>& points)
      : btManifoldResult(&one, &two), points_(points) {}

  void addContactPoint(const btVector3& normal, const btVector3& on_b, btScalar distance) override {
    if (!m_manifoldPtr || distance > m_manifoldPtr->getContactBreakingThreshold()) return;
    const btCollisionObject *a = m_body0Wrap->getCollisionObject(), *b = m_body1Wrap->getCollisionObject();
    points_.push_back(Point::between(a, b, on_b + normal * distance, on_b, normal));
  }

 private:
  std::vector<Point>& points_;
};

// Detects as the dispatcher is about to, but where an application has a way of its own, which is taken.
void detect(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, std::vector<Point>& points) {
  const btDispatcherInfo how;
  if (dispatcher.getNearCallback() != btCollisionDispatcher::defaultNearCallback)
    return dispatcher.getNearCallback()(pair, dispatcher, how);
  auto* one = static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  auto* two = static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  const btCollisionObjectWrapper of_one(nullptr, one->getCollisionShape(), one, one->getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper of_two(nullptr, two->getCollisionShape(), two, two->getWorldTransform(), -1, -1);
  if (!pair.m_algorithm)
    pair.m_algorithm = dispatcher.findAlgorithm(&of_one, &of_two, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (!pair.m_algorithm) return;
  AllPoints result(of_one, of_two, points);
  pair.m_algorithm->processCollision(&of_one, &of_two, how, &result);
}

// Those of earlier steps that are still there: most algorithms find one point at a time.
void add_remembered(btPersistentManifold& manifold, std::vector<Point>& points) {
  const std::size_t found = points.size();
  const btScalar same = manifold.getContactBreakingThreshold();
  for (int k = 0; k < manifold.getNumContacts(); ++k) {
    btManifoldPoint& point = manifold.getContactPoint(k);
    point.m_appliedImpulse = point.m_appliedImpulseLateral1 = point.m_appliedImpulseLateral2 = 0;
    const btVector3& on_a = point.getPositionWorldOnA();
    if (std::any_of(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(found),
                    [&](const Point& p) { return on_a.distance(p.a == manifold.getBody0() ? p.on_a : p.on_b) < same; }))
      continue;
    points.push_back(
        {manifold.getBody0(), manifold.getBody1(), on_a, point.getPositionWorldOnB(), point.m_normalWorldOnB});
    points.back().take_settings(point);
  }
}

// Corners of `a` near the surface of `b`.
void append_corners(const btCollisionObject& a, const btCollisionObject& b, Real reach, std::vector<Point>& points) {
  const btTransform &of_a = a.getWorldTransform(), &of_b = b.getWorldTransform();
  std::vector<SurfacePoint> found;
  for (const ShapeEdges& edges : edges_of(*a.getCollisionShape(), {}))
    for (const Vector3& corner : edges.points) {
      const btVector3 at = of_a * to_bullet(corner);
      found.clear();
      append_surface_points(*b.getCollisionShape(), to_vector(of_b.invXform(at)), reach + edges.radius, found);
      for (const SurfacePoint& nearest : found) {
        const btVector3 normal = of_b.getBasis() * to_bullet(nearest.normal);
        points.push_back(Point::between(&a, &b, at - normal * static_cast<btScalar>(edges.radius),
                                        of_b * to_bullet(nearest.point), normal));
      }
    }
}

// Bullet finds boxes that touch, not those that will in the step.
void add_ahead(const btCollisionObject& one, const btCollisionObject& two, Real duration, std::vector<Point>& points) {
  if (is_concave(*one.getCollisionShape()) || is_concave(*two.getCollisionShape())) return;
  Real reach = 0;
  for (const auto* object : {&one, &two})
    if (const btRigidBody* rigid = btRigidBody::upcast(object)) reach += reach_of(*rigid, duration);
  if (!std::isfinite(reach)) return;
  append_corners(one, two, reach, points);
  append_corners(two, one, reach, points);
}

// Zero: it is no ball.
Real radius_of(const btCollisionObject& object) {
  const btCollisionShape& shape = *object.getCollisionShape();
  return shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE ? Real(static_cast<const btSphereShape&>(shape).getRadius())
                                                        : 0;
}

// A ball touches with whatever it has turned down: it is the first of the two.
void put_ball_first(Point& point) {
  if (radius_of(*point.a) > 0 || !(radius_of(*point.b) > 0)) return;
  std::swap(point.a, point.b);
  std::swap(point.on_a, point.on_b);
  point.normal = -point.normal;
}

// In the frames of the bodies, from where the point was found: not where a kinematic one starts.
RigidContact contact_of(const Point& point, int a, int b) {
  const btTransform &of_a = point.a->getWorldTransform(), &of_b = point.b->getWorldTransform();
  const Real radius = radius_of(*point.a);
  return {.a = a,
          .b = b,
          .anchor_a = radius > 0 ? Vector3::Zero() : to_vector(of_a.invXform(point.on_a)),
          .anchor_b = to_vector(of_b.invXform(point.on_b)),
          .normal = to_vector(of_b.getBasis().transpose() * point.normal),
          .radius = radius,
          .friction = Real(point.friction),
          .restitution = Real(point.restitution),
          .rolling = std::max<Real>(point.rolling, 0),
          // Bullet does not ask for it where nothing rolls.
          .spinning = point.rolling > 0 ? std::max<Real>(point.spinning, 0) : 0};
}

bool is_finite(const RigidContact& contact) {
  return (contact.anchor_a + contact.anchor_b + contact.normal).allFinite() &&
         std::isfinite(contact.friction + contact.restitution + contact.rolling + contact.spinning);
}

}  // namespace

// What is reached in a step, from whom.
struct RigidManifolds::Reach {
  Reach(std::vector<WorldIsland>& islands, const RigidBodies& bodies, Real step)
      : rigid_bodies(bodies), duration(step), owners(islands), reached(owners.keys()) {}

  WorldIsland& join(int key, std::span<btCollisionObject* const> objects) {
    WorldIsland& island = *owners.of(key);
    for (const btCollisionObject* object : objects)
      if (WorldIsland* other = owners.of(id_of(*object)); other && other != &island) owners.merge(island, *other);
    return island;
  }

  // The number of the object in the island. All that acts on it is in the island from now on.
  int take_in(btCollisionObject& object, bool approached, WorldIsland& island) {
    const int number = rigid_bodies.touch(object, approached, island.touched);
    TouchedRigidBody& touched = island.touched[number];
    if (!touched.start.is_dynamic()) return number;
    rigid_bodies.expect_no_others(touched);
    if (owners.of(touched.key)) return number;
    owners.add(touched.key, island);
    reached.push_back(touched.key);
    return number;
  }

  const RigidBodies& rigid_bodies;
  Real duration;
  Owners owners;
  std::vector<int> reached;  // grows on the way
  std::vector<Point> points = {};
  btManifoldArray manifolds = {};
};

void RigidManifolds::add(std::vector<WorldIsland>& islands, const btSoftBodyWorldInfo& info,
                         const RigidBodies& rigid_bodies, RigidJoints& joints, Real duration) {
  auto* dispatcher = dynamic_cast<btCollisionDispatcher*>(info.m_dispatcher);
  Reach reach(islands, rigid_bodies, duration);
  if (!dispatcher || reach.reached.empty()) return;
  joints.list();
  const auto pairs = pairs_by_object(*info.m_broadphase->getOverlappingPairCache());
  std::set<const void*> done;
  for (std::size_t k = 0; k < reach.reached.size(); ++k) {
    const int key = reach.reached[k];
    for (btTypedConstraint* joint : joints.of(key))
      if (done.insert(joint).second) add_joint(*joint, joints, key, reach);
    const auto of_body = pairs.find(key);
    if (of_body == pairs.end()) continue;
    for (btBroadphasePair* pair : of_body->second)
      if (done.insert(pair).second) add_contacts(*pair, *dispatcher, key, reach);
  }
}

void RigidManifolds::add_contacts(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, int key,
                                  Reach& reach) const {
  const std::array objects{static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject),
                           static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject)};
  if (!dispatcher.needsCollision(objects[0], objects[1])) return;
  std::vector<Point>& points = reach.points;
  points.clear();
  detect(pair, dispatcher, points);
  if (!pair.m_algorithm) return;
  reach.manifolds.resize(0);
  pair.m_algorithm->getAllContactManifolds(reach.manifolds);
  for (int m = 0; m < reach.manifolds.size(); ++m) add_remembered(*reach.manifolds[m], points);
  if (points.empty()) add_ahead(*objects[0], *objects[1], reach.duration, points);
  if (points.empty()) return;

  WorldIsland& island = reach.join(key, objects);
  const std::array numbers{reach.take_in(*objects[0], false, island), reach.take_in(*objects[1], false, island)};
  std::vector<RigidContact> contacts;
  for (Point& point : points) {
    put_ball_first(point);
    const bool swapped = point.a != objects[0];
    const RigidContact contact = contact_of(point, numbers[swapped], numbers[!swapped]);
    if (is_finite(contact)) contacts.push_back(contact);
  }
  recall(island.touched, std::min(size_of(*objects[0]), size_of(*objects[1])), contacts);
  island.rigid_contacts.insert(island.rigid_contacts.end(), contacts.begin(), contacts.end());
}

// One that holds a body of no world is left to Bullet, as is one of too many rows. What holds a single body holds it to the
// world.
void RigidManifolds::add_joint(btTypedConstraint& joint, const RigidJoints& joints, int key, Reach& reach) {
  std::vector<btCollisionObject*> objects;
  std::array<int, 2> numbers{-1, -1};
  btRigidBody *a = &joint.getRigidBodyA(), *b = &joint.getRigidBodyB();
  for (btRigidBody* body : {a, b})
    if (body->getBroadphaseHandle())
      objects.push_back(body);
    else if (body != &btTypedConstraint::getFixedBody())
      return;
  if (count_rows(joint) < 0) return;
  WorldIsland& island = reach.join(key, objects);
  if (a->getBroadphaseHandle()) numbers[0] = reach.take_in(*a, true, island);
  if (b->getBroadphaseHandle()) numbers[1] = reach.take_in(*b, true, island);
  island.joints.push_back({&joint, numbers[0], numbers[1], joints.joint_of(joint, numbers[0], numbers[1])});
  island.solver_info = &joints.solver_info();
}

// Forces of contacts that are there again; and of those that are not the ones that are open by a hair: a box that is
// carried at its corners would lose some of them at each move.
void RigidManifolds::recall(std::span<const TouchedRigidBody> touched, Real size,
                            std::vector<RigidContact>& contacts) const {
  if (contacts.empty()) return;
  const Real same = std::min(same_point * size, most_same_point);
  const std::size_t found = contacts.size();
  for (const bool swapped : {false, true}) {
    const int a = swapped ? contacts[0].b : contacts[0].a, b = swapped ? contacts[0].a : contacts[0].b;
    const auto known = last_.find({touched[a].key, touched[b].key});
    if (known == last_.end()) continue;
    const RigidBody &of_a = touched[a].start, &of_b = touched[b].start;
    for (RigidContact contact : known->second) {
      contact.a = a;
      contact.b = b;
      RigidContact* again = nullptr;
      for (std::size_t k = 0; k < found; ++k)
        if (contacts[k].a == a && (contacts[k].anchor_a - contact.anchor_a).norm() < same &&
            (contact.radius == 0 || contacts[k].normal.dot(contact.normal) > same_normal))
          again = &contacts[k];
      if (again) {
        again->force = contact.force;
        again->moment = contact.moment;
        continue;
      }
      if (contact.radius > 0) continue;
      const Vector3 offset =
          of_a.position + of_a.rotation * contact.anchor_a - of_b.position - of_b.rotation * contact.anchor_b;
      const Vector3 normal = of_b.rotation * contact.normal;
      const Real gap = normal.dot(offset);
      if (gap < same && (offset - gap * normal).norm() < same) contacts.push_back(contact);
    }
  }
}

void RigidManifolds::remember(const std::vector<WorldIsland>& islands) {
  last_.clear();
  for (const WorldIsland& island : islands)
    for (const RigidContact& contact : island.rigid_contacts)
      last_[{island.touched[contact.a].key, island.touched[contact.b].key}].push_back(contact);
}

}  // namespace penalty
