#include "penalty/contact/surface_pair.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace penalty {
namespace {

constexpr Real largest_thickness = 0.3, smallest_thickness = 0.01;  // share of the mean edge of the finer surface
constexpr Real apart_at_rest = 1e-3;  // likewise: features of one surface that are nearer lie on each other
constexpr Real rest_share = 0.8;      // of the distance at rest, that features of one surface keep at most
constexpr Real refresh_ahead = 1.5;   // motions of a drift that near pairs must leave before they are found anew,
constexpr Real room_ahead = 3;        // and of these, how many near pairs hold after that
constexpr Real least_room = 0.5;      // of the thickness
constexpr Real least_ahead = 0.5, most_ahead = 0.5;  // a search looks ahead: share of the thickness, of the mean edge
constexpr Real coplanar = 1e-13;  // volume of four points that counts as none, relative to their distances cubed

enum Mark : char { is_pierced = 1, is_enclosed = 2 };  // of points

Real mean_edge_of_finer(const ContactSurface& a, const ContactSurface& b) {
  if (a.edges().empty()) return b.mean_edge();
  return b.edges().empty() || b.is_rigid() ? a.mean_edge() : std::min(a.mean_edge(), b.mean_edge());
}

Real volume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

}  // namespace

SurfacePair::SurfacePair(ContactSurface& a, ContactSurface& b) : a_(&a), b_(&b), edge_(mean_edge_of_finer(a, b)) {
  std::vector<Box> boxes;
  for (int k = 0; k < static_cast<int>(b.patches().size()); ++k) boxes.push_back(b.box_of_patch(k));
  patch_tree_ = BoxTree(boxes);
}

ClosestPoints SurfacePair::closest(const FeaturePair& q) const {
  const ContactSurface &one = first(q), &two = second(q);
  const auto& p = q.points;
  return q.are_edges
             ? closest_points_of_edges(one.position(p[0]), one.position(p[1]), two.position(p[2]), two.position(p[3]))
             : closest_points_of_triangle(one.position(p[0]), two.position(p[1]), two.position(p[2]),
                                          two.position(p[3]));
}

ClosestPoints SurfacePair::find_closest(FeaturePair& q) const {
  const ClosestPoints found = closest(q);
  q.difference = found.difference;
  q.distance = found.difference.norm();
  q.found_at = instant();
  return found;
}

void SurfacePair::find_difference(FeaturePair& q) const {
  if (q.found_at != instant()) find_closest(q);
}

Real SurfacePair::rest_distance(const FeaturePair& q) const {
  const auto at = [&](int k) { return a_->rest_position(q.points[k]); };
  return (q.are_edges ? closest_points_of_edges(at(0), at(1), at(2), at(3))
                      : closest_points_of_triangle(at(0), at(1), at(2), at(3)))
      .difference.norm();
}

Real SurfacePair::relative_speed(const Couple& c) const {
  const SurfacePatch &a = patch_a(c), &b = patch_b(c);
  return a.speed + b.speed + (&a == &b ? 0 : (a.mean_velocity - b.mean_velocity).norm());
}

// What a distance may have changed by.
Real SurfacePair::used_since(const Couple& c, const Account& then) const {
  const Account now = account_of(c);
  return now.path - then.path + (now.shift - then.shift).norm();
}

void SurfacePair::see_motion(Couple& c) const {
  c.moved += used_since(c, c.seen);
  c.seen = account_of(c);
}

// Of any two patches: twice the largest of one against all of them.
Real SurfacePair::largest_relative_speed() const {
  Vector3 mean = Vector3::Zero();
  Real count = 0, largest = 0;
  visit_patches([&](const SurfacePatch& patch) {
    mean += patch.mean_velocity;
    ++count;
  });
  mean /= count;
  visit_patches([&](const SurfacePatch& patch) {
    largest = std::max(largest, patch.speed + (patch.mean_velocity - mean).norm());
  });
  return 2 * largest;
}

