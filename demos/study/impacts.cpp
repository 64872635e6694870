#include "study/impacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"
#include "penalty/stepping/island.h"
#include "study/recovery_watch.h"

namespace penalty::study {
namespace {

constexpr Real gravity = 9.81, coefficient_of_friction = 0.5;
constexpr Real near = 0.3;  // what is nearer than that is a contact to consider [m]
constexpr Real allowed_gain = 1e-3;
constexpr Real impact_speed = 6, slab_height = 0.4, slab_width = 3;

Real volume(const Eigen::Ref<const Eigen::Matrix3Xd>& x, const std::array<int, 4>& t) {
  Matrix3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = x.col(t[k + 1]) - x.col(t[0]);
  return edges.determinant();
}

/// The torus above the plane y = 0, which is rigid body 0; rigid body 1, if there is one, is a slab above it.
class Scene {
 public:
  Scene(Real stiffness, Real height, Real damping_time)
      : mesh_(make_torus()), field_(make_elastic_field(mesh_.vertices, mesh_.tetrahedra, stiffness)) {
    const PackedVectors& rest = field_.rest_positions();
    const auto count = static_cast<std::size_t>(rest.cols());
    body_.particles = {rest, PackedVectors::Zero(4, rest.cols()), std::vector<Real>(count, static_cast<Real>(count))};
    body_.particles.positions.row(1).array() += height - rest.row(1).minCoeff();
    body_.field = &field_;
    body_.gravity = Vector3(0, -gravity, 0);
    body_.options.integrator = Integrator::implicit_step;
    body_.options.damping_time = damping_time;
    estimate_stability(body_);
    island_.bodies = {&body_};
    island_.rigid_bodies.resize(1);
  }

  void add_slab(Real mass) {
    RigidBody& slab = island_.rigid_bodies.emplace_back();
    slab.position = Vector3(0.05, top() + slab_height / 2, 0);  // off the middle
    slab.velocity = Vector3(0, -impact_speed, 0);
    slab.acceleration = body_.gravity;
    slab.inverse_mass.setConstant(1 / mass);
    const Real thin = slab_width * slab_width + slab_height * slab_height, flat = 2 * slab_width * slab_width;
    slab.inverse_inertia = (12 / mass * Vector3(1 / thin, 1 / flat, 1 / thin)).asDiagonal();
  }

  /// Steps for `duration` at `rate`, and measures against a fall that gives `fall` [J].
  void run(Real duration, Real rate, Real fall, Impact& impact) {
    const Real start = energy();
    const auto steps = std::max<long>(1, std::lround(duration * rate));
    long in_contact = 0;
    for (long k = 0; k < steps && impact.finite; ++k) {
      find_contacts();
      const Real before = thread_cpu_seconds();
      impact.finite = advance(island_, 1 / rate).finite;
      if (!island_.contacts.empty()) {
        impact.milliseconds += 1e3 * (thread_cpu_seconds() - before);
        ++in_contact;
      }
      impact.gain = std::max(impact.gain, (energy() - start) / fall);
      impact.depth = std::max(impact.depth, depth());
      impact.least_volume = std::min(impact.least_volume, least_volume());
    }
    impact.milliseconds /= static_cast<Real>(std::max<long>(in_contact, 1));
    impact.kinetic_end = kinetic() / fall;
    impact.finite = impact.finite && std::isfinite(impact.kinetic_end);
  }

 private:
  Vector3 position(int i) const { return body_.particles.positions.col(i).head<3>(); }
  Real top() const { return body_.particles.positions.row(1).maxCoeff(); }

  void find_contacts() {
    island_.contacts.clear();
    const auto add = [this](int particle, int rigid, const Vector3& anchor, const Vector3& normal) {
      Contact& contact = island_.contacts.emplace_back();
      contact.a = Side::of_particles(0, WeightedPoint::at_particle(particle));
      contact.b = Side::of_rigid(rigid, anchor);
      contact.normal = normal;
      contact.friction = coefficient_of_friction;
    };
    for (int i = 0; i < body_.particles.size(); ++i) {
      const Vector3 x = position(i);
      if (x.y() < near) add(i, 0, Vector3(x.x(), 0, x.z()), Vector3::UnitY());
      if (island_.rigid_bodies.size() == 1) continue;
      if (const Vector3 seen = from_slab(x); seen.y() > -slab_height / 2 - near)
        add(i, 1, Vector3(seen.x(), -slab_height / 2, seen.z()), -Vector3::UnitY());
    }
  }
  Vector3 from_slab(const Vector3& x) const {
    const RigidBody& slab = island_.rigid_bodies[1];
    return slab.rotation.transpose() * (x - slab.position);
  }

