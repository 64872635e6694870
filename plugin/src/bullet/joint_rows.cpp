#include "joint_rows.h"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "convert.h"
#include "rigid_bodies.h"

namespace penalty {
namespace {

constexpr Real bullet_infinity = 1e18;  // Bullet has no infinity, but largest numbers
constexpr Real row_round_off = 1e-5;    // of what is the same but for its sign
constexpr Real line_gap = 1e-3,
               line_bend = 0.05;  // by which a joint may be apart, and its lines still be one line [m], of arms

// A row as Bullet wants it laid out.
struct BulletRow {
  btVector3 linear_a, angular_a, linear_b, angular_b;
  btScalar error, softness, least, most;

  bool is_soft() const { return softness > 0; }
  bool has_most() const { return Real(most) < bullet_infinity; }
  bool has_least() const { return Real(least) > -bullet_infinity; }
  /// One that pulls with a known force pulls one way; a motor may turn both ways.
  bool is_force() const {
    return has_least() && has_most() && std::abs(least + most) > row_round_off * (std::abs(least) + std::abs(most));
  }
};
using BulletRows = std::array<BulletRow, Joint::most_rows>;

// `rate` is one over the time in which errors of position are to go, but for what erp says of that.
void ask(btTypedConstraint& constraint, int count, Real rate, btScalar erp, const btContactSolverInfo& how,
         BulletRows& rows) {
  constexpr btScalar most = SIMD_INFINITY;
  const btVector3 none(0, 0, 0);
  for (int k = 0; k < count; ++k) rows[k] = {none, none, none, none, 0, how.m_globalCfm, -most, most};
  btTypedConstraint::btConstraintInfo2 info;
  info.fps = static_cast<btScalar>(rate);
  info.erp = erp;
  info.m_J1linearAxis = rows[0].linear_a;
  info.m_J1angularAxis = rows[0].angular_a;
  info.m_J2linearAxis = rows[0].linear_b;
  info.m_J2angularAxis = rows[0].angular_b;
  info.rowskip = sizeof(BulletRow) / sizeof(btScalar);
  info.m_constraintError = &rows[0].error;
  info.cfm = &rows[0].softness;
  info.m_lowerLimit = &rows[0].least;
  info.m_upperLimit = &rows[0].most;
  info.m_numIterations = how.m_numIterations;
  info.m_damping = how.m_damping;
  constraint.getInfo2(&info);
}

// Where a joint is apart by a hair, its two lines are not one, and impulses along them would turn the pair.
void make_one_line(JointRow& row, const Vector3& from_b_to_a) {
  if (row.linear_a.isZero(0) || row.linear_a != -row.linear_b) return;
  const Vector3 turn = from_b_to_a.cross(row.linear_a) + row.angular_a + row.angular_b;
  if (turn.norm() > line_gap + line_bend * (row.angular_a.norm() + row.angular_b.norm())) return;
  row.angular_a -= turn / 2;
  row.angular_b -= turn / 2;
}

// Velocities before forces acted last: what they make of rest is no motion that a damper is to brake, or a stop to
// throw back.
Vector3 velocity_before(const RigidBody& body, Real since) { return body.velocity - since * body.acceleration; }
Vector3 angular_velocity_before(const RigidBody& body, Real since) {
  return body.angular_velocity - since * body.angular_acceleration;
}

struct Ends {
  const RigidBody *a, *b;  // null: the world

  template <class Of>
  Real sum(const JointRow& row, const Of& of) const {
    return (a ? of(*a, row.linear_a, row.angular_a) : 0) + (b ? of(*b, row.linear_b, row.angular_b) : 0);
  }
  /// Of unit velocities along the row.
  Real speed_along(const BulletRow& row) const {
    return Real((a ? row.linear_a.length2() + row.angular_a.length2() : 0) +
                (b ? row.linear_b.length2() + row.angular_b.length2() : 0));
  }
  Real mobility(const JointRow& row) const {
    return sum(row, [](const RigidBody& body, const Vector3& linear, const Vector3& angular) {
      return linear.dot(body.inverse_mass.cwiseProduct(linear)) + angular.dot(body.inverse_inertia * angular);
    });
  }
};

// Velocities of both bodies of a joint, for as long as this lives.
class MovedEnds {
 public:
  MovedEnds(btTypedConstraint& constraint)
      : a_(constraint.getRigidBodyA()),
        b_(constraint.getRigidBodyB()),
        before_{a_.getLinearVelocity(), a_.getAngularVelocity(), b_.getLinearVelocity(), b_.getAngularVelocity()} {}
  MovedEnds(const MovedEnds&) = delete;
  MovedEnds& operator=(const MovedEnds&) = delete;
  ~MovedEnds() { set(before_); }

  void set(const std::array<btVector3, 4>& velocities) {
    a_.setLinearVelocity(velocities[0]);
    a_.setAngularVelocity(velocities[1]);
    b_.setLinearVelocity(velocities[2]);
    b_.setAngularVelocity(velocities[3]);
  }