Real SurfacePair::used_by_patches() const {
  Vector3 mean = Vector3::Zero();
  std::size_t k = 0;
  visit_patches([&](const SurfacePatch& patch) { mean += patch.shift - found_[k++].shift; });
  mean /= static_cast<Real>(found_.size());
  Real largest = 0;
  k = 0;
  visit_patches([&](const SurfacePatch& patch) {
    largest = std::max(largest, patch.path - found_[k].path + (patch.shift - found_[k].shift - mean).norm());
    ++k;
  });
  return 2 * largest;
}

// All patches that may be as near as `within` are in a couple after that; it looks `ahead` as much further.
void SurfacePair::find_couples(Real within, Real ahead) {
  if (!found_.empty() && found_within_ - used_by_patches() >= within) return;
  found_within_ = within + ahead;
  found_.clear();
  visit_patches([&](const SurfacePatch& patch) { found_.push_back({patch.path, patch.shift}); });
  patch_tree_.refit([&](int k) { return b_->box_of_patch(k); });
  std::vector<Couple> couples;
  const auto before = [](const Couple& l, const Couple& r) { return l.a != r.a ? l.a < r.a : l.b < r.b; };
  for (int i = 0; i < static_cast<int>(a_->patches().size()); ++i)
    patch_tree_.visit(a_->box_of_patch(i), found_within_, [&](int j) {
      if (is_self() && j < i) return;
      Couple& couple = couples.emplace_back();
      couple.a = i;
      couple.b = j;
      see_motion(couple);
    });
  std::sort(couples.begin(), couples.end(), before);
  for (Couple& couple : couples) {
    const auto known = std::lower_bound(couples_.begin(), couples_.end(), couple, before);
    if (known != couples_.end() && known->a == couple.a && known->b == couple.b) couple = std::move(*known);
  }
  couples_ = std::move(couples);
}

void SurfacePair::forget() {
  couples_.clear();
  found_.clear();
}

void SurfacePair::begin_step() {
  Real thickness = b_->is_rigid() ? a_->margin : (a_->margin + b_->margin) / 2;
  if (edge_ > 0 && !b_->is_rigid()) thickness = std::min(thickness, largest_thickness * edge_);
  thickness = std::max(thickness, smallest_thickness * edge_);
  const bool moved = epoch_a_ != a_->epoch() || epoch_b_ != b_->epoch() || thickness != thickness_;
  thickness_ = thickness;
  epoch_a_ = a_->epoch();
  epoch_b_ = b_->epoch();
  if (moved || is_tangled_) {
    untangle();
    forget();
  }
}

bool SurfacePair::pierces(const ContactSurface& edges, int edge, const ContactSurface& triangles, int triangle) const {
  const auto& [e0, e1] = edges.edges()[edge];
  const auto& [t0, t1, t2] = triangles.triangles()[triangle];
  if (&edges == &triangles)
    for (const int t : {t0, t1, t2})
      if (t == e0 || t == e1) return false;
  const Vector3 p = edges.position(e0), q = edges.position(e1);
  const Vector3 a = triangles.position(t0), b = triangles.position(t1), c = triangles.position(t2);
  const Real size = (q - p).norm() + (b - a).norm() + (c - a).norm(), none = coplanar * size * size * size;
  const Real sp = volume(a, b, c, p), sq = volume(a, b, c, q);
  if (!(sp > none && sq < -none) && !(sp < -none && sq > none)) return false;
  const Real u = volume(p, q, a, b), v = volume(p, q, b, c), w = volume(p, q, c, a);
  return (u > none && v > none && w > none) || (u < -none && v < -none && w < -none);
}

void SurfacePair::mark_pierced(ContactSurface& edges, ContactSurface& triangles, std::vector<char>& edge_marks,
                               std::vector<char>& triangle_marks) {
  for (int i = 0; i < static_cast<int>(edges.patches().size()); ++i)
    for (int j = 0; j < static_cast<int>(triangles.patches().size()); ++j) {
      if (!edges.box_of_patch(i).overlaps(triangles.box_of_patch(j), 0)) continue;
      const SurfacePatch& with = triangles.refitted(j);
      for (const int e : edges.patches()[i].edges)
        with.triangle_tree.visit(edges.box_of_edge(e), 0, [&](int k) {
          const int t = with.triangles[k];
          if (!pierces(edges, e, triangles, t)) return;
          for (const int point : edges.edges()[e]) edge_marks[point] = is_pierced;
          for (const int point : triangles.triangles()[t]) triangle_marks[point] = is_pierced;
          is_tangled_ = true;
        });
    }
}