  Real kinetic() const {
    Real sum = kinetic_energy(body_.particles);
    for (const RigidBody& rigid : island_.rigid_bodies) sum += kinetic_energy(rigid);
    return sum;
  }
  Real energy() const {
    Real sum = field_.energy(body_.particles.positions) + kinetic();
    for (int i = 0; i < body_.particles.size(); ++i)
      sum += gravity * position(i).y() / body_.particles.inverse_masses[i];
    for (const RigidBody& rigid : island_.rigid_bodies)
      if (rigid.is_dynamic()) sum += gravity * rigid.position.y() / rigid.inverse_mass.y();
    return sum;
  }
  Real depth() const {
    Real deepest = 0;
    for (int i = 0; i < body_.particles.size(); ++i) {
      deepest = std::max(deepest, -position(i).y());
      if (island_.rigid_bodies.size() > 1) deepest = std::max(deepest, from_slab(position(i)).y() + slab_height / 2);
    }
    return deepest;
  }
  Real least_volume() const {
    Real least = 1;
    for (const auto& t : mesh_.tetrahedra)
      least = std::min(least, volume(body_.particles.positions.topRows<3>(), t) / volume(mesh_.vertices, t));
    return least;
  }

  TetMesh mesh_;
  PotentialField field_;
  SteppedBody body_;
  Island island_;
};

}  // namespace

bool Impact::is_stable() const { return finite && gain <= allowed_gain; }

Drop drop(Real stiffness, Real rate, Real damping_time, Real duration) {
  constexpr Real height = 2, mass = 1;
  Drop result;
  result.stiffness = stiffness;
  result.rate = rate;
  result.damping_time = damping_time;
  Scene(stiffness, height, damping_time).run(duration, rate, mass * gravity * height, result);
  return result;
}

Slab load(Real mass, Real stiffness, Real duration) {
  Slab result;
  result.mass = mass;
  result.stiffness = stiffness;
  Scene scene(stiffness, 0, 0);
  scene.add_slab(mass);
  scene.run(duration, 60, mass * impact_speed * impact_speed / 2, result);
  return result;
}

bool ImpactTable::is_stable() const {
  const auto is_stable = [](const Impact& impact) { return impact.is_stable(); };
  return std::ranges::all_of(drops, is_stable) && std::ranges::all_of(slabs, is_stable);
}

ImpactTable measure_impacts(Real duration, const std::function<void(Real)>& progress) {
  ImpactTable table;
  constexpr Real total = 10 * 3 * 2 + 5 * 3;
  Real done = 0;
  for (int power = -1; power <= 8; ++power)
    for (const Real rate : {30, 60, 240})
      for (const Real damping_time : {0.0, 0.01}) {
        table.drops.push_back(drop(std::pow(10.0, power), rate, damping_time, duration));
        progress(++done / total);
      }
  for (int power = 1; power <= 5; ++power)
    for (const Real mass : {10, 100, 1000}) {
      table.slabs.push_back(load(mass, std::pow(10.0, power), duration));
      progress(++done / total);
    }
  return table;
}

std::string ImpactTable::text() const {
  const auto measured = [](const Impact& impact) {
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), "  %12.1e  %12.1e  %9.1e  %12.3f  %9.2f  %s\n", impact.gain,
                  impact.kinetic_end, impact.depth, impact.least_volume, impact.milliseconds,
                  impact.finite ? "yes" : "NO");
    return std::string(line.data());
  };
  const std::string names = "  max E/E0 - 1  end kin./E0  depth [m]  least volume  [ms/step]  finite\n";
  std::array<char, 80> line{};
  std::string text =
      "A torus of 4374 tetrahedra and 1 kg falls by 2 m, which gives E0; implicit steps, CPU time of those in contact\n"
      "     K [J]  rate [Hz]  damping [s]" +
      names;
  for (const Drop& drop : drops) {
    std::snprintf(line.data(), line.size(), "%10.0e  %9.0f  %11.2f", drop.stiffness, drop.rate, drop.damping_time);
    text += line.data() + measured(drop);
  }
  text += "\nOn it, at rest, a slab comes down at 6 m/s; implicit steps at 60 Hz\n     K [J]  mass [kg]" + names;
  for (const Slab& slab : slabs) {
    std::snprintf(line.data(), line.size(), "%10.0e  %9.0f", slab.stiffness, slab.mass);
    text += line.data() + measured(slab);
  }
  return text;
}

}  // namespace penalty::study
