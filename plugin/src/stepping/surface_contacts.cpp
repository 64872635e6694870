#include "surface_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_rules.h"

namespace penalty {
namespace {

constexpr Real exit_speed = 0.2;         // of what is led out of a closed surface, at most [m/s]
constexpr Real exit_acceleration = 20;   // likewise [m/s²]: what is pressed in stays
constexpr Real step_share = 0.5;         // of the thickness that a substep may bring surfaces closer
constexpr Real common_direction = 0.2;   // share of the depths that must agree where enclosed points are led out
constexpr int most_near_substeps = 400;  // to that end; beyond it the guard has more to do
constexpr int fewest_substeps = 16;      // of a step in which surfaces are near
constexpr int most_surface_sweeps = 50;
constexpr Real tolerance = 0.003;         // sweeps end when none changes a distance by this share of the thickness,
constexpr Real relative_tolerance = 0.5;  // and by no more than that of the first,
constexpr Real negligible_share = 3e-4;   // unless it is this small;
constexpr Real unseen_share = 0.15;  // where bodies lie, none changes a speed by this share of a substep's fall, either

}  // namespace

SurfaceContacts::SurfaceContacts(Island& island)
    : island_(island),
      scratch_(*(island.surface_scratch ? island.surface_scratch
                                        : island.surface_scratch = std::make_shared<SurfaceScratch>())),
      surfaces_(island) {
  if (is_empty()) return;
  may_touch_.assign(island.bodies.size(), false);
  first_particle_.push_back(0);
  for (const SteppedBody* body : island.bodies)
    first_particle_.push_back(first_particle_.back() + body->particles.size());
}

void SurfaceContacts::begin_step(Real duration) {
  if (is_empty()) return;
  scratch_.records.clear();
  quiet_gravity_ = gravity_of_quiet();
  surfaces_.begin_step();
  surfaces_.take_velocities();
  Real needed = 1;
  for (const SurfaceContact& contact : island_.surfaces) {
    SurfacePair& pair = *contact.pair;
    pair.begin_step();
    pair.refresh(duration / fewest_substeps, duration);
    if (pair.has_near()) needed = std::max<Real>(needed, fewest_substeps);
    const Real closing = duration * pair.closing_speed(duration);
    // Patches of one body lie side by side, and always move a little.
    if (pair.has_near() || (!pair.is_self() && closing > 0))
      for (const int body : {contact.body_a, contact.body_b})
        if (body >= 0) may_touch_[body] = true;
    if (closing > 0 && pair.thickness() > 0)
      needed =
          std::max(needed, std::min<Real>(std::ceil(closing / (step_share * pair.thickness())), most_near_substeps));
  }
  least_substeps_ = static_cast<int>(needed);
  for (const SurfaceContact& surface : island_.surfaces)
    if (surface.rigid >= 0 && !surface.pair->enclosed().empty()) hold_inside(surface);
}

// Particles hold a body that is deep inside theirs where it is: each pushed off by its own, they would tear it apart.
void SurfaceContacts::hold_inside(const SurfaceContact& surface) {
  Real depth = 0;
  for (const EnclosedPoint& enclosed : surface.pair->enclosed()) depth = std::max(depth, enclosed.depth);
  for (Contact& contact : island_.contacts)
    if (surface.rigid == contact.b.rigid && surface.body_a == contact.a.body && depth > contact.deepest) {
      contact.deepest = 0;
      if (held_inside_.empty() || held_inside_.back() != surface.pair) held_inside_.push_back(surface.pair);
    }
}

bool SurfaceContacts::refresh(Real h, Real remaining) {
  bool changed = false;
  for (const SurfaceContact& contact : island_.surfaces) changed = contact.pair->refresh(h, remaining) || changed;
  return changed;
}

void SurfaceContacts::sweep(Real h, Real remaining, Real since, const RigidSweep& rigid_sweep) {
  begin_sweeps();
  refresh(h, remaining);
  collect(h);
  if (converge(h, since, rigid_sweep)) surfaces_.take_velocities();
  guard(h, remaining, rigid_sweep);
  book();
}

void SurfaceContacts::close(Real h, Real since, const RigidSweep& rigid_sweep) {
  begin_sweeps();
  refresh(h, h);
  collect(h);
  converge(h, since, rigid_sweep);
  book();
}

void SurfaceContacts::close_again(Real h, const RigidSweep& rigid_sweep) {
  for (TouchingPair& pair : scratch_.pairs) {
    pair.given = 0;
    pair.rubbed.setZero();
  }
  converge(h, 0, rigid_sweep);
  book();
}

void SurfaceContacts::drifted(Real h) {
  surfaces_.drift(h);
  surfaces_.take_positions();
}

void SurfaceContacts::undo() {
  outside_work_ = 0;
  scratch_.records.clear();
  surfaces_.forget();
  surfaces_.take_positions();
  for (const SurfaceContact& contact : island_.surfaces) contact.pair->begin_step();
}

void SurfaceContacts::begin_sweeps() {
  surfaces_.take_velocities();
  for (TouchingRecord& record : scratch_.records) record.given.is_last = false;
}

void SurfaceContacts::collect(Real h) {
  scratch_.pairs.clear();
  scratch_.particles.clear();
  for (const SurfaceContact& contact : island_.surfaces) {
    contact.pair->visit_near([&](FeaturePair& q, Real reach) {
      const ClosestPoints closest = contact.pair->find_closest(q);
      if (q.are_edges && !closest.is_interior && !q.is_lone) return;  // points and triangles are as near
      if (q.distance <= q.thickness + reach) add(contact, q, closest, nullptr, &q.memory, &q.record);
    });
    const bool is_held = std::find(held_inside_.begin(), held_inside_.end(), contact.pair) != held_inside_.end();
    if (!contact.pair->enclosed().empty() && !is_held) lead_out(contact);
  }
  for (TouchingPair& pair : scratch_.pairs) {
    pair.wanted = -pair.gap / h;
    if (pair.gap >= 0) continue;
    const Real recovery = (-pair.gap - lost_share * pair.thickness) / std::max(recovery_time, h);
    const Real fastest = pair.leads_out ? exit_speed : lost_thickness_speed,
               acceleration = pair.leads_out ? exit_acceleration : recovery_acceleration;
    pair.wanted =
        std::clamp<Real>(recovery, 0, std::min(fastest, std::max<Real>(speed_of(pair, 0), 0) + acceleration * h));
  }
}

void SurfaceContacts::add(const SurfaceContact& contact, const FeaturePair& q, const ClosestPoints& closest,
                          const Vector3* leads_out, ContactMemory* memory, int* kept_record) {
  const SurfacePair& surfaces = *contact.pair;
  const ContactSurface &one = surfaces.first(q), &two = surfaces.second(q);
  TouchingPair pair{.begin = scratch_.particles.size(),
                    .difference = closest.difference,
                    .thickness = q.thickness - surfaces.b().radius(),
                    .friction = surfaces.friction(),
                    .memory = memory,
                    .features = features_of(island_, contact, q, !memory),
                    .kept_record = kept_record,
                    .leads_out = leads_out != nullptr,
                    .body_a = contact.body_a,
                    .body_b = contact.rigid < 0 ? contact.body_b : contact.body_a};
  const Real distance = closest.difference.norm();
  pair.gap = (leads_out ? -distance : distance) - q.thickness;
  pair.axes.col(0) = leads_out ? *leads_out : surfaces.direction(q, closest);
  if (pair.axes.col(0).isZero(0)) return;
  const int of_first = q.from_b ? contact.body_b : contact.body_a,
            of_second = q.from_b ? contact.body_a : contact.body_b;
  const int size_of_first = q.are_edges ? 2 : 1;
  Vector3 at = Vector3::Zero();
  for (int k = 0; k < 4; ++k) {
    const bool is_of_first = k < size_of_first;
    const ContactSurface& surface = is_of_first ? one : two;
    if (surface.is_rigid()) continue;
    add_particles(surface.points()[q.points[k]], closest.weights[k], is_of_first ? of_first : of_second, pair.begin);
    at += std::abs(closest.weights[k]) * surface.position(q.points[k]);
    if (is_of_first) pair.of_first = scratch_.particles.size() - pair.begin;
  }
  pair.end = scratch_.particles.size();
  if (contact.rigid >= 0) {
    pair.rigid = &island_.rigid_bodies[contact.rigid];
    pair.rigid_weight = one.is_rigid() ? 1 : -1;
    pair.arm = at - pair.rigid->position;
  }
  make_normal_row(pair);
  if (!(pair.mobility > 0)) {
    scratch_.particles.resize(pair.begin);
    return;
  }
  pair.record = known_record(pair.features, *kept_record);
  scratch_.pairs.push_back(pair);
}

// Points of an embedded surface may share particles.
void SurfaceContacts::add_particles(const WeightedPoint& point, Real weight, int body, std::size_t begin) {
  Particles& particles = island_.bodies[body]->particles;
  for (int k = 0; k < point.size; ++k) {
    const int i = point.particles[k];
    Real* velocity = particles.velocities.data() + 4 * i;
    const Real share = weight * point.weights[k];
    const auto known =
        std::find_if(scratch_.particles.begin() + static_cast<std::ptrdiff_t>(begin), scratch_.particles.end(),
                     [&](const TouchingParticle& p) { return p.velocity == velocity; });
    if (known != scratch_.particles.end())
      known->weight += share;
    else
      scratch_.particles.push_back({velocity, particles.positions.data() + 4 * i, share, particles.inverse_masses[i]});
  }
}

// All in one direction, in which most of them have the shortest way out: each by its own, they would tear the body apart.
// Where there is no such direction they stay.
void SurfaceContacts::lead_out(const SurfaceContact& contact) {
  SurfacePair& pair = *contact.pair;
  struct Way {
    FeaturePair features;
    ClosestPoints closest;
    bool is_inside;
    int* record;
  };
  std::vector<Way> ways;
  Vector3 direction = Vector3::Zero();  // of a against b
  Real depths = 0;
  for (EnclosedPoint& enclosed : pair.enclosed()) {
    ContactSurface& around = enclosed.of_b ? pair.a() : pair.b();
    const ContactSurface::Nearest nearest =
        around.nearest((enclosed.of_b ? pair.b() : pair.a()).position(enclosed.point));
    if (nearest.triangle < 0) continue;
    const auto& [t0, t1, t2] = around.triangles()[nearest.triangle];
    const Vector3& inwards = nearest.closest.difference;
    const Vector3 outwards =
        (around.position(t1) - around.position(t0)).cross(around.position(t2) - around.position(t0));
    ways.push_back({{.points = {enclosed.point, t0, t1, t2},
                     .are_edges = false,
                     .from_b = enclosed.of_b,
                     .thickness = pair.kept_distance()},
                    nearest.closest,
                    inwards.dot(outwards) < 0,
                    &enclosed.record});
    if (!ways.back().is_inside) continue;
    direction += enclosed.of_b ? inwards : Vector3(-inwards);
    depths += inwards.norm();
  }
  const Real size = direction.norm();
  if (!(size > common_direction * depths)) return;
  direction /= size;
  for (const Way& way : ways)
    if (way.is_inside) {
      const Vector3 out = way.features.from_b ? Vector3(-direction) : direction;
      add(contact, way.features, way.closest, &out, nullptr, way.record);
    } else {
      add(contact, way.features, way.closest, nullptr, nullptr, way.record);
    }
}

Real SurfaceContacts::gravity_of_quiet() const {
  Real gravity = 0;
  for (const SteppedBody* body : island_.bodies) {
    const Real fastest = body->options.settling_speed;
    if (kinetic_energy(body->particles.velocities, body->particles.inverse_masses) >=
        body->mass / 2 * fastest * fastest * body->gravity.norm() * body->size)
      return std::numeric_limits<Real>::infinity();
    gravity = std::max(gravity, body->gravity.norm());
  }
  return gravity;
}

// That of a distance in a drift, relative to the thickness: where all is as slow as what settles, what sweeps leave is seen.
Real SurfaceContacts::quiet_change(Real h) const {
  constexpr Real least_change = 1e-7;  // round-off
  Real thickness = std::numeric_limits<Real>::infinity();
  for (const TouchingPair& pair : scratch_.pairs) thickness = std::min(thickness, pair.thickness);
  return std::max(unseen_share * quiet_gravity_ * h * h / thickness, least_change);
}

bool SurfaceContacts::converge(Real h, Real since, const RigidSweep& rigid_sweep) {
  bool changed = false;
  Real first = 0;
  const Real quiet = quiet_change(h);
  start(since);
  for (int sweep = 0; sweep < most_surface_sweeps && !scratch_.pairs.empty(); ++sweep) {
    const bool again = rigid_sweep();
    bool hit = false;
    const Real worst = sweep_pairs(h, hit);
    changed = changed || hit || again;
    if (again) continue;
    if (!hit) break;
    if (first == 0) first = worst;
    if (worst < tolerance && worst < quiet && (worst < relative_tolerance * first || worst < negligible_share)) break;
  }
  for (int sweep = 0; rigid_sweep() && sweep < most_surface_sweeps; ++sweep) {
  }
  for (TouchingPair& pair : scratch_.pairs) {
    if (pair.given > 0 && pair.record < 0) {
      open_record(pair);
      *pair.kept_record = pair.record;
    }
    if (pair.memory)
      pair.memory->keep(pair.given * pair.axes.col(0) + pair.axes.rightCols<2>() * pair.rubbed, pair.axes.col(0),
                        since);
    changed = changed || pair.given > 0;
  }
  return changed || !island_.contacts.empty() || !island_.rigid_contacts.empty();
}

// Returns the largest change of a distance in the drift, relative to its thickness.
Real SurfaceContacts::sweep_pairs(Real h, bool& hit) {
  Real worst = 0;
  for (TouchingPair& pair : scratch_.pairs) {
    const Real speed = speed_of(pair, 0);
    if (speed >= pair.wanted && pair.given == 0) continue;
    const Real given = std::max<Real>(pair.given + (pair.wanted - speed) / pair.mobility, 0);
    if (given == pair.given) continue;
    hit = true;
    worst = std::max(worst, std::abs(given - pair.given) * pair.mobility * h / pair.thickness);
    press(pair, given, speed);
    if (pair.friction > 0 && !pair.leads_out) rub(pair);
  }
  return worst;
}

}  // namespace penalty