// Only points in the other's box are asked.
void SurfacePair::mark_enclosed(const ContactSurface& points, ContactSurface& closed, std::vector<char>& marks) {
  Box box;
  for (int k = 0; k < closed.num_points(); ++k) box.add(closed.position(k));
  for (const SurfacePatch& patch : points.patches())
    for (const int point : patch.points) {
      const Vector3 x = points.position(point);
      if (!box.contains(x, 0) || !(closed.winding_number(x) > 0.5)) continue;
      const Real distance = closed.nearest(x).closest.difference.norm();
      if (distance < on_surface * thickness_) continue;
      if (!is_tangled_ && !(distance < points.radius() - thickness_)) continue;
      marks[point] = is_enclosed;
      enclosed_.push_back({point, &points == b_, distance + points.radius()});
    }
}

// What does not pierce the other and yet lies inside, as a ball in a balloon, is where it should be; but not a ball that
// reaches out.
void SurfacePair::untangle() {
  is_tangled_ = false;
  enclosed_.clear();
  tangled_a_.assign(a_->num_points(), 0);
  if (is_self()) {
    mark_pierced(*a_, *a_, tangled_a_, tangled_a_);
    return;
  }
  tangled_b_.assign(b_->num_points(), 0);
  mark_pierced(*a_, *b_, tangled_a_, tangled_b_);
  mark_pierced(*b_, *a_, tangled_b_, tangled_a_);
  if (!is_tangled_ && !(b_->radius() > 0)) return;
  if (b_->is_closed()) mark_enclosed(*a_, *b_, tangled_a_);
  if (a_->is_closed()) mark_enclosed(*b_, *a_, tangled_b_);
  is_tangled_ = is_tangled_ || !enclosed_.empty();
}

// What pierces, and whatever an enclosed point meets on its way out.
bool SurfacePair::may_pass(const FeaturePair& q) const {
  if (!is_tangled_) return false;
  const std::vector<char>& b_marks = is_self() ? tangled_a_ : tangled_b_;
  const std::vector<char>&one = q.from_b ? b_marks : tangled_a_, &two = q.from_b ? tangled_a_ : b_marks;
  const auto& p = q.points;
  const char of_first = q.are_edges ? std::max(one[p[0]], one[p[1]]) : one[p[0]];
  const char of_second = q.are_edges ? std::max(two[p[2]], two[p[3]]) : std::max({two[p[1]], two[p[2]], two[p[3]]});
  return (of_first != 0 && of_second != 0) || of_first == is_enclosed || of_second == is_enclosed;
}

Real SurfacePair::closing_speed(Real duration) {
  find_couples(kept_distance() + duration * largest_relative_speed(), thickness_);
  Real largest = 0;
  for (const Couple& c : couples_) {
    // Patches that are neighbours at rest always move a little against each other.
    if (is_self() && c.near.empty() && patch_a(c).rest_box.overlaps(patch_b(c).rest_box, 0)) continue;
    const Real speed = relative_speed(c);
    if (speed > largest && a_->box_of_patch(c.a).gap_to(b_->box_of_patch(c.b)) <= speed * duration + kept_distance())
      largest = speed;
  }
  return largest;
}

bool SurfacePair::refresh(Real h, Real remaining) {
  const Real speed = largest_relative_speed();
  find_couples(kept_distance() + refresh_ahead * h * speed, std::max(thickness_, speed * remaining));
  bool changed = false;
  has_near_ = false;
  for (Couple& c : couples_) {
    see_motion(c);
    c.motion = h * relative_speed(c);
    if (!c.is_refreshed || used_since(c, c.refreshed) + refresh_ahead * c.motion > c.room) {
      refresh(c, refresh_ahead * c.motion, refresh_ahead * c.motion * (remaining / h));
      changed = true;
    }
    has_near_ = has_near_ || !c.near.empty();
  }
  return changed;
}

