// Couplings, rigid bodies, and what applications do to nodes.
#include <algorithm>
#include <cmath>

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/ConstraintSolver/btSliderConstraint.h>

#include "fuzz/sequence.h"

namespace penalty::testing {
namespace {

btScalar scalar(Real value) { return static_cast<btScalar>(value); }

btVector3 vector(Real x, Real y, Real z) { return {scalar(x), scalar(y), scalar(z)}; }

}  // namespace

void Sequence::couple() {
  Body* first = pick_attached();
  if (!first || (legal() && !first->in_world())) return;
  Joint joint{first->home, 0, {}, {}};
  std::vector<CouplingPoint> points;
  std::vector<std::pair<const btSoftBody*, int>> taken;
  const int count = 2 + chance_.index(2);
  Eigen::Matrix3Xd rest(3, count);
  for (int i = 0; i < count; ++i) {
    rest.col(i) = Vector3(i * chance_.number(0.3, 1), chance_.number(0, 0.1), 0);
    Body* other = i == 0 ? first : pick_body();
    if (legal() && (!other->attached || !other->in_world() || other->home != first->home)) other = first;
    RigidObject* rigid = i > 0 && !rigid_.empty() && chance_.one_in(2) ? &chance_.pick(rigid_) : nullptr;
    if (rigid && rigid->home == first->home) {
      points.push_back(
          CouplingPoint::on(*rigid->body, {chance_.number(-1, 1), chance_.number(-1, 1), chance_.number(-1, 1)}));
      joint.rigid_bodies.push_back(rigid->body);
      continue;
    }
    const int nodes = other->soft->m_nodes.size();
    int node = chance_.index(nodes);
    if (legal())  // no point twice
      while (std::find(taken.begin(), taken.end(), std::pair<const btSoftBody*, int>(other->soft, node)) != taken.end())
        node = (node + 1) % nodes;
    else if (chance_.one_in(10))
      node = chance_.one_in(2) ? -1 : nodes;
    taken.emplace_back(other->soft, node);
    points.push_back(CouplingPoint::at_node(*other->soft, node));
    joint.soft_bodies.push_back(other->soft);
  }
  if (legal() && joint.rigid_bodies.size() > 1 && joint.rigid_bodies[0] == joint.rigid_bodies[1]) return;
  std::vector<Edge> edges;
  for (int i = 0; i + 1 < count; ++i) edges.push_back({i, i + 1});
  const bool made = attempt("couple", [&] {
    PotentialField field(rest);
    if (chance_.one_in(2))
      field.add<Length>(edges, chance_.number(1, 1e3));
    else
      field.add(Attachment::of_length(chance_.number(0.1, 1)), edges, chance_.number(1, 1e3));
    joint.number =
        joint.home->penalty().couple(points, std::move(field), chance_.one_in(2) ? 0 : chance_.number(0, 0.01));
  });
  if (!made) return;
  if (!legal())
    for (const auto& body : bodies_) body->ordinary = body->ordinary && body->home != joint.home;
  joints_.push_back(joint);
}

void Sequence::uncouple() {
  if (joints_.empty()) return;
  const int number = chance_.index(static_cast<int>(joints_.size()));
  const Joint joint = joints_[static_cast<std::size_t>(number)];
  joint.home->penalty().uncouple(joint.number);
  joints_.erase(joints_.begin() + number);
}

void Sequence::edit_coupling() {
  if (joints_.empty()) return;
  const Joint& joint = chance_.pick(joints_);
  attempt("edit_coupling", [&] { change_elements(chance_, joint.home->penalty().edit_coupling(joint.number)); });
}

// An anchor more, or fewer.
void Sequence::change_anchors() {
  Body* body = pick_body();
  if (!body) return;
  btSoftBody& soft = *body->soft;
  const int node = chance_.index(soft.m_nodes.size());
  const int manner = chance_.index(8);
  say("  manner " + std::to_string(manner) + ", node " + std::to_string(node));
  if (manner == 0) return soft.m_anchors.clear();
  if (manner == 1) return soft.m_deformableAnchors.clear();
  if (manner == 2) return soft.removeAnchor(node);
  if (rigid_.empty()) return;
  RigidObject& rigid = chance_.pick(rigid_);
  if (legal() && rigid.home != body->home) return;
  if (!legal()) body->ordinary = false;
  if (manner < 5) {  // Bullet's table of distances has no cells for what is nowhere
    if (soft.m_nodes[node].m_x.length2() < 1e6 && rigid.body->getWorldTransform().getOrigin().length2() < 1e6)
      soft.appendDeformableAnchor(node, rigid.body);
    return;
  }
  const bool apart = chance_.one_in(2);
  const btScalar influence = scalar(chance_.one_in(2) ? 1 : chance_.number(0, 1));
  if (manner == 5)
    soft.appendAnchor(node, rigid.body, vector(chance_.number(-1, 1), chance_.number(-1, 1), 0), apart, influence);
  else
    soft.appendAnchor(node, rigid.body, apart, influence);
}

void Sequence::add_rigid_body() {
  if (rigid_.size() > 5) return;
  Simulation& home = *chance_.pick(worlds_);
  std::unique_ptr<btCollisionShape> shape;
  bool flat = false;
  switch (chance_.index(5)) {
    case 0:
      shape = std::make_unique<btSphereShape>(scalar(chance_.uniform(0.1, 1)));
      break;
    case 1:
      shape = std::make_unique<btBoxShape>(
          vector(chance_.uniform(0.1, 2), chance_.uniform(0.1, 1), chance_.uniform(0.1, 1)));
      break;
    case 2:
      shape = std::make_unique<btCapsuleShape>(scalar(chance_.uniform(0.1, 0.5)), scalar(chance_.uniform(0.1, 1)));
      break;
    case 3:
      shape = std::make_unique<btCylinderShape>(vector(0.5, 0.5, 0.5));
      break;
    default:
      shape = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), scalar(chance_.uniform(-1, 0)));
      flat = true;
  }
  const Real mass = flat || chance_.one_in(3) ? 0 : chance_.uniform(0.1, 10);
  btRigidBody& body =
      home.add_rigid(std::move(shape), mass, {chance_.uniform(-1, 1), chance_.uniform(-2, 2), chance_.uniform(-1, 1)});
  if (mass == 0 && chance_.one_in(4))
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  rigid_.push_back({&home, &body});
}

