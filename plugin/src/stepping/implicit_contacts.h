// Contacts in the minimisation of an implicit step.
#pragma once
#include <limits>
#include <span>
#include <vector>

#include "implicit_surfaces.h"
#include "penalty/stepping/linear_solver.h"
#include "surface_contacts.h"

namespace penalty {

/// A contact in an implicit step, see ImplicitContacts.
struct ImplicitContactRow {
  Contact* contact = nullptr;            // of soft bodies; else
  RigidContact* rigid = nullptr;         // between rigid ones; else
  const Anchor* anchor = nullptr;        // of a soft body at a rigid one; else
  TouchingFeatures features = {};        // of surfaces
  ContactMemory memory = {};             // of these, of the last step
  Real thickness = 0, kept = 0;          // distance that these keep, and that in this step [m]
  int soft_a = -1, soft_b = -1;          // soft bodies of the sides; -1: none
  RigidBody *a = nullptr, *b = nullptr;  // rigid ones; null: none
  Vector3 arm_a = Vector3::Zero(), arm_b = Vector3::Zero();
  ContactSides sides = {};
  Vector3 normal = Vector3::Zero();
  Matrix3 across = Matrix3::Zero();  // onto the directions of friction
  int presser = -1;                 // the row whose pressing limits this one, which resists turning; -1: presses itself
  Vector3 start = Vector3::Zero();  // J x0
  Vector3 place = Vector3::Zero();  // where impulses have their moments
  Vector3 way = Vector3::Zero();    // u
  Vector3 driven = Vector3::Zero();  // of that, what something outside does the work of
  Real gap = 0;                      // g0
  Real hardness = 0, friction = 0, limit = 0;
  Real hardening = 1;                                     // of it, in this step
  Real last_gap = std::numeric_limits<Real>::infinity();  // when multipliers were taken [m]
  Real pressing = 0;                                      // l
  Vector3 rubbing = Vector3::Zero();                      // its part across the normal
  Vector3 force = Vector3::Zero();                        // of the last linearisation
  Matrix3 stiffness = Matrix3::Zero();                    // likewise
  Real linear_pressing = 0;
  bool is_new = true, is_predicted = false;
};

/// What contacts gave a soft body in a step.
struct GivenInStep {
  Vector3 impulse = Vector3::Zero();  // [N s]
  Vector3 moment = Vector3::Zero();   // of that about the origin, where particles were at the start [N m s]
  Real work = 0, loss = 0;            // and what impact and friction lost of it, a share of what both bodies lost [J]

  Vector3 moment_about(const Vector3& center) const { return moment - center.cross(impulse); }
};

/// What it works in, and the first body of the island keeps.
struct ImplicitContactScratch {
  std::vector<ImplicitContactRow> rows, old_rows;
  std::vector<Real> inverse_masses, shares;
  std::vector<GivenInStep> given;
};

/// Contacts of soft bodies with rigid ones, with each other and with themselves, and of rigid ones with each other, as a
/// potential over a step of h. The gap is taken linear in the unknowns,
///
///     g(x) = g0 + n . (J (x - x0) - u),   s(x) = (1 - n nᵀ) (J (x - x0) - u),
///
/// J as in ContactSides, u the way in the step, there, of what takes no impulse. What resists turning has s alone. The normal n
/// is that of where the step begins; that of two features of surfaces, and their closest points, are those of where they were
/// `taken` last, which is done anew when the iterations have led far from there, or might lead through each other. The contact
/// is pressed by f = max(0, l - rho g), and rubbed by -rho s, shortened to a limit that is held while Newton's method
/// iterates: an energy with a continuous derivative, convex. The limit is what the linear model of the last iteration presses,
/// times the coefficient of friction; its stiffness at the limit is a secant, which is never less than the energy's. The
/// multipliers l, of which the friction has its own, begin with what the contact gave in the last step, and end as what it
/// gives in this one: what lies neither sinks nor creeps.
///
/// An anchor is the same without a normal, nor a limit of what would be friction: it holds in all directions.
///
/// rho is `hardness` times the inertia and stiffness that the contact works against, of the particles and of each body as
/// a whole: more would be met by no motion of the bodies.
class ImplicitContacts {
 public:
  /// `from`: the particles where the step begins. `surfaces`: those that may touch in this step; null: none.
  ImplicitContacts(Island& island, const PackedVectors& from, ImplicitSurfaces* surfaces, Real duration);

  bool is_empty() const { return rows_.empty() && !surfaces_; }

  /// Takes contacts of surfaces as they are at `x`, where these are, too.
  void take_surfaces(const PackedVectors& x);

  /// Sets rho, from the diagonal blocks of the stiffness of the bodies, inertia included.
  void set_hardness();

  /// Marks what is met in this step for the first time, faster than `negligible_speed`, and would be passed on the way to
  /// `targets`: the first direction of Newton's method then ends at the obstacle, not beyond it.
  void predict(const PackedVectors& targets, Real negligible_speed);

