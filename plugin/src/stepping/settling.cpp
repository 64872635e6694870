#include "settling.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

namespace penalty {
namespace {

using Vector6 = Eigen::Vector<Real, 6>;
using Matrix6 = Eigen::Matrix<Real, 6, 6>;

constexpr Real settling_rate = 5;     // in sqrt(g / size), of motion that is almost none
constexpr Real least_inertia = 1e-9;  // of the trace
// Of a rigid motion the mean square of the speeds at the contacts over that of the body: of one that is damped half as
// much as deformation, as it turns about a small patch,
constexpr Real half_held = 0.02;
// and of one that the contacts leave free: how fast that is does not count.
constexpr Real half_free = 1e-4;
constexpr int far = std::numeric_limits<int>::max();

Matrix3 cross_matrix(const Vector3& r) {  // times x: r x x
  Matrix3 result;
  result << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  return result;
}

/// Where a presses on b, all of one step.
struct Hold {
  int a = -1, b = -1;  // bodies and rigid bodies of the island numbered through; b is -1: at rest for good
  Vector3 point, normal;
  Real pressing = 0;
  bool slides = false;
  int number = 0;  // in the order in which they were found

  std::pair<int, int> ends() const { return std::minmax({a, b}); }
};

/// Bodies that cling to each other, as one.
struct Cluster {
  std::vector<SteppedBody*> soft = {};
  std::vector<RigidBody*> rigid = {};
  Real mass = 0, gravity = 0, size = 0, speed = std::numeric_limits<Real>::infinity();
  Vector3 center = Vector3::Zero();
  Matrix6 inertia = Matrix6::Zero();   // of velocity and angular velocity about the centre,
  Vector6 momentum = Vector6::Zero();  // and their momenta
  Real twice_kinetic = 0;

  template <class Visit>
  void visit_particles(const Visit& visit) const {
    for (const SteppedBody* body : soft)
      for (int i = 0; i < body->particles.size(); ++i)
        visit(1 / body->particles.inverse_masses[i], body->particles.positions.col(i).head<3>(),
              body->particles.velocities.col(i).head<3>());
  }

  void measure();
  void add_inertia(Real m, const Vector3& arm, const Vector3& velocity);
  void change(Real kept, const Vector6& motion);  // v = kept * v + motion
};

void Cluster::measure() {
  Vector3 low = Vector3::Constant(std::numeric_limits<Real>::infinity()), high = -low;
  const auto weigh = [&](Real m, const Vector3& x) {
    mass += m;
    center += m * x;
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  };
  visit_particles([&](Real m, const Vector3& x, const Vector3&) { weigh(m, x); });
  for (const RigidBody* body : rigid) weigh(1 / body->inverse_mass.x(), body->position);
  center /= mass;
  size = soft.size() + rigid.size() == 1 ? soft.front()->size : (high - low).norm();
  for (const SteppedBody* body : soft) {
    gravity = std::max(gravity, body->gravity.norm());
    speed = std::min(speed, body->options.settling_speed);
  }
  visit_particles([&](Real m, const Vector3& x, const Vector3& v) { add_inertia(m, x - center, v); });
  auto moments = inertia.bottomRightCorner<3, 3>();
  for (const RigidBody* body : rigid) {
    const Matrix3 own = body->inverse_inertia.inverse();
    add_inertia(1 / body->inverse_mass.x(), body->position - center, body->velocity);
    moments += own;
    momentum.tail<3>() += own * body->angular_velocity;
    twice_kinetic += body->angular_velocity.dot(own * body->angular_velocity);
  }
  moments.diagonal().array() += least_inertia * moments.trace();  // of what lies in one line, too
}

void Cluster::add_inertia(Real m, const Vector3& arm, const Vector3& velocity) {
  inertia.topLeftCorner<3, 3>().diagonal().array() += m;
  inertia.bottomRightCorner<3, 3>() += m * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
  momentum.head<3>() += m * velocity;
  momentum.tail<3>() += m * arm.cross(velocity);
  twice_kinetic += m * velocity.squaredNorm();
}

void Cluster::change(Real kept, const Vector6& motion) {
  const Vector3 linear = motion.head<3>(), angular = motion.tail<3>();
  for (SteppedBody* body : soft) {
    Particles& particles = body->particles;
    const Real before = kinetic_energy(particles);
    for (int i = 0; i < particles.size(); ++i) {
      const Vector3 arm = particles.positions.col(i).head<3>() - center;
      auto v = particles.velocities.col(i).head<3>();
      v = kept * v + linear + angular.cross(arm);
    }
    body->step_flows.drag += before - kinetic_energy(particles);
  }
  for (RigidBody* body : rigid)
    body->set_motion(kept * body->velocity + linear + angular.cross(body->position - center),
                     kept * body->angular_velocity + angular);
}

class Settling {
 public:
  explicit Settling(Island& island)
      : island_(island),
        num_bodies_(static_cast<int>(island.bodies.size())),
        size_(num_bodies_ + static_cast<int>(island.rigid_bodies.size())) {
    choose();
    for (const ContactRecord& record : island.records)
      add(record.body, record.other_body >= 0 ? record.other_body : num_bodies_ + record.other_rigid,
          {.point = record.point,
           .normal = record.normal,
           .pressing = record.normal.dot(record.impulse),
           .slides = record.slides});
    for (const RigidContact& contact : island.rigid_contacts) {
      const RigidBody& b = island.rigid_bodies[contact.b];
      const Vector3 normal = b.rotation * contact.normal;
      const Real pressing = normal.dot(contact.force);
      const Real rubbing = (contact.force - pressing * normal).norm();
      add(num_bodies_ + contact.a, num_bodies_ + contact.b,
          {.point = b.position + b.rotation * contact.anchor_b,
           .normal = normal,
           .pressing = pressing,
           .slides = is_at_limit(rubbing, contact.friction * pressing)});
    }
    join();
    find_depths();
    list();
  }

