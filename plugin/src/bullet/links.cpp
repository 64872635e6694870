#include "links.h"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <Eigen/QR>
#include <algorithm>
#include <map>

#include "convert.h"
#include "rigid_bodies.h"

namespace penalty {
namespace {

// Velocities of a multibody: angular and linear ones of its base, then of its joints. As Bullet has them, and as doubles.
using Coordinates = btAlignedObjectArray<btScalar>;
using Eigen::MatrixXd, Eigen::VectorXd;

constexpr Real singular_mobility = sizeof(btScalar) == sizeof(double) ? 1e-9 : 1e-4;  // relative to the largest

VectorXd to_doubles(const btScalar* values, Eigen::Index size) {
  return Eigen::Map<const Eigen::Matrix<btScalar, Eigen::Dynamic, 1>>(values, size).cast<Real>();
}

Eigen::Index num_velocities(const btMultiBody& body) { return 6 + body.getNumDofs(); }

VectorXd velocities_of(const btMultiBody& body) { return to_doubles(body.getVelocityVector(), num_velocities(body)); }

// Change of the velocities of a multibody by a generalised impulse.
VectorXd response(const btMultiBody& body, const VectorXd& impulse) {
  Coordinates in, out, reals;
  btAlignedObjectArray<btVector3> vectors;
  in.resize(static_cast<int>(impulse.size()));
  out.resize(in.size(), btScalar(0));
  for (int k = 0; k < in.size(); ++k) in[k] = static_cast<btScalar>(impulse[k]);
  body.calcAccelerationDeltasMultiDof(&in[0], &out[0], reals, vectors);
  return to_doubles(&out[0], impulse.size());
}

// Velocity and angular velocity of the link, by the velocities of its multibody.
MatrixXd jacobian_of(const btMultiBodyLinkCollider& link) {
  const btMultiBody& body = *link.m_multiBody;
  MatrixXd jacobian(6, num_velocities(body));
  Coordinates row, reals;
  btAlignedObjectArray<btVector3> vectors;
  btAlignedObjectArray<btMatrix3x3> matrices;
  row.resize(static_cast<int>(jacobian.cols()));
  for (int k = 0; k < 6; ++k) {
    const btVector3 unit = to_bullet(Vector3(Vector3::Unit(k % 3))), zero(0, 0, 0);
    body.fillConstraintJacobianMultiDof(link.m_link, link.getWorldTransform().getOrigin(), k < 3 ? zero : unit,
                                        k < 3 ? unit : zero, &row[0], reals, vectors, matrices);
    jacobian.row(k) = to_doubles(&row[0], jacobian.cols()).transpose();
  }
  return jacobian;
}

// As Bullet asks before it makes accelerations of a multibody, without which it knows of no mobility.
bool is_awake(const btMultiBody& body) {
  const auto sleeps = [](const btMultiBodyLinkCollider* collider) {
    return collider && collider->getActivationState() == ISLAND_SLEEPING;
  };
  if (sleeps(body.getBaseCollider())) return false;
  for (int k = 0; k < body.getNumLinks(); ++k)
    if (sleeps(body.getLink(k).m_collider)) return false;
  return true;
}

const btMultiBodyLinkCollider& link_of(const TouchedRigidBody& touched) {
  return *btMultiBodyLinkCollider::upcast(touched.object);
}

// Of links that lie at these places.
std::shared_ptr<Articulation> articulation_of(std::span<const btMultiBodyLinkCollider* const> links,
                                              std::vector<int> places) {
  const btMultiBody& body = *links.front()->m_multiBody;
  MatrixXd jacobian(6 * static_cast<Eigen::Index>(links.size()), num_velocities(body));
  for (std::size_t k = 0; k < links.size(); ++k)
    jacobian.middleRows<6>(6 * static_cast<Eigen::Index>(k)) = jacobian_of(*links[k]);
  MatrixXd responses(jacobian.cols(), jacobian.rows());
  for (Eigen::Index k = 0; k < jacobian.rows(); ++k) responses.col(k) = response(body, jacobian.row(k).transpose());
  const MatrixXd product = jacobian * responses;
  auto result = std::make_shared<Articulation>();
  result->places = std::move(places);
  result->mobility = (product + product.transpose()) / 2;
  if (!result->mobility.allFinite() || !(result->mobility.trace() > 0)) return nullptr;
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  decomposition.setThreshold(singular_mobility);
  result->inertia = decomposition.compute(result->mobility).pseudoInverse();
  return result;
}

}  // namespace

std::array<Vector3, 2> link_velocities(const btCollisionObject& object) {
  std::array<Vector3, 2> velocities{Vector3::Zero(), Vector3::Zero()};
  const btMultiBodyLinkCollider* link = btMultiBodyLinkCollider::upcast(&object);
  if (!link || !link->m_multiBody) return velocities;
  const VectorXd both = jacobian_of(*link) * velocities_of(*link->m_multiBody);
  if (both.allFinite()) velocities = {both.head<3>(), both.tail<3>()};
  return velocities;
}

bool is_movable_link(const btCollisionObject& object) {
  const btMultiBodyLinkCollider* link = btMultiBodyLinkCollider::upcast(&object);
  return link && link->m_multiBody && is_awake(*link->m_multiBody) &&
         !(link->m_link < 0 ? link->m_multiBody->isBaseStaticOrKinematic()
                            : link->m_multiBody->isLinkAndAllAncestorsStaticOrKinematic(link->m_link));
}

bool are_of_one_multibody(const btCollisionObject& a, const btCollisionObject& b) {
  const auto *one = btMultiBodyLinkCollider::upcast(&a), *other = btMultiBodyLinkCollider::upcast(&b);
  return one && other && one->m_multiBody == other->m_multiBody;
}

void Links::wake(btCollisionObject& object) {
  btMultiBodyLinkCollider* link = btMultiBodyLinkCollider::upcast(&object);
  if (!link || !link->m_multiBody || is_awake(*link->m_multiBody)) return;
  btMultiBody& body = *link->m_multiBody;
  body.wakeUp();
  if (body.getBaseCollider()) body.getBaseCollider()->activate();
  for (int k = 0; k < body.getNumLinks(); ++k)
    if (body.getLink(k).m_collider) body.getLink(k).m_collider->activate();
}

void Links::begin_step(int step) {
  step_ = step;
  std::erase_if(memories_, [step](const auto& entry) { return entry.second.step < step - 1; });
}

void Links::read(TouchedRigidBody& touched, Real duration) const {
  const btMultiBodyLinkCollider* link = btMultiBodyLinkCollider::upcast(touched.object);
  if (!link || !link->m_multiBody) return;
  RigidBody& start = touched.start;
  const MatrixXd jacobian = jacobian_of(*link);
  const VectorXd now = velocities_of(*link->m_multiBody);
  VectorXd velocities = now, accelerations = VectorXd::Zero(now.size());
  if (is_movable_link(*link)) touched.articulation = articulation_of(std::array{link}, {0});
  if (touched.articulation) {
    start.articulation = touched.articulation.get();
    const auto found = memories_.find(link->m_multiBody);
    if (found != memories_.end() && found->second.step == step_ - 1 && found->second.end.size() == now.size()) {
      const Memory& last = found->second;
      // Since the last step: what the world has done already, and what others then did and will do again. That is limited,
      // so that an impact is not repeated.
      const VectorXd by_world = now - last.end, most = by_world.cwiseAbs() + last.given.cwiseAbs(),
                     by_others = (last.end - last.handed_back).cwiseMax(-most).cwiseMin(most);
      velocities = last.end;
      accelerations = (by_world + by_others) / duration;
    }
  }
  const VectorXd motion = jacobian * velocities, change = jacobian * accelerations;
  if (!motion.allFinite() || !change.allFinite()) return;
  start.velocity = motion.head<3>();
  start.angular_velocity = motion.tail<3>();
  start.acceleration = change.head<3>();
  start.angular_acceleration = change.tail<3>();
}

void Links::couple(std::span<TouchedRigidBody> touched) {
  std::map<int, std::vector<int>> groups;  // by the first of each
  for (int k = 0; k < static_cast<int>(touched.size()); ++k) {
    if (!touched[k].articulation) continue;
    int first = 0;
    while (!touched[first].articulation || !are_of_one_multibody(*touched[first].object, *touched[k].object)) ++first;
    groups[first].push_back(k);
  }
  for (const auto& [first, places] : groups) {
    if (places.size() == 1) {
      touched[first].articulation->places = places;
      continue;
    }
    std::vector<const btMultiBodyLinkCollider*> links;
    for (const int place : places) links.push_back(&link_of(touched[place]));
    const std::shared_ptr<Articulation> all = articulation_of(links, places);
    for (std::size_t k = 0; k < places.size(); ++k) {
      TouchedRigidBody& one = touched[places[k]];
      one.articulation = all;
      one.start.articulation = all.get();
      one.start.link = static_cast<int>(k);
    }
  }
}

void Links::hand_back(std::span<const TouchedRigidBody> touched) {
  std::map<btMultiBody*, VectorXd> impulses;
  for (const TouchedRigidBody& t : touched) {
    if (!t.articulation) continue;
    const btMultiBodyLinkCollider& link = link_of(t);
    Eigen::Matrix<Real, 6, 1> wrench;
    wrench << t.state.impulse, t.state.angular_impulse;
    VectorXd& sum =
        impulses.try_emplace(link.m_multiBody, VectorXd::Zero(num_velocities(*link.m_multiBody))).first->second;
    sum += jacobian_of(link).transpose() * wrench;
  }
  for (const auto& [body, impulse] : impulses) {
    const VectorXd change = response(*body, impulse);
    if (!change.allFinite()) continue;
    Coordinates given;
    given.resize(static_cast<int>(change.size()));
    for (int k = 0; k < given.size(); ++k) given[k] = static_cast<btScalar>(change[k]);
    body->applyDeltaVeeMultiDof(&given[0], 1);
    const VectorXd after = velocities_of(*body);
    memories_[body] = {step_, change, after, after};
  }
}

void Links::observe(const TouchedRigidBody& touched) {
  const btMultiBody* body = link_of(touched).m_multiBody;
  if (const auto found = memories_.find(body); found != memories_.end()) found->second.end = velocities_of(*body);
}

}  // namespace penalty