void Sequence::remove_rigid_body() {
  if (rigid_.empty()) return;
  const int number = chance_.index(static_cast<int>(rigid_.size()));
  const RigidObject gone = rigid_[static_cast<std::size_t>(number)];
  // In a misuse couplings may be left that hold it.
  if (chance_.manner != Manner::misuse || chance_.one_in(2))
    std::erase_if(joints_, [&gone](const Joint& joint) {
      const auto& held = joint.rigid_bodies;
      const bool holds = std::find(held.begin(), held.end(), gone.body) != held.end();
      if (holds) joint.home->penalty().uncouple(joint.number);
      return holds;
    });
  // Anchors may stay: who is held by nothing is held where it is, until they are removed.
  if (chance_.one_in(2))
    for (const auto& body : bodies_) {
      btSoftBody& soft = *body->soft;
      for (int k = soft.m_anchors.size() - 1; k >= 0; --k)
        if (soft.m_anchors[k].m_body == gone.body) soft.m_anchors.removeAtIndex(k);
      for (int k = soft.m_deformableAnchors.size() - 1; k >= 0; --k)
        if (soft.m_deformableAnchors[k].m_cti.m_colObj == gone.body) soft.m_deformableAnchors.removeAtIndex(k);
    }
  remove_rigid_joints([&gone](const RigidJoint& joint) {
    return &joint.constraint->getRigidBodyA() == gone.body || &joint.constraint->getRigidBodyB() == gone.body;
  });
  gone.home->remove(*gone.body);
  rigid_.erase(rigid_.begin() + number);
}

// Of any two bodies that move, wherever they are, or of one and the world.
void Sequence::add_rigid_joint() {
  if (rigid_.empty() || rigid_joints_.size() > 5) return;
  const RigidObject &one = chance_.pick(rigid_), &other = chance_.pick(rigid_);
  if (one.home != other.home || one.body->isStaticOrKinematicObject()) return;
  const bool to_world = one.body == other.body;
  btTransform at_one = btTransform::getIdentity(), at_other = at_one;
  at_one.setOrigin(vector(chance_.uniform(-1, 1), chance_.uniform(-1, 1), 0));
  at_other.setOrigin(vector(0, chance_.uniform(-1, 1), chance_.uniform(-1, 1)));
  std::unique_ptr<btTypedConstraint> constraint;
  const int kind = chance_.index(4);
  say("  kind " + std::to_string(kind) + (to_world ? ", with the world" : ""));
  switch (kind) {
    case 0:
      constraint = to_world ? std::make_unique<btPoint2PointConstraint>(*one.body, at_one.getOrigin())
                            : std::make_unique<btPoint2PointConstraint>(*one.body, *other.body, at_one.getOrigin(),
                                                                        at_other.getOrigin());
      break;
    case 1: {
      auto hinge = to_world ? std::make_unique<btHingeConstraint>(*one.body, at_one)
                            : std::make_unique<btHingeConstraint>(*one.body, *other.body, at_one, at_other);
      if (chance_.one_in(2)) hinge->setLimit(scalar(chance_.number(-1, 0)), scalar(chance_.number(0, 1)));
      if (chance_.one_in(2))
        hinge->enableAngularMotor(true, scalar(chance_.number(-9, 9)), scalar(chance_.uniform(0, 9)));
      constraint = std::move(hinge);
      break;
    }
    case 2:
      constraint = to_world ? std::make_unique<btSliderConstraint>(*one.body, at_one, true)
                            : std::make_unique<btSliderConstraint>(*one.body, *other.body, at_one, at_other, true);
      break;
    default: {
      auto springs = to_world
                         ? std::make_unique<btGeneric6DofSpring2Constraint>(*one.body, at_one)
                         : std::make_unique<btGeneric6DofSpring2Constraint>(*one.body, *other.body, at_one, at_other);
      const int axis = chance_.index(6);
      springs->setLimit(axis, 1, -1);  // free
      springs->enableSpring(axis, true);
      springs->setStiffness(axis, scalar(chance_.uniform(0, 1000)));
      springs->setDamping(axis, scalar(chance_.uniform(0, 10)));
      constraint = std::move(springs);
    }
  }
  if (chance_.one_in(3)) constraint->setBreakingImpulseThreshold(scalar(chance_.uniform(0, 10)));
  one.home->world().addConstraint(constraint.get(), chance_.one_in(2));
  rigid_joints_.push_back({one.home, std::move(constraint)});
}