  bool run(Real duration) {
    bool changed = false;
    for (int k = 0; k < size_; ++k)
      if (cluster_[k] == k && takes_part_[k] && depths_[k] != far && settle(k, duration)) changed = true;
    return changed;
  }

 private:
  void choose() {
    takes_part_.assign(size_, false);
    for (int k = 0; k < num_bodies_; ++k) {
      const SteppedBody& body = *island_.bodies[k];
      const std::vector<Real>& inverse_masses = body.particles.inverse_masses;
      takes_part_[k] = body.options.settling_speed > 0 && !body.gravity.isZero(0) &&
                       std::find(inverse_masses.begin(), inverse_masses.end(), Real(0)) == inverse_masses.end();
    }
    for (int k = num_bodies_; k < size_; ++k) takes_part_[k] = island_.rigid_bodies[k - num_bodies_].is_free();
    const auto leave_out = [this](int rigid) {
      if (rigid >= 0) takes_part_[num_bodies_ + rigid] = false;
    };
    for (const Joint& joint : island_.joints) {
      leave_out(joint.a);
      leave_out(joint.b);
    }
    for (const Anchor& anchor : island_.anchors) leave_out(anchor.b.rigid);
    for (const Coupling* coupling : island_.couplings)
      for (const Side& side : coupling->points) leave_out(side.rigid);
  }

  bool is_at_rest(int k) const { return k >= num_bodies_ && island_.rigid_bodies[k - num_bodies_].is_at_rest(); }

  void add(int a, int b, Hold hold) {
    if (!(hold.pressing > 0) || a == b) return;
    if (!takes_part_[a]) std::swap(a, b);
    if (!takes_part_[a] || !(takes_part_[b] || is_at_rest(b))) return;
    hold.a = a;
    hold.b = takes_part_[b] ? b : -1;
    hold.number = static_cast<int>(holds_.size());
    holds_.push_back(hold);
  }

  int root(int k) {
    while (cluster_[k] != k) k = cluster_[k] = cluster_[cluster_[k]];
    return k;
  }

  // Two bodies cling to each other where most of what presses them together does not slide.
  void join() {
    cluster_.resize(size_);
    std::iota(cluster_.begin(), cluster_.end(), 0);
    std::sort(holds_.begin(), holds_.end(), [](const Hold& l, const Hold& m) {
      return std::pair(l.ends(), l.number) < std::pair(m.ends(), m.number);
    });
    for (std::size_t k = 0; k < holds_.size();) {
      const std::pair<int, int> ends = holds_[k].ends();
      Real clinging = 0;
      for (; k < holds_.size() && holds_[k].ends() == ends; ++k)
        clinging += holds_[k].slides ? -holds_[k].pressing : holds_[k].pressing;
      if (ends.first >= 0 && clinging > 0) cluster_[root(ends.first)] = root(ends.second);
    }
    for (int k = 0; k < size_; ++k) cluster_[k] = root(k);
  }

  // How many clusters there are between one and what is at rest.
  void find_depths() {
    depths_.assign(size_, far);
    for (const Hold& hold : holds_)
      if (hold.b < 0) depths_[cluster_[hold.a]] = 0;
    for (bool changed = true; changed;) {
      changed = false;
      const auto pass = [&](int from, int to) {
        if (from == far || from + 1 >= depths_[to]) return;
        depths_[to] = from + 1;
        changed = true;
      };
      for (const Hold& hold : holds_) {
        if (hold.b < 0) continue;
        const int a = cluster_[hold.a], b = cluster_[hold.b];
        pass(depths_[a], b);
        pass(depths_[b], a);
      }
    }
  }