  /// Returns the energy [J] and adds its gradient [N].
  Real evaluate(const PackedVectors& x, PackedVectors& gradient) const;

  /// Adds the stiffness at `x`, and what is predicted to `forces`.
  void linearize(const PackedVectors& x, std::vector<ContactStiffness>& stiffness, PackedVectors& forces);

  /// Whether the last linearisation had any of these.
  bool were_predicted() const { return were_predicted_; }

  /// Which share of this way may be gone without a look at what is met.
  Real longest(const PackedVectors& direction);

  /// After a step of this length along `direction`, to `x`: what contacts press by their linear model.
  void follow(Real length, const PackedVectors& direction, const PackedVectors& x);

  /// Whether `longest` has cut the last step, and whether surfaces are still as they were taken, nearly.
  bool is_cut() const { return is_cut_; }
  bool fit(const PackedVectors& x);

  struct Change {
    Real limits = 0, sum = 0;  // of the limits of friction, and their sum [N]
    Real gap = 0;              // largest of what presses [m]
  };
  Change limit_change(const PackedVectors& x) const;

  /// Takes the limits anew, and, if `converged`, the multipliers. Where these have left a gap that is neither settled nor
  /// much less than before, rho grows: what is pressed on a light body by a heavy one has that one's inertia, too.
  void update(const PackedVectors& x, bool converged, Real settled_gap);

  /// Books what contacts gave until the positions `x`, gives it to rigid bodies, and remembers it.
  void finish(const PackedVectors& x);

  /// Whether what takes no impulse has given any.
  bool touch_immovable() const { return touch_immovable_; }

  /// What a soft body was given.
  const GivenInStep& given_to(std::size_t body) const { return given_[body]; }
  Real outside_work() const { return outside_work_; }  // of what moves and takes no impulse, of taking depth back [J]

 private:
  using Row = ImplicitContactRow;
  struct Force {
    Vector3 force;
    Real energy;
    Real pressing;
    Real rubbing_share;  // of what friction would be without its limit
  };
  void add(Row row, Real gap, Real deepest, bool bends);
  void start(Row& row, const Vector3& force);
  void add_turning(const RigidContact& contact, int presser);
  void add_anchors();
  Vector3 bent_way(const Row& row, const PackedVectors& x) const;
  static Vector3 bend_of(const Vector3& turn, const Vector3& arm);
  Real pressing_of_limit(const Row& row) const { return (row.presser < 0 ? row : rows_[row.presser]).linear_pressing; }
  void predict(Row& row) const;
  void add(const SurfaceContact& contact, FeaturePair& q, Real reach, const PackedVectors& x);
  Real kept_distance(const SurfaceContact& contact, const FeaturePair& q) const;
  static const Row* row_of(std::span<const Row> rows, const TouchingFeatures& features);
  std::span<const Row> rows_of_surfaces() const { return std::span(rows_).subspan(first_of_surfaces_); }
  Eigen::Index first_of(int body) const { return island_.bodies[body]->implicit.first; }
  bool is_of(int particle, int body) const;  // which has its own columns
  bool is_any_free(const ContactSides& sides) const;
  void give_to_soft(const Row& row, const Force& given, const Vector3& way, const PackedVectors& x);
  void give_moment(const Row& row, const Vector3& moment, const Vector3& way);
  void remember_features();
  Vector3 way_of(const RigidBody& body, const Vector3& arm, bool bends) const;
  Vector3 moved(const Row& row, const PackedVectors& x) const { return row.sides.distance(x) - row.start - row.way; }
  Force force_of(const Row& row, const Vector3& moved) const;
  static Real gap_of(const Row& row, const Vector3& moved) { return row.gap + row.normal.dot(moved); }
  /// What is still wrong where it presses or holds [m].
  static Real error_of(const Row& row, const Force& given, const Vector3& moved) {
    if (row.anchor) return moved.norm();
    return given.pressing > 0 ? std::abs(gap_of(row, moved)) : 0;
  }

  ImplicitContacts(Island& island, ImplicitContactScratch& scratch, const PackedVectors& from,
                   ImplicitSurfaces* surfaces, Real duration);

  Island& island_;
  const PackedVectors& from_;
  Real duration_;
  ImplicitSurfaces* surfaces_;
  std::vector<Row>&rows_, &old_rows_;  // those of surfaces come last, by their features
  std::size_t first_of_surfaces_ = 0;
  const PackedVectors* targets_ = nullptr;  // of predictions
  Real negligible_speed_ = 0;
  bool is_cut_ = false, were_predicted_ = false;
  std::vector<Real>& inverse_masses_;  // of each particle,
  std::vector<Real>& shares_;          // and the sum of its squared weights in all points
  std::vector<GivenInStep>& given_;    // to each soft body
  Real outside_work_ = 0;
  bool touch_immovable_ = false;
};

}  // namespace penalty