 private:
  btRigidBody &a_, &b_;
  std::array<btVector3, 4> before_;
};

struct Spring {
  Real force, damping;  // of the spring now [N, N m], of its damper per speed along the row
};

// Limits of a spring and its damper are the damper's impulse in a time of h and the sum of both: the spring's alone where
// nothing moves, and the damper's is the other one where it acts against the spring. Those of a motor are the same both
// ways, whatever moves.
std::optional<Spring> spring_of(btTypedConstraint& constraint, int count, int number, const BulletRow& asked,
                                const Ends& ends, Real h, const btContactSolverInfo& how) {
  if (!asked.has_least() || !asked.has_most()) return std::nullopt;
  const btVector3 none(0, 0, 0);
  MovedEnds moved(constraint);
  BulletRows tried;
  moved.set({none, none, none, none});
  ask(constraint, count, 1 / h, 1, how, tried);
  const bool is_spring = tried[number].is_force();
  const Real impulse = is_spring ? Real(tried[number].least) + Real(tried[number].most) : 0;
  const btScalar way = impulse < 0 ? -1 : 1;
  moved.set({ends.a ? way * asked.linear_a : none, ends.a ? way * asked.angular_a : none,
             ends.b ? way * asked.linear_b : none, ends.b ? way * asked.angular_b : none});
  ask(constraint, count, 1 / h, 1, how, tried);
  const BulletRow& damped = tried[number];
  if (!is_spring && !damped.is_force()) return std::nullopt;
  return Spring{impulse / h, Real(impulse < 0 ? damped.most : -damped.least) / (h * ends.speed_along(asked))};
}

}  // namespace

int count_rows(btTypedConstraint& constraint) {
  btTypedConstraint::btConstraintInfo1 info;
  constraint.getInfo1(&info);
  return info.m_numConstraintRows <= Joint::most_rows ? info.m_numConstraintRows : -1;
}

JointRows::JointRows(std::span<const HeldJoint> joints, std::span<const TouchedRigidBody> touched,
                     const btContactSolverInfo& info, Real duration)
    : joints_(joints), info_(info), duration_(duration) {
  for (const HeldJoint& held : joints) {
    held.constraint->buildJacobian();
    for (const int number : {held.a, held.b}) {
      if (number < 0 || std::any_of(lent_.begin(), lent_.end(), [&](const Lent& l) { return l.number == number; }))
        continue;
      btRigidBody* body = touched[number].body;
      lent_.push_back({body, number, body->getWorldTransform(), body->getLinearVelocity(), body->getAngularVelocity()});
    }
  }
}

JointRows::~JointRows() {
  for (const Lent& lent : lent_) {
    lent.body->setWorldTransform(lent.transform);
    lent.body->setLinearVelocity(lent.velocity);
    lent.body->setAngularVelocity(lent.angular_velocity);
  }
}

void JointRows::add_rows(std::span<const RigidBody> bodies, Real h, Real since, std::vector<JointRow>& rows) {
  for (const Lent& lent : lent_) {
    const RigidBody& state = bodies[lent.number];
    btMatrix3x3 basis;
    for (int row = 0; row < 3; ++row) basis[row] = to_bullet(Vector3(state.rotation.row(row)));
    lent.body->setWorldTransform(btTransform(basis, to_bullet(state.position)));
    lent.body->setLinearVelocity(to_bullet(velocity_before(state, since)));
    lent.body->setAngularVelocity(to_bullet(angular_velocity_before(state, since)));
  }
  for (std::size_t k = 0; k < joints_.size(); ++k) add_rows_of(static_cast<int>(k), bodies, h, since, rows);
}

// Limits are impulses of a world step, of which the substep has its share. Where there are none, errors are taken back in
// one drift: what Bullet says for two rates tells them from speeds. What is soft, and what has limits, is to be as it is
// with Bullet, whose erp and cfm speak of world steps. Springs speak of forces, which are those of now; dampers of the
// velocity that there will be, however strong they are:  impulse = since (force of the spring - d u).
void JointRows::add_rows_of(int number, std::span<const RigidBody> bodies, Real h, Real since,
                            std::vector<JointRow>& rows) {
  const HeldJoint& held = joints_[number];
  btTypedConstraint& constraint = *held.constraint;
  const int count = count_rows(constraint);
  if (count <= 0) return;
  BulletRows now, sooner, as_bullet;
  ask(constraint, count, 1 / h, 1, info_, now);
  ask(constraint, count, 2 / h, 1, info_, sooner);
  ask(constraint, count, 1 / duration_, info_.m_erp, info_, as_bullet);
  const Ends ends{held.a < 0 ? nullptr : &bodies[held.a], held.b < 0 ? nullptr : &bodies[held.b]};
  const Vector3 from_b_to_a = ends.a && ends.b ? Vector3(ends.a->position - ends.b->position) : Vector3::Zero();
  for (int k = 0; k < count; ++k) {
    const BulletRow& asked = now[k];
    JointRow row{.joint = number,
                 .number = k,
                 .linear_a = to_vector(asked.linear_a),
                 .angular_a = to_vector(asked.angular_a),
                 .linear_b = to_vector(asked.linear_b),
                 .angular_b = to_vector(asked.angular_b)};
    if (ends.a && ends.b) make_one_line(row, from_b_to_a);
    if (const auto spring = spring_of(constraint, count, k, asked, ends, h, info_)) {
      if (since > 0 && spring->damping > 0) {
        row.softness = 1 / (since * spring->damping);
        row.wanted = spring->force / spring->damping;
      } else {
        row.least = row.most = since * spring->force;
      }
    } else if (asked.is_soft() || (asked.has_least() && asked.has_most())) {
      const BulletRow& in_step = as_bullet[k];
      const Real share = since / duration_;
      row.wanted = Real(in_step.error);
      if (in_step.has_least()) row.least = share * Real(in_step.least);
      if (in_step.has_most()) row.most = share * Real(in_step.most);
      if (asked.is_soft() && share > 0) row.softness = Real(in_step.softness) * ends.mobility(row) / share;
      if (asked.is_soft() && share == 0) row.least = row.most = 0;
    } else {
      row.recovery = Real(sooner[k].error) - Real(asked.error);
      row.wanted = Real(asked.error) - row.recovery;
      if (asked.has_least()) row.least = since / h * Real(asked.least);
      if (asked.has_most()) row.most = since / h * Real(asked.most);
    }
    rows.push_back(row);
  }
}

}  // namespace penalty