  // Who is in each cluster, and what holds it, or lies on it.
  void list() {
    for (int k = 0; k < size_; ++k)
      if (takes_part_[k]) members_.emplace_back(cluster_[k], k);
    for (int k = 0; k < static_cast<int>(holds_.size()); ++k) {
      const int a = cluster_[holds_[k].a], b = holds_[k].b < 0 ? -1 : cluster_[holds_[k].b];
      if (a == b) continue;
      holds_of_.emplace_back(a, k);
      if (b >= 0) holds_of_.emplace_back(b, k);
    }
    std::sort(members_.begin(), members_.end());
    std::sort(holds_of_.begin(), holds_of_.end());
  }

  // Of a cluster, from such a list.
  static std::span<const std::pair<int, int>> entries(const std::vector<std::pair<int, int>>& of_all, int number) {
    const auto first = std::lower_bound(of_all.begin(), of_all.end(), std::pair(number, 0));
    return {first, std::lower_bound(first, of_all.end(), std::pair(number + 1, 0))};
  }

  // The mean square speed of the contacts of a cluster with what holds it, times its mass, as a form in its velocity and
  // angular velocity.
  Matrix6 held_of(int number, const Cluster& cluster) const {
    Matrix6 held = Matrix6::Zero();
    Real pressing = 0;
    for (const auto& [of, place] : entries(holds_of_, number)) {
      const Hold& hold = holds_[place];
      const int other = cluster_[hold.a] == number ? hold.b : hold.a;
      if (other >= 0 && depths_[cluster_[other]] >= depths_[number]) continue;  // lies on it, or beside it
      Eigen::Matrix<Real, 3, 6> velocity;
      velocity << Matrix3::Identity(), -cross_matrix(hold.point - cluster.center);
      if (hold.slides || hold.b >= 0) {  // of another cluster, it slides on the whole
        const Vector6 along = velocity.transpose() * hold.normal;
        held += hold.pressing * along * along.transpose();
      } else {
        held += hold.pressing * velocity.transpose() * velocity;
      }
      pressing += hold.pressing;
    }
    return cluster.mass / pressing * held;
  }

  bool settle(int number, Real duration) {
    Cluster cluster;
    for (const auto& [of, k] : entries(members_, number)) {
      if (k < num_bodies_)
        cluster.soft.push_back(island_.bodies[k]);
      else
        cluster.rigid.push_back(&island_.rigid_bodies[k - num_bodies_]);
    }
    if (cluster.soft.empty()) return false;
    cluster.measure();
    if (!(cluster.size > 0)) return false;

    // Rigid motions of which each has its own share, orthogonal in the inertia.
    const Eigen::LLT<Matrix6> factor(cluster.inertia);
    Matrix6 reduced = factor.matrixL().solve(held_of(number, cluster));
    reduced = factor.matrixL().solve(reduced.transpose().eval());
    const Eigen::SelfAdjointEigenSolver<Matrix6> motions(reduced);
    const Matrix6 shapes = factor.matrixU().solve(motions.eigenvectors());
    const Vector6 amounts = shapes.transpose() * cluster.momentum;
    const Vector6 held = motions.eigenvalues().cwiseMax(0);
    const Vector6 damped = held.array() / (held.array() + half_held),
                  counted = held.array() / (held.array() + half_free);

    // Deformation is damped where it is slow, whatever the body does meanwhile; rigid motion where all of it is slow.
    const Real slow2 = cluster.speed * cluster.speed * cluster.gravity * cluster.size;
    const auto damping_of = [&](Real twice_energy) {
      const Real rate = settling_rate * std::sqrt(cluster.gravity / cluster.size);
      return std::max<Real>(rate * (1 - twice_energy / (cluster.mass * slow2)), 0) * duration;
    };
    const Real deforming = std::max<Real>(cluster.twice_kinetic - amounts.squaredNorm(), 0);
    const Real of_deformation = damping_of(deforming),
               of_rigid_motion = damping_of(deforming + counted.dot(amounts.cwiseAbs2()));
    if (!(of_deformation > 0)) return false;
    const Real kept = std::exp(-of_deformation);
    const Vector6 more = (-of_rigid_motion * damped).array().exp() - kept;
    cluster.change(kept, shapes * more.cwiseProduct(amounts));
    return true;
  }

  Island& island_;
  int num_bodies_, size_;  // of all
  std::vector<char> takes_part_;
  std::vector<Hold> holds_;
  std::vector<int> cluster_, depths_;                    // the first of it; of that
  std::vector<std::pair<int, int>> members_, holds_of_;  // cluster, and number of the body or the hold
};

}  // namespace

bool settle(Island& island, Real duration) { return !island.records.empty() && Settling(island).run(duration); }

}  // namespace penalty