void SurfacePair::refresh(Couple& c, Real need, Real ahead) {
  c.room = std::max(least_room * thickness_, room_ahead * need);
  const Real want = kept_distance() + c.room;
  Real used = c.is_searched ? used_since(c, c.searched) : 0;
  if (!c.is_searched || used + want > c.reach) {
    search(c, want, ahead);
    used = 0;
  }
  pressed_.clear();
  for (const FeaturePair& q : c.near)
    if (!q.memory.is_empty()) pressed_.push_back(q);
  c.near.clear();
  for (FeaturePair& q : c.candidates) {
    if (q.at_search - used > want) break;
    find_difference(q);
    q.floor = q.distance + c.moved;
    if (!q.is_measured) {
      q.thickness = std::min(q.thickness, rest_share * rest_distance(q));
      q.is_measured = true;
    }
    // What lies on each other at rest, as doubled vertices do, is no contact.
    if (q.distance >= q.thickness + c.room || q.thickness < apart_at_rest * edge_) continue;
    c.near.push_back(q);
    for (const FeaturePair& old : pressed_)
      if (old.points == q.points && old.are_edges == q.are_edges && old.from_b == q.from_b)
        std::tie(c.near.back().memory, c.near.back().record) = std::tie(old.memory, old.record);
  }
  c.refreshed = account_of(c);
  c.is_refreshed = true;
}

void SurfacePair::search(Couple& c, Real want, Real ahead) {
  const Real least = least_ahead * thickness_;
  c.reach = want + std::clamp(ahead, least, std::max(least, most_ahead * edge_));
  c.candidates.clear();
  const Real gap = &patch_a(c) == &patch_b(c) ? 0 : a_->box_of_patch(c.a).gap_to(b_->box_of_patch(c.b));
  if (gap > c.reach) {
    c.reach = gap;  // nothing until then: as good as a search that far
  } else {
    search_points(c, false);
    if (&patch_a(c) != &patch_b(c)) search_points(c, true);
    search_edges(c);
    std::stable_sort(c.candidates.begin(), c.candidates.end(),
                     [](const FeaturePair& l, const FeaturePair& r) { return l.at_search < r.at_search; });
  }
  c.is_searched = true;
  c.searched = account_of(c);
}

// Points of one patch at triangles of the other.
void SurfacePair::search_points(Couple& c, bool from_b) {
  ContactSurface& one = from_b ? *b_ : *a_;
  ContactSurface& two = from_b ? *a_ : *b_;
  const SurfacePatch& from = one.patches()[from_b ? c.b : c.a];
  const SurfacePatch& with = two.refitted(from_b ? c.a : c.b);
  for (const int point : from.points) {
    Box box;
    box.add(one.position(point));
    if (!box.overlaps(with.box, c.reach)) continue;
    with.triangle_tree.visit(box, c.reach, [&](int k) {
      const auto& [t0, t1, t2] = two.triangles()[with.triangles[k]];
      if (is_self() && (t0 == point || t1 == point || t2 == point)) return;
      add(c, {.points = {point, t0, t1, t2}, .are_edges = false, .from_b = from_b});
    });
  }
}

void SurfacePair::search_edges(Couple& c) {
  const SurfacePatch& from = patch_a(c);
  const SurfacePatch& with = b_->refitted(c.b);
  for (std::size_t i = 0; i < from.edges.size(); ++i) {
    const Box box = a_->box_of_edge(from.edges[i]);
    if (!box.overlaps(with.box, c.reach)) continue;
    with.edge_tree.visit(box, c.reach, [&](int k) {
      if (&from == &with && static_cast<std::size_t>(k) <= i) return;
      const Edge &p = a_->edges()[from.edges[i]], &q = b_->edges()[with.edges[k]];
      if (is_self() && (p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1])) return;
      add(c, {.points = {p[0], p[1], q[0], q[1]},
              .are_edges = true,
              // The corners of a rigid body meet triangles, and points its edges by other means.
              .is_lone = !a_->has_triangle(from.edges[i]) || (!b_->is_rigid() && !b_->has_triangle(with.edges[k]))});
    });
  }
}

void SurfacePair::add(Couple& c, FeaturePair q) const {
  if (may_pass(q)) return;
  q.thickness = kept_distance();
  q.is_measured = !is_self();
  find_difference(q);
  q.at_search = q.distance;
  if (q.at_search <= c.reach) c.candidates.push_back(q);
}

}  // namespace penalty
