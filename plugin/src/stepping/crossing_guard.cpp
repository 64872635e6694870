// The part of SurfaceContacts that lets nothing cross.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "surface_contacts.h"

namespace penalty {
namespace {

constexpr Real unknown_reach = std::numeric_limits<Real>::infinity();
constexpr Real no_moment = 1e-13;                                 // of inertia, relative to the largest
constexpr int extra_sweeps = 8;                                   // before what fails is frozen
constexpr long most_tests = 20000, most_tests_of_particle = 100;  // of pairs, for zones, in a step

}  // namespace

void SurfaceContacts::guard(Real h, Real remaining, const RigidSweep& rigid_sweep) {
  zone_.clear();
  if (is_empty() || is_beyond_help()) return;
  bool collected = true;
  for (int round = 0;; ++round) {
    if (refresh(h, remaining)) collected = false;
    find_failing(h);
    if (scratch_.failing.empty()) return;
    if (round < extra_sweeps) {
      if (!collected) {
        book();
        collect(h);
      }
      collected = true;
      rigid_sweep();
      bool hit = false;
      sweep_pairs(h, hit);
    } else {
      freeze(h);
      if (is_beyond_help()) return;
    }
    surfaces_.take_velocities();
  }
}

// A body that is torn to pieces would take minutes, and nothing comes of it.
bool SurfaceContacts::is_beyond_help() const {
  return freezing_tests_ > most_tests + most_tests_of_particle * static_cast<long>(first_particle_.back());
}

void SurfaceContacts::find_failing(Real h) {
  scratch_.failing.clear();
  for (const SurfaceContact& contact : island_.surfaces)
    contact.pair->visit_near([&](FeaturePair& q, Real reach) {
      const FailingPair pair{&contact, &q};
      if (!(!zone_.empty() && is_in_one_zone(pair)) && contact.pair->separated_share(q, h, reach) < 1)
        scratch_.failing.push_back(pair);
    });
}

template <class Visit>
void SurfaceContacts::visit_particles(const FailingPair& pair, const Visit& visit) const {
  const FeaturePair& q = *pair.features;
  const SurfaceContact& contact = *pair.contact;
  const int size_of_first = q.are_edges ? 2 : 1;
  for (int k = 0; k < 4; ++k) {
    const bool is_of_b = (k < size_of_first) == q.from_b;
    if (is_of_b && contact.rigid >= 0) {
      visit(first_particle_.back() + contact.rigid);
      continue;
    }
    const WeightedPoint& point = (is_of_b ? contact.pair->b() : contact.pair->a()).points()[q.points[k]];
    for (int i = 0; i < point.size; ++i)
      visit(first_particle_[is_of_b ? contact.body_b : contact.body_a] + point.particles[i]);
  }
}

int SurfaceContacts::zone_of(int particle) {
  while (zone_[particle] != particle) particle = zone_[particle] = zone_[zone_[particle]];
  return particle;
}

bool SurfaceContacts::is_in_one_zone(const FailingPair& pair) {
  int zone = -1;
  bool is_one = true;
  visit_particles(pair, [&](int particle) {
    const int own = zone_of(particle);
    is_one = is_one && (zone < 0 || zone == own);
    zone = own;
  });
  return is_one;
}

std::pair<SteppedBody*, int> SurfaceContacts::particle(int number) const {
  const auto next = std::upper_bound(first_particle_.begin(), first_particle_.end(), number);
  const auto body = next - first_particle_.begin() - 1;
  return {island_.bodies[body], number - first_particle_[body]};
}

// Joins the particles of failing pairs into zones and makes these rigid, until no pair at their particles fails. The map
// of a rigid zone, x + h (V + w x (x - c)), lets nothing inside it collapse: its singular values are at least one.
void SurfaceContacts::freeze(Real h) {
  const int count = first_particle_.back() + static_cast<int>(island_.rigid_bodies.size());
  if (zone_.empty()) {
    zone_.resize(count);
    std::iota(zone_.begin(), zone_.end(), 0);
  }
  std::vector<std::vector<FailingPair>> pairs_of(count);
  for (const SurfaceContact& contact : island_.surfaces)
    contact.pair->visit_near([&](FeaturePair& q, Real) {
      const FailingPair pair{&contact, &q};
      visit_particles(pair, [&](int particle) { pairs_of[particle].push_back(pair); });
    });
  std::vector<std::vector<int>> members(count);
  for (int i = 0; i < count; ++i) members[zone_of(i)].push_back(i);

  std::vector<FailingPair>& failing = scratch_.failing;
  while (!failing.empty()) {
    std::vector<int> touched;
    for (const FailingPair& pair : failing) {
      int into = -1;
      visit_particles(pair, [&](int particle) {
        const int zone = zone_of(particle);
        if (into < 0) into = zone;
        if (zone == into) return;
        const auto [low, high] = std::minmax(zone, into);
        zone_[high] = low;
        members[low].insert(members[low].end(), members[high].begin(), members[high].end());
        members[high].clear();
        into = low;
      });
      touched.push_back(into);
    }
    for (int& zone : touched) zone = zone_of(zone);
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    failing.clear();
    std::vector<FailingPair> again;
    for (const int zone : touched) {
      std::sort(members[zone].begin(), members[zone].end());
      join(members[zone], pairs_of);
      for (const int particle : members[zone])
        again.insert(again.end(), pairs_of[particle].begin(), pairs_of[particle].end());
    }
    surfaces_.take_velocities();
    freezing_tests_ += static_cast<long>(again.size());
    if (is_beyond_help()) return;
    for (const FailingPair& pair : again)
      if (!is_in_one_zone(pair) && pair.contact->pair->separated_share(*pair.features, h, unknown_reach) < 1)
        failing.push_back(pair);
  }
}

struct SurfaceContacts::RigidMotion {
  Vector3 center, velocity, turn;

