#include "anchors.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "contact_rules.h"
#include "particle_contacts.h"

namespace penalty {
namespace {

constexpr Real drift_share = 0.2;  // of the way to the anchor, that a drift takes back
constexpr Real compliance = 1e-6;  // relative to that of the rigid bodies

using Arm = Eigen::Matrix<Real, 3, 6>;

// From the velocities of a rigid body, linear and angular, to that of its point at `arm`.
Arm velocity_by_motion(const Vector3& arm) {
  Arm matrix;
  matrix << 1, 0, 0, 0, arm.z(), -arm.y(),  //
      0, 1, 0, -arm.z(), 0, arm.x(),        //
      0, 0, 1, arm.y(), -arm.x(), 0;
  return matrix;
}

using Six = Eigen::Matrix<Real, 6, 1>;

// Makes changes of velocities of what is an impulse and its moment.
void apply_mobility(const RigidBody& rigid, Eigen::Ref<Six> wrench) {
  const auto [dv, dw] = rigid.response(wrench.head<3>(), wrench.tail<3>());
  wrench << dv, dw;
}

auto key_of(const Anchor* anchor) {
  return std::tie(anchor->a.body, anchor->a.point.particles, anchor->a.point.weights);
}

}  // namespace

// Anchors of the same point stand together.
Anchors::Anchors(Island& island) : island_(island) {
  std::vector<const Anchor*> anchors;
  for (const Anchor& anchor : island.anchors) {
    const std::vector<Real>& inverse_masses = island.bodies[anchor.a.body]->particles.inverse_masses;
    if (anchor.a.point.mobility(inverse_masses) > 0 || island.rigid_bodies[anchor.b.rigid].is_dynamic())
      anchors.push_back(&anchor);  // else two that are held
  }
  std::stable_sort(anchors.begin(), anchors.end(),
                   [](const Anchor* a, const Anchor* b) { return key_of(a) < key_of(b); });
  for (std::size_t k = 0; k < anchors.size(); ++k) {
    const Anchor& anchor = *anchors[k];
    if (k == 0 || key_of(anchors[k - 1]) != key_of(&anchor))
      points_.push_back({.body = island.bodies[anchor.a.body], .point = &anchor.a.point, .first = k});
    points_.back().end = k + 1;
    rows_.push_back({.rigid = anchor.b.rigid, .anchor = anchor.b.anchor, .influence = anchor.influence});
  }
  for (Point& point : points_) weigh(point);
  make_blocks();
}

// Of points that share particles one may change what another needs: no less than all of them together.
Real Anchors::mobility_of(const Point& point) const {
  const std::vector<Real>& inverse_masses = point.body->particles.inverse_masses;
  Real sum = 0;
  for (const Point& other : points_) {
    if (other.body != point.body) continue;
    if (&other != &point && other.point->size == 1 && point.point->size == 1) continue;
    for (int i = 0; i < point.point->size; ++i)
      for (int j = 0; j < other.point->size; ++j)
        if (point.point->particles[i] == other.point->particles[j])
          sum +=
              std::abs(point.point->weights[i] * other.point->weights[j]) * inverse_masses[point.point->particles[i]];
  }
  return sum;
}

// With n rows, the mobility w of the point and the compliance e of each row: p = q / e - w / (e + n w) sum(q) / e, which
// for a single one is q / (e + w).
void Anchors::weigh(Point& point) const {
  const Real mobility = mobility_of(point), rows = static_cast<Real>(point.end - point.first);
  if (rows == 1 && mobility > 0) {
    point.own = 1 / mobility;
    return;
  }
  Real least = 0;  // of the rigid bodies
  for (std::size_t k = point.first; k < point.end; ++k) {
    const RigidBody& rigid = island_.rigid_bodies[rows_[k].rigid];
    if (!rigid.is_dynamic()) continue;
    const Real of_rigid = rigid.mobility_at(rigid.rotation * rows_[k].anchor).trace() / 3;
    least = least > 0 ? std::min(least, of_rigid) : of_rigid;
  }
  point.compliance = compliance * (least > 0 ? least : mobility);
  point.own = 1 / point.compliance;
  point.common = -mobility / (point.compliance + rows * mobility) / point.compliance;
}

// Rigid bodies that hold the same point are in one block; points that none of them holds are in the first.
void Anchors::make_blocks() {
  if (rows_.empty()) return;
  const std::vector<RigidBody>& rigid_bodies = island_.rigid_bodies;
  std::vector<int> first(rigid_bodies.size());  // of those that are solved together
  std::iota(first.begin(), first.end(), 0);
  const auto first_of = [&first](int rigid) {
    while (first[rigid] != rigid) rigid = first[rigid] = first[first[rigid]];
    return rigid;
  };
  const auto dynamic_one_of = [&](const Point& point) {
    for (std::size_t k = point.first; k < point.end; ++k)
      if (rigid_bodies[rows_[k].rigid].is_dynamic()) return rows_[k].rigid;
    return -1;
  };
  for (const Point& point : points_)
    for (std::size_t k = point.first; k < point.end; ++k)
      if (rigid_bodies[rows_[k].rigid].is_dynamic()) first[first_of(rows_[k].rigid)] = first_of(dynamic_one_of(point));

  std::vector<int> block_of(rigid_bodies.size(), -1), slot_of(rigid_bodies.size(), -1);
  blocks_.resize(1);
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const int rigid = dynamic_one_of(points_[p]);
    if (rigid >= 0 && block_of[first_of(rigid)] < 0) {
      block_of[first_of(rigid)] = static_cast<int>(blocks_.size());
      blocks_.emplace_back();
    }
    Block& block = blocks_[rigid >= 0 ? block_of[first_of(rigid)] : 0];
    block.points.push_back(p);
    for (std::size_t k = points_[p].first; k < points_[p].end; ++k) {
      Row& row = rows_[k];
      if (!rigid_bodies[row.rigid].is_dynamic()) continue;
      if (slot_of[row.rigid] < 0) {
        slot_of[row.rigid] = static_cast<int>(block.rigid.size());
        block.rigid.push_back(row.rigid);
      }
      row.slot = slot_of[row.rigid];
    }
  }
  for (Block& block : blocks_) {
    const auto size = 6 * static_cast<Eigen::Index>(block.rigid.size());
    block.matrix.resize(size, size);
    block.given.resize(size);
    block.motion.resize(size);
    if (size > 0) block.inverse = Eigen::PartialPivLU<Eigen::MatrixXd>(size);
  }
}

