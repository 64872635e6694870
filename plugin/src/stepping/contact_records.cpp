// Where and how deep it touches at the end of a step, and what that gave.
#include <algorithm>
#include <utility>

#include "particle_contacts.h"
#include "surface_contacts.h"

namespace penalty {
namespace {

constexpr Real most_sliding = 0.5;  // share of the impulse with friction at its limit, beyond which a contact slides

ContactRecord record_of(const ContactImpulse& given) {
  return {.normal = given.pressed.normalized(),
          .impulse = given.sum(),
          .slides = given.sliding > most_sliding * given.pressing,
          .still_presses = given.is_last};
}

void book_depth(const Island& island, int body, Real depth) {
  if (body < 0) return;
  StepReport& report = island.bodies[body]->report;
  report.contact_depth = std::max(report.contact_depth, depth);
}

void add_records(const Island& island, std::vector<ContactRecord>& records) {
  for (const Contact& contact : island.contacts) {
    if (contact.given.is_none()) continue;
    const ContactPlace place = place_of(contact, island);
    ContactRecord& record = records.emplace_back(record_of(contact.given));
    record.body = contact.a.body;
    record.other_body = contact.b.body;
    record.other_rigid = contact.b.rigid;
    record.point = place.at;
    record.gap = place.gap;
  }
}

ContactRecord record_of(const Island& island, const TouchingRecord& touching) {
  const TouchingFeatures& features = touching.features;
  const SurfaceContact& contact = island.surfaces[features.contact];
  const SurfacePair& pair = *contact.pair;
  FeaturePair q{.points = features.points, .are_edges = features.are_edges, .from_b = features.from_b};
  const ContactSurface &one = pair.first(q), &two = pair.second(q);
  const ClosestPoints closest = pair.find_closest(q);
  const Real distance = q.distance;
  const int size_of_first = q.are_edges ? 2 : 1;
  Vector3 at_first = Vector3::Zero(), at_second = Vector3::Zero();
  for (int k = 0; k < 4; ++k)
    (k < size_of_first ? at_first : at_second) +=
        std::abs(closest.weights[k]) * (k < size_of_first ? one : two).position(q.points[k]);

  ContactRecord record = record_of(touching.given);
  const int of_first = q.from_b ? contact.body_b : contact.body_a;
  record.body = of_first >= 0 ? of_first : contact.body_a;
  record.other_body = q.from_b ? contact.body_a : contact.body_b;
  record.other_rigid = contact.rigid;
  if (contact.rigid >= 0) record.other_body = -1;
  if (of_first < 0) {  // the first feature is of the rigid body
    record.normal *= -1;
    record.impulse *= -1;
  }
  record.point = contact.rigid < 0 ? Vector3((at_first + at_second) / 2) : one.is_rigid() ? at_second : at_first;
  const bool is_inside = features.is_enclosed && closest.difference.dot(touching.given.pressed) < 0;
  record.gap = (is_inside ? -distance : distance) - touching.thickness;
  return record;
}

}  // namespace

void report_particle_contacts(Island& island) {
  for (const Contact& contact : island.contacts) {
    const ContactPlace place = place_of(contact, island);
    for (const int body : {contact.a.body, contact.b.body}) {
      if (body < 0) continue;
      ++island.bodies[body]->report.num_contacts;
      book_depth(island, body, -place.gap);
    }
  }
}

void find_records(Island& island) {
  island.records.clear();
  add_records(island, island.records);
  if (island.surfaces.empty() || !island.surface_scratch) return;
  for (const TouchingRecord& touching : island.surface_scratch->records)
    island.records.push_back(record_of(island, touching));
}

// Closest points are those of the last sweeps, which were where the step ends.
void SurfaceContacts::report() {
  if (is_empty()) return;
  scratch_.num_touching = static_cast<int>(scratch_.pairs.size());
  for (const TouchingPair& pair : scratch_.pairs) book_touching(island_, pair.body_a, pair.body_b, -pair.gap);
  for (const SurfaceContact& contact : island_.surfaces) report_enclosed(contact);
  merge(scratch_.records);
}

// Also of what no pair holds: points that are not led out, be it that the particles hold the body that they are of.
void SurfaceContacts::report_enclosed(const SurfaceContact& contact) {
  const SurfacePair& pair = *contact.pair;
  for (const EnclosedPoint& enclosed : std::as_const(pair).enclosed()) {
    ContactSurface& around = enclosed.of_b ? pair.a() : pair.b();
    const Vector3& x = (enclosed.of_b ? pair.b() : pair.a()).position(enclosed.point);
    if (!(around.winding_number(x) > 0.5)) continue;
    const Real depth = around.nearest(x).closest.difference.norm() + pair.kept_distance();
    for (const int body : {contact.body_a, contact.body_b}) book_depth(island_, body, depth);
  }
}

void book_touching(const Island& island, int body_a, int body_b, Real depth) {
  for (const int body : {body_a, body_b == body_a ? -1 : body_b}) {
    if (body >= 0) ++island.bodies[body]->report.num_contacts;
    book_depth(island, body, depth);
  }
}

void merge(std::vector<TouchingRecord>& records) {
  std::ranges::sort(records, {}, [](const TouchingRecord& record) { return record.features.key(); });
  std::size_t last = 0;
  for (std::size_t k = 1; k < records.size(); ++k)
    if (records[last].features.are(records[k].features)) {
      records[last].given.add(records[k].given);
    } else {
      records[++last] = records[k];
    }
  if (!records.empty()) records.resize(last + 1);
}

TouchingFeatures features_of(const Island& island, const SurfaceContact& contact, const FeaturePair& q,
                             bool is_enclosed) {
  return {.contact = static_cast<int>(&contact - island.surfaces.data()),
          .points = q.points,
          .are_edges = q.are_edges,
          .from_b = q.from_b,
          .is_enclosed = is_enclosed};
}

void SurfaceContacts::open_record(TouchingPair& pair) {
  const Real radius = island_.surfaces[pair.features.contact].pair->b().radius();
  scratch_.records.push_back({pair.features, pair.thickness + radius, {}});
  pair.record = static_cast<int>(scratch_.records.size()) - 1;
}

// The number that features carry may be that of others, of an earlier step.
int SurfaceContacts::known_record(const TouchingFeatures& features, int number) const {
  if (number < 0 || static_cast<std::size_t>(number) >= scratch_.records.size()) return -1;
  TouchingFeatures& known = scratch_.records[number].features;
  if (!known.are(features)) return -1;
  known = features;  // an enclosed point may be at another triangle by now
  return number;
}

// Of what moves as one body only the sum is known.
void SurfaceContacts::record(const TouchingFeatures& features, Real thickness, const Vector3& given) {
  if (given.isZero(0)) return;
  scratch_.records.push_back({features, thickness, {}});
  scratch_.records.back().given.add(given.normalized(), given.norm(), Vector3::Zero(), false);
}

void SurfaceContacts::record(TouchingPair& pair) {
  if (pair.record < 0) open_record(pair);
  const Vector3 along_axes(pair.given, pair.rubbed.x(), pair.rubbed.y()), normal = pair.axes.col(0);
  Vector3 sum = pair.axes * along_axes;
  if (!pair.rigid) {  // what keeps the pair from turning gives the features something, too
    sum.setZero();
    for (const TouchingParticle& p : particles_of(pair).first(pair.of_first)) sum += p.rows * along_axes;
  }
  scratch_.records[pair.record].given.add(
      normal, pair.given, sum - pair.given * normal,
      pair.inertia.isZero(0) || is_at_limit(pair.rubbed.norm(), pair.friction * pair.given));
}

}  // namespace penalty
