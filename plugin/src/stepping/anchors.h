// Particles that are held at points of rigid bodies.
#pragma once
#include <Eigen/LU>

#include "penalty/stepping/island.h"

namespace penalty {

/// Two-sided constraints on velocities: the relative velocity of a particle and of the point of the rigid body that is
/// where the particle is comes to zero, but for what takes back the way between the particle and its anchor: a fifth of it
/// in each drift, at half a metre a second at most, as work from outside. Of an anchor of less than full influence that
/// share of the change is made in each drift. Both take the impulse at the particle, so both momenta are kept.
///
/// All anchors of a rigid body are met at once. The change q of the relative velocity that an anchor asks for takes the
/// impulse p = m q of its particle, whose mass is m, so the body alone remains unknown, as if its particles were fixed
/// in it: with the impulses p at arms a, G = (1, -[a]x) from its six velocities u to that of the point, and its inverse
/// masses W,
///
///     (1 + W sum Gᵀ m G) du = -W sum Gᵀ m q
///
/// Rigid bodies that hold the same particle are unknown together. There, and where the particle is pinned, the anchor
/// gives way by a millionth of what the rigid bodies do, which the next sweep takes back.
class Anchors {
 public:
  explicit Anchors(Island& island);

  bool is_empty() const { return island_.anchors.empty(); }

  /// Before the sweeps of a drift of h [s], and before anything gives an impulse: of the velocity that there is now an
  /// anchor of partial influence leaves its share.
  void begin(Real h);

  /// Meets the forces that acted for `since` [s] as in the last drift, by its impulses.
  void start(Real since);

  /// Returns the largest change of a relative velocity [m/s].
  Real sweep();

  /// Keeps what the sweeps came to.
  void end(Real since);

  /// Begins an attempt at the step.
  void begin_attempt();

  /// Of bodies that move and take no impulse, of driven particles, and of ways that are taken back, in this attempt [J].
  Real outside_work() const { return outside_work_; }

 private:
  struct Row {                  // of one anchor
    int rigid = -1, slot = -1;  // the latter of the rigid body in its block; -1: it takes no impulse
    Vector3 anchor = Vector3::Zero(), arm = Vector3::Zero();
    Real influence = 1;
    Vector3 wanted = Vector3::Zero(), start = Vector3::Zero();   // relative velocities,
    Vector3 asked = Vector3::Zero();                             // how much they are still to change,
    Vector3 change = Vector3::Zero();                            // and how much by the particle
    Vector3 impulse = Vector3::Zero(), force = Vector3::Zero();  // in this drift [N s], in the last [N]
  };
  struct Point {  // that is held
    SteppedBody* body = nullptr;
    const WeightedPoint* point = nullptr;
    std::size_t first = 0, end = 0;  // rows
    Real own = 0, common = 0;        // impulse of a row by its change, and by those of all rows of the point [kg]
    Real compliance = 0;             // [1/kg]
  };
  struct Block {  // of rigid bodies, solved together
    std::vector<int> rigid;
    std::vector<std::size_t> points;
    Eigen::MatrixXd matrix = {};
    Eigen::VectorXd given = {}, motion = {};  // changes of velocities by the rows alone, and altogether
    Eigen::PartialPivLU<Eigen::MatrixXd> inverse = {};
  };

  Real mobility_of(const Point& point) const;
  void weigh(Point& point) const;
  void make_blocks();
  void invert(Block& block) const;
  void solve(Block& block);
  Vector3 sum_of_changes(const Point& point) const;
  Vector3 relative_velocity(const Point& point, const Row& row) const;
  void push(const Point& point, Row& row, const Vector3& impulse);
  Vector3 impulse_of(const Point& point, const Row& row, const Vector3& sum) const {
    return point.own * row.change + point.common * sum;
  }

  Island& island_;
  std::vector<Row> rows_;
  std::vector<Point> points_;
  std::vector<Block> blocks_;
  Real outside_work_ = 0;
};

}  // namespace penalty