Vector3 Anchors::relative_velocity(const Point& point, const Row& row) const {
  return point.point->of(point.body->particles.velocities) - island_.rigid_bodies[row.rigid].velocity_at(row.arm);
}

void Anchors::push(const Point& point, Row& row, const Vector3& impulse) {
  point.point->add_push(impulse, point.body->particles.inverse_masses, point.body->particles.velocities);
  if (row.slot >= 0) island_.rigid_bodies[row.rigid].push(-impulse, row.arm);
  row.impulse += impulse;
}

void Anchors::begin(Real h) {
  for (const Point& point : points_) {
    const Vector3 x = point.point->of(point.body->particles.positions);
    for (std::size_t k = point.first; k < point.end; ++k) {
      Row& row = rows_[k];
      const RigidBody& rigid = island_.rigid_bodies[row.rigid];
      row.arm = x - rigid.position;
      row.start = relative_velocity(point, row);
      Vector3 back = -drift_share / h * (row.arm - rigid.rotation * row.anchor);
      if (const Real speed = back.norm(); speed > recovery_speed) back *= recovery_speed / speed;
      row.wanted = row.start + row.influence * (back - row.start);
      row.impulse.setZero();
    }
  }
  for (Block& block : blocks_)
    if (!block.rigid.empty()) invert(block);
}

void Anchors::start(Real since) {
  for (const Point& point : points_)
    for (std::size_t k = point.first; k < point.end; ++k)
      if (!rows_[k].force.isZero(0)) push(point, rows_[k], since * rows_[k].force);
}

