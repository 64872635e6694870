// Contacts between surfaces of soft bodies, through the substeps of one step.
#pragma once
#include <functional>
#include <optional>
#include <tuple>

#include "island_surfaces.h"

namespace penalty {

/// A pair of features of the island's surfaces, or a point that is inside one of them and the triangle that is nearest.
struct TouchingFeatures {
  int contact = 0;  // number among the surfaces of the island
  std::array<int, 4> points = {};
  bool are_edges = false, from_b = false, is_enclosed = false;

  auto key() const {
    return std::tuple(contact, is_enclosed, from_b, are_edges, points[0], is_enclosed ? 0 : points[1],
                      is_enclosed ? 0 : points[2], is_enclosed ? 0 : points[3]);
  }
  bool are(const TouchingFeatures& other) const { return key() == other.key(); }
};

/// What features gave in a step, on the first.
struct TouchingRecord {
  TouchingFeatures features;
  Real thickness = 0;  // the radius of a rigid surface included [m]
  ContactImpulse given = {};
};

/// Where two features touch, or may in the coming drift: a row of constraints along the normal and two across it.
struct TouchingPair {
  std::size_t begin = 0, end = 0;        // of its particles,
  std::size_t of_first = 0;              // and how many of these are of the first feature
  Matrix3 axes = Matrix3::Zero();        // the normal, from the second feature to the first, and two tangents
  Vector3 difference = Vector3::Zero();  // the way between these points [m]
  Real gap = 0, thickness = 0;           // distance beyond the thickness; negative where some of that is lost [m]
  Real mobility = 0;                     // of an impulse along the normal [1/kg],
  Real wanted = 0;                       // and the speed along it that is asked for, at least [m/s]
  Real friction = 0;
  Real given = 0;                                               // along the normal, so far in this drift [N s],
  Eigen::Vector2<Real> rubbed = {0, 0};                         // and along the tangents
  Eigen::Matrix2<Real> inertia = Eigen::Matrix2<Real>::Zero();  // along these [kg]; zero: no friction
  bool has_friction_rows = false;                               // they are made when they are first needed
  ContactMemory* memory = nullptr;                              // null: starts from nothing
  TouchingFeatures features = {};
  int record = -1;                // of them; -1: none yet, and its number is to be kept
  int* kept_record = nullptr;     // here
  bool leads_out = false;         // out of a closed surface that the first feature, a point, is inside of
  int body_a = 0, body_b = 0;     // half of what is lost is booked to each
  RigidBody* rigid = nullptr;     // one of the features is fixed in it, and takes
  Real rigid_weight = 0;          // so much of an impulse: 1 the first, -1 the second,
  Vector3 arm = Vector3::Zero();  // where the other one is, from its centre [m]
};

/// A particle of a touching pair: an impulse J on the pair gives it weight * J, less what would turn the pair. The speed
/// of a row is the sum over the particles of row.dot(velocity), and its unit impulse gives them these impulses.
struct TouchingParticle {
  Real* velocity;
  const Real* position;
  Real weight, inverse_mass;
  Matrix3 rows = Matrix3::Zero();  // along the normal and the tangents
};

inline Eigen::Map<Vector3> vector(Real* p) { return Eigen::Map<Vector3>(p); }
inline Eigen::Map<const Vector3> vector(const Real* p) { return Eigen::Map<const Vector3>(p); }

/// What fails the guard: a pair of features, and where it comes from.
struct FailingPair {
  const SurfaceContact* contact;
  FeaturePair* features;
};

/// Memory that is kept between steps.
struct SurfaceScratch {
  std::vector<TouchingPair> pairs;
  std::vector<TouchingParticle> particles;
  std::vector<FailingPair> failing;
  std::vector<TouchingRecord> records;  // of the attempt at the step
  int num_touching = 0;                 // at its end
};

/// What features gave several times becomes one record.
void merge(std::vector<TouchingRecord>& records);

/// Adds a pair of features, and how deep it is [m], to the reports of its bodies, which may be one; -1: none.
void book_touching(const Island& island, int body_a, int body_b, Real depth);

TouchingFeatures features_of(const Island& island, const SurfaceContact& contact, const FeaturePair& q,
                             bool is_enclosed = false);

/// Each pair of features that may touch in a drift of h is a one-sided constraint on velocities along the direction n
/// between its closest points as they are at this instant: of the distance D and the thickness d that is kept, the
/// relative normal speed u is asked to be u >= -(D - d)/h while there is a gap, and u >= 0 when there is none; thickness
/// that was lost comes back at (d - D) / 0.05 s, at 2 cm/s and 100 m/s² at most. The impulse goes to both features by weight
/// and inverse mass. There is no stiffness, no sign and no memory of sides: the two sides of a cloth are the same.
///
/// Friction acts at two points that are a thickness apart, so it would turn the particles of the pair: the part of
/// the slip that is a rotation of these is left out, and so is the rotation that the impulse would give. Both momenta are
/// kept to round-off, but where features lie on each other, see SurfacePair::has_no_direction. A rigid body takes
/// impulses at the point of the soft one, so there is nothing to leave out.
///
/// Contacts start from what they gave in the last substep: from the share of it that takes most of the approach away, so
/// that a start is never worse than none. Sweeps go on until they change nothing that matters, contacts with rigid bodies in
/// each of them and once more at the end. Then the guard lets no pair drift unless a plane separates it before and after:
/// linear motions separated at both ends are separated throughout. What fails is swept again; what fails still moves on as
/// one rigid body, which keeps both momenta where nothing is held.
///
/// What starts out pierced is left to pass; points inside a closed surface are led out of it, all in one direction,
/// at 0.2 m/s and 20 m/s² at most, unless it is a rigid body so deep that the particles in it hold it.
class SurfaceContacts {
 public:
  /// Once over the contacts with and between rigid bodies; returns whether it is to be done again.
  using RigidSweep = std::function<bool()>;

