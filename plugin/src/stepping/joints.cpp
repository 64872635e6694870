#include "joints.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact_rules.h"

namespace penalty {
namespace {

constexpr Real most_work = 1e6, usual_rows = 6;  // multiplications that a matrix is worth; of a joint
constexpr Real least_pivot = 1e-10;              // share of the mobility
constexpr Real redundant = 1e-4;                 // share of the mobility that others leave to a row that says the same
constexpr Real row_compliance = 1e-9;     // of two-sided rows, relative to the mobility: there may be more than needed
constexpr Real held_share = 1e-7;         // share of the mobility below which the two-sided rows hold a limited one
constexpr Real largest_turn = 0.02;       // in a substep [rad]
constexpr int fewest_joint_substeps = 8;  // with joints
constexpr int most_joint_substeps = 200;  // because of them
constexpr Real nothing_known = std::numeric_limits<Real>::infinity();
constexpr Real broken_share = 1 - 1e-9;  // share of the strength

// Radius about which the mass of a body lies, so that its turning can be told in m/s.
Real radius_of(const RigidBody& body) {
  const Real inertia = body.inverse_inertia.trace(), mass = body.inverse_mass.sum();
  return inertia > 0 && mass > 0 ? std::sqrt(mass / inertia) : 1;
}

}  // namespace

Joints::Joints(Island& island) : island_(island) {
  if (is_empty()) return;
  for (const Joint& joint : island.joints) {
    start_.push_back(joint.forces);
    start_rows_.push_back(joint.num_rows);
  }
  left_.resize(island.joints.size());
  make_blocks();
}

int Joints::least_substeps(const Island& island, Real duration) {
  if (island.joints.empty()) return 1;
  Real fastest = 0;
  for (const Joint& joint : island.joints)
    for (const int body : {joint.a, joint.b})
      if (body >= 0) fastest = std::max(fastest, island.rigid_bodies[body].angular_velocity.norm());
  const Real wanted = std::ceil(fastest * duration / largest_turn);
  return static_cast<int>(std::clamp<Real>(wanted, fewest_joint_substeps, most_joint_substeps));
}

// Joints that share a body that moves, or are joined by others, are in one block: from one end of it to the other.
void Joints::make_blocks() {
  const std::size_t count = island_.joints.size();
  places_.resize(count);
  std::vector<std::vector<int>> joints_of(island_.rigid_bodies.size());
  const auto for_each_moving_body = [this](int joint, const auto& call) {
    for (const int body : {island_.joints[joint].a, island_.joints[joint].b})
      if (body >= 0 && island_.rigid_bodies[body].is_dynamic()) call(body);
  };
  for (std::size_t k = 0; k < count; ++k)
    for_each_moving_body(static_cast<int>(k), [&](int body) { joints_of[body].push_back(static_cast<int>(k)); });
  std::vector<int> seen_in(count, -1);  // which search
  int searches = 0;
  const auto breadth_first = [&](int start) {
    std::vector<int> found{start};
    seen_in[start] = searches;
    for (std::size_t i = 0; i < found.size(); ++i)
      for_each_moving_body(found[i], [&](int body) {
        for (const int other : joints_of[body])
          if (std::exchange(seen_in[other], searches) != searches) found.push_back(other);
      });
    ++searches;
    return found;
  };
  for (std::size_t k = 0; k < count; ++k) {
    bool moves = false;
    for_each_moving_body(static_cast<int>(k), [&](int) { moves = true; });
    if (!moves || places_[k].block >= 0) continue;
    std::vector<int> order = breadth_first(breadth_first(static_cast<int>(k)).back());
    std::reverse(order.begin(), order.end());
    for (std::size_t i = 0; i < order.size(); ++i)
      places_[order[i]].place = places_[order[i]].first = static_cast<int>(i);
    Real work = 0;
    for (const int joint : order) {
      Place& place = places_[joint];
      for_each_moving_body(joint, [&](int body) {
        for (const int other : joints_of[body]) place.first = std::min(place.first, places_[other].place);
      });
      const Real width = usual_rows * (place.place - place.first + 1);
      work += usual_rows * width * width;
    }
    const int size = static_cast<int>(order.size());
    if (work <= most_work)
      add_block(order, size);
    else
      for (const int joint : order) add_block({joint}, size);
  }
}

void Joints::add_block(const std::vector<int>& joints, int connected) {
  for (const int joint : joints) places_[joint].block = static_cast<int>(blocks_.size());
  blocks_.emplace_back(Block{.joints = connected});
}

void Joints::begin_attempt() {
  outside_work_ = 0;
  for (std::size_t k = 0; k < island_.joints.size(); ++k) {
    Joint& joint = island_.joints[k];
    joint.forces = start_[k];
    joint.num_rows = start_rows_[k];
    left_[k].fill(nothing_known);
    joint.asks = joint.is_broken = false;
    joint.given.fill(0);
    for (Vector3* sum : {&joint.impulse_a, &joint.moment_a, &joint.impulse_b, &joint.moment_b}) sum->setZero();
  }
}

void Joints::begin(Real h, Real since, bool drifts) {
  if (is_empty()) return;
  asked_.clear();
  rows_.clear();
  island_.joint_source->add_rows(island_.rigid_bodies, h, since, asked_);
  for (Block& block : blocks_) {
    block.two_sided.clear();
    block.limited.clear();
  }
  for (std::size_t k = 0; k < asked_.size();) {
    std::size_t end = k;
    Real bend = 0;
    for (; end < asked_.size() && asked_[end].joint == asked_[k].joint; ++end)
      bend = std::max(bend, bend_of(asked_[end]));
    for (; k < end; ++k) add_row(asked_[k], h, drifts, h * bend);
  }
  for (Block& block : blocks_) factor(block);
  start(since);
}

// As many rows as in the last substep are the same rows. What redundant rows give against each other may be large and
// cancels only while the bodies have not turned: these begin from nothing.
void Joints::start(Real since) {
  std::size_t row = 0;
  for (std::size_t k = 0; k < island_.joints.size(); ++k) {
    Joint& joint = island_.joints[k];
    std::size_t end = row;
    while (end < rows_.size() && rows_[end].joint == static_cast<int>(k)) ++end;
    const int count = end > row ? rows_[end - 1].number + 1 : 0;
    const bool is_same = count == joint.num_rows;
    const bool is_redundant = places_[k].block >= 0 && blocks_[places_[k].block].is_redundant;
    for (; row < end; ++row) {
      const bool is_known = is_same && !(rows_[row].is_two_sided() && is_redundant);
      const Real known = is_known ? since * joint.forces[rows_[row].number] : 0;
      push(rows_[row], std::clamp(known, rows_[row].least, rows_[row].most));
    }
    if (!is_same) left_[k].fill(nothing_known);
    joint.num_rows = count;
    joint.asks = joint.asks || count > 0;
  }
}

// How fast, in a time, the speed of a point of the joint turns away from its line [m/s²].
Real Joints::bend_of(const JointRow& asked) const {
  const Joint& joint = island_.joints[asked.joint];
  Real bend = 0;
  for (const auto& [number, arm] : {std::pair(joint.a, &asked.angular_a), std::pair(joint.b, &asked.angular_b)})
    if (number >= 0) bend += island_.rigid_bodies[number].angular_velocity.squaredNorm() * arm->norm();
  return bend;
}

// Errors that no turn of the bodies made may be large: they come back slowly, in many joints the more so, as their bodies
// gather the speeds of all. What the last turn made goes in one drift; a chain that was taken over torn apart would feed its
// turning with what is left of that. `bends`: the speed that turns give back in a drift. A stop that is still open lets its
// way be gone, however long that is.
void Joints::limit_recovery(Row& row, Real h, bool drifts, Real bends) {
  Real& left = left_[row.joint][row.number];  // after the last drift [m]
  const Real asked = row.recovery, slowest = recovery_speed / blocks_[places_[row.joint].block].joints / row.lever;
  const Real fastest = drifts ? slowest + bends / row.lever : 0;
  if (!row.is_two_sided() || !drifts) {
    if (row.least < 0) row.recovery = std::max(row.recovery, -fastest);
    if (row.most > 0) row.recovery = std::min(row.recovery, fastest);
    return;
  }
  const Real made = std::isfinite(left) ? std::clamp(asked - left / h, -bends / row.lever, bends / row.lever) : 0;
  row.recovery = std::clamp(asked - made, -slowest, slowest) + made;
  left = h * (asked - row.recovery);
}

void Joints::add_row(const JointRow& asked, Real h, bool drifts, Real bends) {
  const Joint& joint = island_.joints[asked.joint];
  const int block = places_[asked.joint].block;
  if (joint.is_broken || block < 0) return;
  Row row;
  static_cast<JointRow&>(row) = asked;
  Real smallest = std::numeric_limits<Real>::infinity();
  const auto meet_body = [&](int number, const Vector3& linear, const Vector3& angular, RigidBody*& body,
                             Vector3& velocity, Vector3& turn) {
    velocity.setZero();
    turn.setZero();
    if (number < 0) return;
    RigidBody& rigid = island_.rigid_bodies[number];
    if (!rigid.is_dynamic()) {
      row.still += linear.dot(rigid.velocity) + angular.dot(rigid.angular_velocity);
      return;
    }
    body = &rigid;
    velocity = rigid.inverse_mass.cwiseProduct(linear);
    turn = rigid.inverse_inertia * angular;
    row.mobility += linear.dot(velocity) + angular.dot(turn);
    smallest = std::min(smallest, radius_of(rigid));
  };
  meet_body(joint.a, row.linear_a, row.angular_a, row.a, row.velocity_a, row.turn_a);
  meet_body(joint.b, row.linear_b, row.angular_b, row.b, row.velocity_b, row.turn_b);
  if (!(row.mobility > 0)) return;
  if (row.linear_a.isZero(0) && row.linear_b.isZero(0)) row.lever = smallest;
  limit_recovery(row, h, drifts, bends);
  if (joint.strength < JointRow::unlimited) {
    const Real given = joint.given[row.number];
    row.least = std::clamp(row.least, -joint.strength - given, joint.strength - given);
    row.most = std::clamp(row.most, -joint.strength - given, joint.strength - given);
  }
  Block& of_joint = blocks_[block];
  (row.is_two_sided() ? of_joint.two_sided : of_joint.limited).push_back(rows_.size());
  rows_.push_back(row);
}

Real Joints::speed(const Row& row) const {
  Real speed = row.still;
  if (row.a) speed += row.linear_a.dot(row.a->velocity) + row.angular_a.dot(row.a->angular_velocity);
  if (row.b) speed += row.linear_b.dot(row.b->velocity) + row.angular_b.dot(row.b->angular_velocity);
  return speed;
}

// Of the speed of one by a unit impulse of the other.
Real Joints::coupling(const Row& one, const Row& two) {
  Real sum = 0;
  const auto add = [&](const RigidBody* body, const Vector3& linear, const Vector3& angular) {
    if (!body) return;
    if (body == two.a) sum += linear.dot(two.velocity_a) + angular.dot(two.turn_a);
    if (body == two.b) sum += linear.dot(two.velocity_b) + angular.dot(two.turn_b);
  };
  add(one.a, one.linear_a, one.angular_a);
  add(one.b, one.linear_b, one.angular_b);
  return sum;
}

void Joints::push(Row& row, Real impulse) {
  if (impulse == 0) return;
  if (row.a) row.a->give(impulse * row.linear_a, impulse * row.angular_a);
  if (row.b) row.b->give(impulse * row.linear_b, impulse * row.angular_b);
  row.impulse += impulse;
}

void Joints::factor(Block& block) {
  std::vector<std::size_t>& rows = block.two_sided;
  const auto place_of = [this](std::size_t row) -> const Place& { return places_[rows_[row].joint]; };
  std::sort(rows.begin(), rows.end(), [&](std::size_t k, std::size_t l) {
    return std::pair(place_of(k).place, k) < std::pair(place_of(l).place, l);
  });
  block.answers.clear();
  block.matrix.clear();
  block.asked.resize(static_cast<Eigen::Index>(rows.size()));
  block.impulses.resize(block.asked.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows_[rows[i]];
    const auto first =
        static_cast<std::size_t>(std::lower_bound(rows.begin(), rows.end(), place_of(rows[i]).first,
                                                  [&](std::size_t k, int place) { return place_of(k).place < place; }) -
                                 rows.begin());
    block.matrix.add_row(static_cast<Eigen::Index>(first));
    const auto at = [&](std::size_t j) -> Real& {
      return block.matrix.at(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    };
    for (std::size_t j = first; j < i; ++j) at(j) = coupling(row, rows_[rows[j]]);
    at(i) = (1 + row_compliance) * row.mobility + row.softness;
  }
  block.is_redundant = block.matrix.factor(least_pivot) < redundant;
}

// What the two-sided rows give when this one gives a unit impulse.
void Joints::answer(Block& block, Row& row) {
  row.free_mobility = row.mobility;
  row.answer = block.answers.size();
  if (block.two_sided.empty()) return;
  for (std::size_t i = 0; i < block.two_sided.size(); ++i)
    block.asked[static_cast<Eigen::Index>(i)] = -coupling(rows_[block.two_sided[i]], row);
  block.impulses = block.asked;
  block.matrix.solve(block.impulses);
  row.free_mobility -= block.asked.dot(block.impulses);
  block.answers.insert(block.answers.end(), block.impulses.begin(), block.impulses.end());
  if (!(row.free_mobility > held_share * row.mobility)) row.free_mobility = 0;
}

Real Joints::sweep() {
  Real largest = 0;
  for (Block& block : blocks_) {
    largest = std::max(largest, meet(block));
    for (const std::size_t k : block.limited)
      if (Row& row = rows_[k]; !row.is_force()) largest = std::max(largest, clip(block, row));
  }
  return largest;
}

Real Joints::meet(Block& block) {
  if (block.two_sided.empty()) return 0;
  Real largest = 0;
  for (std::size_t i = 0; i < block.two_sided.size(); ++i) {
    const Row& row = rows_[block.two_sided[i]];
    const Real asked = row.wanted + row.recovery - row.softness * row.impulse - speed(row);
    largest = std::max(largest, std::abs(asked) * row.lever);
    block.asked[static_cast<Eigen::Index>(i)] = asked;
  }
  block.impulses = block.asked;
  block.matrix.solve(block.impulses);
  for (std::size_t i = 0; i < block.two_sided.size(); ++i)
    push(rows_[block.two_sided[i]], block.impulses[static_cast<Eigen::Index>(i)]);
  return largest;
}

Real Joints::clip(Block& block, Row& row) {
  const Real asked = row.wanted + row.recovery - row.softness * row.impulse - speed(row);
  if ((asked <= 0 && row.impulse <= row.least) || (asked >= 0 && row.impulse >= row.most)) return 0;
  if (row.free_mobility < 0) answer(block, row);
  if (row.free_mobility == 0) return 0;
  const Real impulse = std::clamp(row.impulse + asked / (row.free_mobility + row.softness), row.least, row.most);
  const Real change = impulse - row.impulse;
  if (change == 0) return 0;
  push(row, change);
  for (std::size_t i = 0; i < block.two_sided.size(); ++i)
    push(rows_[block.two_sided[i]], change * block.answers[row.answer + i]);
  return std::abs(change) * row.free_mobility * row.lever;
}

// An impulse works with the mean of the speeds before and after it, and bodies lose what differs: no row gives more than
// it does at the speed after.
void Joints::end(Real since) {
  for (const Row& row : rows_) {
    Joint& joint = island_.joints[row.joint];
    outside_work_ += row.impulse * (speed(row) - row.still);
    joint.given[row.number] += row.impulse;
    joint.impulse_a += row.impulse * row.linear_a;
    joint.moment_a += row.impulse * row.angular_a;
    joint.impulse_b += row.impulse * row.linear_b;
    joint.moment_b += row.impulse * row.angular_b;
    if (since > 0) joint.forces[row.number] = row.impulse / since;
    if (std::abs(joint.given[row.number]) >= broken_share * joint.strength) joint.is_broken = true;
  }
}

}  // namespace penalty