void Anchors::invert(Block& block) const {
  block.matrix.setZero();
  for (const std::size_t p : block.points) {
    const Point& point = points_[p];
    for (std::size_t k = point.first; k < point.end; ++k)
      for (std::size_t j = point.first; j < point.end; ++j) {
        const Row &row = rows_[k], &by = rows_[j];
        if (row.slot < 0 || by.slot < 0) continue;
        const Real mass = point.common + (j == k ? point.own : 0);
        block.matrix.block<6, 6>(6 * row.slot, 6 * by.slot) +=
            mass * velocity_by_motion(row.arm).transpose() * velocity_by_motion(by.arm);
      }
  }
  for (std::size_t k = 0; k < block.rigid.size(); ++k)
    for (Eigen::Index column = 0; column < block.matrix.cols(); ++column)
      apply_mobility(island_.rigid_bodies[block.rigid[k]], block.matrix.col(column).segment<6>(6 * Eigen::Index(k)));
  block.matrix.diagonal().array() += 1;
  block.inverse.compute(block.matrix);
}

Vector3 Anchors::sum_of_changes(const Point& point) const {
  Vector3 sum = Vector3::Zero();
  for (std::size_t k = point.first; k < point.end; ++k) sum += rows_[k].change;
  return sum;
}

Real Anchors::sweep() {
  Real largest = 0;
  for (Block& block : blocks_) {
    solve(block);
    for (const std::size_t p : block.points) {
      const Point& point = points_[p];
      const Vector3 sum = sum_of_changes(point);
      for (std::size_t k = point.first; k < point.end; ++k) {
        const Vector3 impulse = impulse_of(point, rows_[k], sum);
        if (impulse.isZero(0)) continue;
        push(point, rows_[k], impulse);
        largest = std::max(largest, (rows_[k].asked - point.compliance * impulse).norm());
      }
    }
  }
  return largest;
}

// What is left to the particles when the rigid bodies have changed.
void Anchors::solve(Block& block) {
  block.given.setZero();
  for (const std::size_t p : block.points) {
    const Point& point = points_[p];
    for (std::size_t k = point.first; k < point.end; ++k)
      rows_[k].asked = rows_[k].change = rows_[k].wanted - relative_velocity(point, rows_[k]);
    const Vector3 sum = sum_of_changes(point);
    for (std::size_t k = point.first; k < point.end; ++k)
      if (const Row& row = rows_[k]; row.slot >= 0)
        block.given.segment<6>(6 * row.slot) -= velocity_by_motion(row.arm).transpose() * impulse_of(point, row, sum);
  }
  if (block.rigid.empty()) return;
  for (std::size_t k = 0; k < block.rigid.size(); ++k)
    apply_mobility(island_.rigid_bodies[block.rigid[k]], block.given.segment<6>(6 * Eigen::Index(k)));
  block.motion = block.inverse.solve(block.given);
  for (const std::size_t p : block.points)
    for (std::size_t k = points_[p].first; k < points_[p].end; ++k)
      if (Row& row = rows_[k]; row.slot >= 0)
        row.change += velocity_by_motion(row.arm) * block.motion.segment<6>(6 * row.slot);
}

void Anchors::end(Real since) {
  for (const Point& point : points_)
    for (std::size_t k = point.first; k < point.end; ++k) {
      Row& row = rows_[k];
      const Vector3 relative = relative_velocity(point, row);
      outside_work_ += row.impulse.dot(relative) - driving_work(*point.point, row.impulse, point.body->particles);
      if (row.slot < 0) outside_work_ += row.impulse.dot(island_.rigid_bodies[row.rigid].velocity_at(row.arm));
      point.body->step_flows.contact_loss += row.impulse.dot(relative - row.start) / 2;
      if (since > 0) row.force = row.impulse / since;
    }
}

void Anchors::begin_attempt() {
  outside_work_ = 0;
  for (Row& row : rows_) row.force.setZero();
}

}  // namespace penalty