  explicit SurfaceContacts(Island& island);

  bool is_empty() const { return island_.surfaces.empty(); }

  /// Begins a step from where the particles are.
  void begin_step(Real duration);

  /// Whether the surfaces of this body may touch in the step.
  bool may_touch(std::size_t body) const { return !is_empty() && may_touch_[body]; }

  /// Substeps that the step needs so that none brings surfaces closer by more than half the thickness; 1 if none may
  /// touch.
  int least_substeps() const { return least_substeps_; }

  /// Before a drift of `h` [s] in which the particles move by their velocities. `rigid_sweep` is one sweep over the
  /// contacts with rigid bodies. `remaining`: of the step, the drift included; `since`: that forces acted for since the
  /// last sweeps [s].
  void sweep(Real h, Real remaining, Real since, const RigidSweep& rigid_sweep);

  /// The same where nothing drifts: takes the approach that the last half kick left.
  void close(Real h, Real since, const RigidSweep& rigid_sweep);
  /// Once more where only velocities have changed since.
  void close_again(Real h, const RigidSweep& rigid_sweep);

  /// After the drift.
  void drifted(Real h);

  /// The particles were put back to where the step began; the work is forgotten.
  void undo();

  /// Adds what touches at the end, and how deep, to the reports of the bodies.
  void report();

  /// Whether any has given something in this step.
  bool has_given() const { return !is_empty() && !scratch_.records.empty(); }

  /// Of giving thickness back, leading out, and of whoever drives what is held [J].
  Real outside_work() const { return outside_work_; }

 private:
  struct RigidMotion;  // of particles and rigid bodies that move as one
  struct Turning;      // of the particles of a pair

  bool refresh(Real h, Real remaining);
  bool converge(Real h, Real since, const RigidSweep& rigid_sweep);
  Real gravity_of_quiet() const;
  Real quiet_change(Real h) const;
  void begin_sweeps();
  void collect(Real h);
  void add(const SurfaceContact& contact, const FeaturePair& q, const ClosestPoints& closest, const Vector3* leads_out,
           ContactMemory* memory, int* kept_record);
  void add_particles(const WeightedPoint& point, Real weight, int body, std::size_t begin);
  void lead_out(const SurfaceContact& contact);
  void hold_inside(const SurfaceContact& surface);
  Real sweep_pairs(Real h, bool& hit);
  std::optional<Turning> turning_of(const TouchingPair& pair) const;
  void make_row(const TouchingPair& pair, int row, const std::optional<Turning>& turning);
  void make_normal_row(TouchingPair& pair);
  void make_friction_rows(TouchingPair& pair);
  Real mobility_of(const TouchingPair& pair, int row, int other) const;
  Real speed_of(const TouchingPair& pair, int row) const;
  Eigen::Vector2<Real> slip_of(const TouchingPair& pair) const;
  template <class Share>
  void push(const TouchingPair& pair, const Vector3& impulse, const Share& share);
  void press(TouchingPair& pair, Real given, Real speed);
  void start(Real since);
  bool recall(TouchingPair& pair, Real since);
  void rub(TouchingPair& pair);
  void rub(TouchingPair& pair, Eigen::Vector2<Real> rubbed, const Eigen::Vector2<Real>& slip);
  void book();
  void book_loss(const TouchingPair& pair, Real loss);
  int known_record(const TouchingFeatures& features, int number) const;
  void open_record(TouchingPair& pair);
  void record(TouchingPair& pair);
  void record(const TouchingFeatures& features, Real thickness, const Vector3& given);
  void report_enclosed(const SurfaceContact& contact);
  std::span<TouchingParticle> particles_of(const TouchingPair& pair) const {
    return std::span(scratch_.particles).subspan(pair.begin, pair.end - pair.begin);
  }

  // The guard.
  void guard(Real h, Real remaining, const RigidSweep& rigid_sweep);
  bool is_beyond_help() const;
  void find_failing(Real h);
  void freeze(Real h);
  void join(std::span<const int> numbers, std::span<const std::vector<FailingPair>> pairs_of);
  void make_rigid(std::span<const int> numbers);
  std::optional<RigidMotion> motion_of_held(std::span<const int> numbers) const;
  RigidMotion common_motion(std::span<const int> numbers) const;
  Real impose(const RigidMotion& motion, std::span<const int> numbers);
  template <class Visit>
  void visit_particles(const FailingPair& pair, const Visit& visit) const;
  bool is_in_one_zone(const FailingPair& pair);
  int zone_of(int particle);
  std::pair<SteppedBody*, int> particle(int number) const;
  RigidBody* rigid_body(int number) const;

  Island& island_;
  SurfaceScratch& scratch_;
  IslandSurfaces surfaces_;
  std::vector<int> first_particle_;  // of each body, and their number: particles numbered through, then rigid bodies
  std::vector<int> zone_;            // of particles that move as one: another of these; empty: none do
  std::vector<char> may_touch_;      // each body
  std::vector<const SurfacePair*> held_inside_;  // what is too deep to be led out
  int least_substeps_ = 1;
  Real quiet_gravity_ = 0;   // where all begins the step as slow as what settles, else infinite [m/s²]
  long freezing_tests_ = 0;  // of pairs, for zones of the guard, in this step
  Real outside_work_ = 0;
};

/// Sets the records of the island to what all its contacts have given so far in this step; the same features may be in
/// two of them before the report.
void find_records(Island& island);

}  // namespace penalty