  Vector3 at(const Vector3& x) const { return velocity + turn.cross(x - center); }
};

// Null if the number is that of a particle.
RigidBody* SurfaceContacts::rigid_body(int number) const {
  const int first = first_particle_.back();
  return number < first ? nullptr : &island_.rigid_bodies[number - first];
}

// Makes a zone rigid. If it is of two bodies, what that gives is recorded at a pair that joins them; of more it is not
// known who gave what to whom.
void SurfaceContacts::join(std::span<const int> numbers, std::span<const std::vector<FailingPair>> pairs_of) {
  const FailingPair* link = nullptr;
  for (const int number : numbers)
    for (const FailingPair& pair : pairs_of[number])
      if (!link && !pair.contact->is_within_body() && is_in_one_zone(pair)) link = &pair;
  bool takes_all = true, a_is_held = false;
  for (const int number : numbers) {
    if (!link) break;
    const SurfaceContact& contact = *link->contact;
    if (const RigidBody* rigid = rigid_body(number)) {
      takes_all = takes_all && contact.rigid >= 0 && rigid == &island_.rigid_bodies[contact.rigid];
      continue;
    }
    const auto [body, i] = particle(number);
    const bool is_of_a = body == island_.bodies[contact.body_a];
    takes_all = takes_all && (is_of_a || (contact.rigid < 0 && body == island_.bodies[contact.body_b]));
    a_is_held = a_is_held || (is_of_a && !(body->particles.inverse_masses[i] > 0));
  }
  if (!link || !takes_all) return make_rigid(numbers);
  // Who is held does not say what it was given.
  const SurfaceContact& contact = *link->contact;
  const auto momentum = [&]() -> Vector3 {
    if (a_is_held && contact.rigid >= 0) return island_.rigid_bodies[contact.rigid].impulse;
    Vector3 sum = Vector3::Zero();
    for (const int number : numbers) {
      if (rigid_body(number)) continue;
      const auto [body, i] = particle(number);
      if (const Real inverse_mass = body->particles.inverse_masses[i];
          body == island_.bodies[a_is_held ? contact.body_b : contact.body_a] && inverse_mass > 0)
        sum += body->particles.velocities.col(i).head<3>() / inverse_mass;
    }
    return sum;
  };
  const Vector3 before = momentum();
  make_rigid(numbers);
  const FeaturePair& q = *link->features;
  const Vector3 given = (momentum() - before) * (a_is_held != q.from_b ? -1 : 1);  // to the first feature
  record(features_of(island_, contact, q), q.thickness, given);
}

// What is held holds the rest, and does the work.
void SurfaceContacts::make_rigid(std::span<const int> numbers) {
  if (const auto held = motion_of_held(numbers))
    outside_work_ += std::max<Real>(impose(*held, numbers), 0);
  else
    impose(common_motion(numbers), numbers);
}

// Particles without mobility, and rigid bodies that cannot move freely.
std::optional<SurfaceContacts::RigidMotion> SurfaceContacts::motion_of_held(std::span<const int> numbers) const {
  for (const int number : numbers) {
    if (const RigidBody* rigid = rigid_body(number)) {
      if (!rigid->is_free()) return RigidMotion{rigid->position, rigid->velocity, rigid->angular_velocity};
      continue;
    }
    const auto [body, i] = particle(number);
    if (!(body->particles.inverse_masses[i] > 0))
      return RigidMotion{body->particles.positions.col(i).head<3>(), body->particles.velocities.col(i).head<3>(),
                         Vector3::Zero()};
  }
  return std::nullopt;
}

// That keeps both momenta.
SurfaceContacts::RigidMotion SurfaceContacts::common_motion(std::span<const int> numbers) const {
  struct Part {
    Real mass;
    Vector3 position, velocity;
  };
  const auto part_of = [this](int number) -> Part {
    if (const RigidBody* rigid = rigid_body(number))
      return {1 / rigid->inverse_mass.x(), rigid->position, rigid->velocity};
    const auto [body, i] = particle(number);
    return {1 / body->particles.inverse_masses[i], body->particles.positions.col(i).head<3>(),
            body->particles.velocities.col(i).head<3>()};
  };
  const Vector3 origin = part_of(numbers.front()).position;
  Real mass = 0;
  Vector3 center = Vector3::Zero(), mean = Vector3::Zero();
  for (const int number : numbers) {
    const Part part = part_of(number);
    mass += part.mass;
    center += part.mass * (part.position - origin);
    mean += part.mass * part.velocity;
  }
  center = origin + center / mass;
  mean /= mass;
  Vector3 spin = Vector3::Zero();
  Matrix3 inertia = Matrix3::Zero();
  for (const int number : numbers) {
    const Part part = part_of(number);
    const Vector3 arm = part.position - center;
    spin += part.mass * arm.cross(part.velocity - mean);
    inertia += part.mass * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
    if (const RigidBody* rigid = rigid_body(number)) {
      const Matrix3 own = rigid->inverse_inertia.inverse();
      spin += own * rigid->angular_velocity;
      inertia += own;
    }
  }
  // Particles in a line have no moment about it, and nearly none is taken for none: what then turns would gain energy.
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(inertia);
  Vector3 turn = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    const Vector3 axis = axes.eigenvectors().col(k);
    if (axes.eigenvalues()[k] > no_moment * axes.eigenvalues()[2])
      turn += axis.dot(spin) / axes.eigenvalues()[k] * axis;
  }
  return {center, mean, turn};
}

// Returns what that adds to the kinetic energy [J].
Real SurfaceContacts::impose(const RigidMotion& motion, std::span<const int> numbers) {
  Real gain = 0;
  for (const int number : numbers) {
    if (RigidBody* rigid = rigid_body(number)) {
      if (!rigid->is_free()) continue;
      gain -= kinetic_energy(*rigid);
      rigid->set_motion(motion.at(rigid->position), motion.turn);
      gain += kinetic_energy(*rigid);
      continue;
    }
    const auto [body, i] = particle(number);
    const Real inverse_mass = body->particles.inverse_masses[i];
    if (!(inverse_mass > 0)) continue;
    Eigen::Map<Vector3> v(body->particles.velocities.data() + 4 * i);
    const Vector3 wanted = motion.at(body->particles.positions.col(i).head<3>());
    gain += (wanted.squaredNorm() - v.squaredNorm()) / 2 / inverse_mass;
    v = wanted;
  }
  return gain;
}

}  // namespace penalty
