// What is near what between two surfaces, or within one: kept from substep to substep, and from step to step.
#pragma once
#include <cstdint>

#include "penalty/contact/closest_points.h"
#include "penalty/contact/contact.h"
#include "penalty/contact/contact_surface.h"

namespace penalty {

/// A point and a triangle, or two edges.
struct FeaturePair {
  std::array<int, 4> points;  // point, triangle; or edge, edge
  bool are_edges;
  bool from_b = false;                   // the first feature belongs to surface b, the second to a
  bool is_lone = false;                  // edges of which one is of no triangle
  bool is_measured = false;              // `thickness` is final
  Real thickness = 0;                    // distance that is kept, the radius of a rigid surface included [m]
  Real at_search = 0;                    // distance then [m]
  Vector3 difference = Vector3::Zero();  // between the closest points when they were found last [m],
  Real distance = 0, floor = 0;          // how long it was, and that with all that its patches had moved until then [m]
  std::uint64_t found_at = 0;
  ContactMemory memory = {};  // of an impulse on the first
  int record = -1;            // number of what it gave in the step, if it is that of these features
};

/// A point of one surface that lies inside the other, which is closed.
struct EnclosedPoint {
  int point;
  bool of_b;
  Real depth;       // when the step began, the radius of a rigid surface included [m]
  int record = -1;  // as of features
};

/// Pairs of features of two surfaces, found in three steps, each of which looks further ahead than the next and is
/// repeated only when what it left out may have come near: couples of patches whose boxes are near, candidates of a
/// couple from a search of its trees, and of these the near pairs, which may touch soon. Patches keep account of the
/// largest motion of their points, about their mean velocity, and of that mean. So no pair whose distance may have come
/// below what a substep moves is ever left out.
class SurfacePair {
 public:
  /// The same surface twice: pairs within it, but for those that share a point. `b` may be of a rigid body, `a` not.
  SurfacePair(ContactSurface& a, ContactSurface& b);

  ContactSurface& a() const { return *a_; }
  ContactSurface& b() const { return *b_; }
  bool is_self() const { return a_ == b_; }
  const ContactSurface& first(const FeaturePair& q) const { return q.from_b ? *b_ : *a_; }
  const ContactSurface& second(const FeaturePair& q) const { return q.from_b ? *a_ : *b_; }
  /// That of q.points[k].
  const ContactSurface& surface_of(const FeaturePair& q, int k) const {
    return k < (q.are_edges ? 2 : 1) ? first(q) : second(q);
  }

  /// That is kept, beyond the radius of a rigid surface, where rest shapes leave room for it [m].
  Real thickness() const { return thickness_; }
  Real kept_distance() const { return thickness_ + b_->radius(); }
  Real friction() const { return a_->friction * b_->friction; }

  /// Begins a step, at positions that were taken: what was known is dropped if a surface was moved by others, or margins
  /// have changed. Then, and as long as they do, it is looked for features that pierce each other: those are left to pass.
  void begin_step();
  bool is_tangled() const { return is_tangled_; }
  std::span<const EnclosedPoint> enclosed() const { return enclosed_; }
  std::span<EnclosedPoint> enclosed() { return enclosed_; }

  /// Largest speed at which patches that may meet within `duration` [s] come together [m/s].
  Real closing_speed(Real duration);

  /// Before a drift of h [s], at velocities that were taken: makes near pairs hold all that may touch. `remaining` [s] of
  /// the step is what a search may look ahead. Returns whether lists changed.
  bool refresh(Real h, Real remaining);
  bool has_near() const { return has_near_; }

  /// Calls visit(pair, limit) for each pair that may be as near as `limit` [m] beyond its thickness: a distance larger
  /// than what the coming drift can change.
  template <class Visit>
  void visit_near(const Visit& visit) {
    for (Couple& couple : couples_) {
      const Real reach = motion_reserve * couple.motion;
      for (FeaturePair& q : couple.near) {
        if (q.floor - couple.moved > q.thickness + reach) continue;
        visit(q, reach);
        if (q.found_at == instant()) q.floor = q.distance + couple.moved;
      }
    }
  }

  /// No features remember anything.
  void forget_memory() {
    for (Couple& couple : couples_)
      for (FeaturePair& q : couple.near) q.memory = {};
  }

  ClosestPoints closest(const FeaturePair& q) const;
  /// The same; the difference is kept in the pair.
  ClosestPoints find_closest(FeaturePair& q) const;
  /// Sets no more than the difference, if it is not that of where they are.
  void find_difference(FeaturePair& q) const;