void Sequence::remove_rigid_joint() {
  if (rigid_joints_.empty()) return;
  const btTypedConstraint* gone = chance_.pick(rigid_joints_).constraint.get();
  remove_rigid_joints([gone](const RigidJoint& joint) { return joint.constraint.get() == gone; });
}

void Sequence::remove_rigid_joints(const std::function<bool(const RigidJoint&)>& which) {
  std::erase_if(rigid_joints_, [&which](const RigidJoint& joint) {
    if (!which(joint)) return false;
    joint.home->world().removeConstraint(joint.constraint.get());
    return true;
  });
}

void Sequence::change_rigid_body() {
  if (rigid_.empty()) return;
  btRigidBody& body = *chance_.pick(rigid_).body;
  switch (chance_.index(4)) {
    case 0:
      return body.setLinearVelocity(vector(chance_.number(-5, 5), 0, 0));
    case 1:
      return body.setAngularVelocity(vector(chance_.number(-5, 5), 1, 0));
    case 2: {
      btTransform transform = body.getWorldTransform();
      transform.setOrigin(vector(0, chance_.number(-2, 2), 0));
      return body.setWorldTransform(transform);
    }
    default:
      return body.setFriction(scalar(chance_.number(0, 2)));
  }
}

void Sequence::change_masses() {
  Body* body = pick_body();
  if (!body) return;
  if (chance_.one_in(3)) {
    const Real mass = chance_.number(0.1, 10);
    say("  in all " + std::to_string(mass));
    body->soft->setTotalMass(scalar(mass), !legal() && chance_.one_in(2));
    return;
  }
  const int node = chance_.index(body->soft->m_nodes.size());
  const Real mass = chance_.one_in(3) ? 0 : chance_.number(0.01, 1);
  say("  of node " + std::to_string(node) + ": " + std::to_string(mass));
  body->soft->setMass(node, scalar(mass));
}

void Sequence::move_nodes() {
  Body* body = pick_body();
  if (!body) return;
  btSoftBody& soft = *body->soft;
  const int node = chance_.index(soft.m_nodes.size());
  const Real a = chance_.number(-2, 2);
  const int manner = chance_.index(6);
  say("  manner " + std::to_string(manner) + ", by " + std::to_string(a));
  switch (manner) {
    case 0:
      soft.m_nodes[node].m_x.setY(scalar(a));
      break;
    case 1:
      soft.m_nodes[node].m_v.setX(scalar(10 * a));
      break;
    case 2:
      soft.translate(vector(a, 0, 0));
      break;
    case 3:
      soft.scale(vector(1 + 0.2 * a, 1 + 0.2 * a, 1));
      break;
    case 4:
      soft.rotate(btQuaternion(btVector3(0, 0, 1), scalar(a)));
      break;
    default:
      body->tangled = true;
      for (int i = 0; i < soft.m_nodes.size(); ++i)
        soft.m_nodes[i].m_x = soft.m_nodes[chance_.index(soft.m_nodes.size())].m_x;
  }
  if (!(std::abs(a) < 1e6)) body->stopped = true;
}

void Sequence::add_forces() {
  Body* body = pick_body();
  if (!body) return;
  if (chance_.one_in(2))
    body->soft->addForce(vector(0, chance_.number(-20, 20), 0));
  else
    body->soft->addForce(vector(chance_.number(-20, 20), 0, 0), chance_.index(body->soft->m_nodes.size()));
}

}  // namespace penalty::testing