  /// Whether features at this distance [m] lie on each other: the way between their points is round-off, and its direction
  /// says nothing. Closed surfaces know their outside, so they can afford to ask for more.
  bool has_no_direction(const FeaturePair& q, Real distance) const { return distance <= least_distance(q); }
  Real least_distance(const FeaturePair& q) const {
    const bool knows_outside = second(q).is_closed() && (!q.are_edges || first(q).is_closed());
    return (knows_outside ? on_surface : round_off) * q.thickness;
  }

  /// Unit vector from the second feature to the first: between these closest points or, where that says nothing, out of a
  /// closed surface; zero where there is no telling.
  Vector3 direction(const FeaturePair& q, const ClosestPoints& closest) const;

  /// How much of a drift of h [s], at velocities that were taken, features may do: all of it, which is 1, if they come
  /// together by less than what is between them, or are behind a plane each, some way apart, at its start and its end. Linear
  /// motions that are separated by a plane at both ends are so throughout. Else what one such plane allows. `reach`: what
  /// their distance can change by [m].
  Real separated_share(FeaturePair& q, Real h, Real reach) const;

 private:
  static constexpr Real on_surface = 1e-3, round_off = 1e-9;

  static constexpr Real motion_reserve = 1.2;

  /// How far patches have moved: see SurfacePatch.
  struct Account {
    Real path = 0;
    Vector3 shift = Vector3::Zero();
  };

  /// Two patches, or one and itself.
  struct Couple {
    int a = 0, b = 0;
    bool is_refreshed = false, is_searched = false;
    Real room = 0;                              // near pairs: all that were nearer than thickness + room
    Real reach = 0;                             // candidates: all that were nearer than that
    Account refreshed, searched, seen;          // of both, b against a, when that was done last
    Real motion = 0;                            // what distances can change by in this drift,
    Real moved = 0;                             // and by all that was seen so far, each drift by itself
    std::vector<FeaturePair> candidates, near;  // candidates by distance
  };

  /// Both only grow: the sum tells whether either did.
  std::uint64_t instant() const { return a_->instant() + b_->instant(); }

  const SurfacePatch& patch_a(const Couple& c) const { return a_->patches()[c.a]; }
  const SurfacePatch& patch_b(const Couple& c) const { return b_->patches()[c.b]; }
  template <class Visit>
  void visit_patches(const Visit& visit) const {
    for (const SurfacePatch& patch : a_->patches()) visit(patch);
    if (!is_self())
      for (const SurfacePatch& patch : b_->patches()) visit(patch);
  }
  Real largest_relative_speed() const;
  Real used_by_patches() const;
  void find_couples(Real within, Real ahead);
  Real relative_speed(const Couple& c) const;
  Account account_of(const Couple& c) const {
    return {patch_a(c).path + patch_b(c).path, patch_b(c).shift - patch_a(c).shift};
  }
  void see_motion(Couple& c) const;
  Real used_since(const Couple& c, const Account& then) const;
  void forget();
  void untangle();
  bool pierces(const ContactSurface& edges, int edge, const ContactSurface& triangles, int triangle) const;
  void mark_pierced(ContactSurface& edges, ContactSurface& triangles, std::vector<char>& edge_marks,
                    std::vector<char>& triangle_marks);
  void mark_enclosed(const ContactSurface& points, ContactSurface& closed, std::vector<char>& marks);
  bool may_pass(const FeaturePair& q) const;
  void refresh(Couple& c, Real need, Real ahead);
  void search(Couple& c, Real want, Real ahead);
  void search_points(Couple& c, bool from_b);
  void search_edges(Couple& c);
  void add(Couple& c, FeaturePair q) const;
  Real rest_distance(const FeaturePair& q) const;

  ContactSurface* a_;
  ContactSurface* b_;
  Real thickness_ = 0, edge_ = 0;
  std::vector<Couple> couples_;  // by their patches
  std::vector<Account> found_;   // of all patches when couples were found; empty: couples are still to be found
  Real found_within_ = 0;        // patches of no couple were further apart then [m]
  BoxTree patch_tree_;           // of b
  std::uint64_t epoch_a_ = 0, epoch_b_ = 0;
  bool has_near_ = false, is_tangled_ = false;
  std::vector<FeaturePair> pressed_;         // of a couple whose near pairs are found anew
  std::vector<char> tangled_a_, tangled_b_;  // marks of points; of the second only if it is another surface
  std::vector<EnclosedPoint> enclosed_;
};

}  // namespace penalty
