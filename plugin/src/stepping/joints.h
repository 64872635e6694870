// Joints between rigid bodies, in the sweeps of a substep.
#pragma once
#include "penalty/stepping/island.h"
#include "skyline_matrix.h"

namespace penalty {

/// The rows of joints are made anew where the bodies are before each drift. Two-sided ones that share bodies, directly or
/// through others, are met at once: with J the matrix of their rows and W that of the inverse masses
///
///     (J W Jᵀ + softness) impulses = wanted + recovery - J v
///
/// Rows with limits (stops, motors) are swept over one by one, their impulses summed and clipped, each together with what
/// the two-sided ones must answer: a motor turns a wheel that stays on its axle. The matrix is a narrow band where joints
/// stand in the order of E. Cuthill and J. McKee, Reducing the Bandwidth of Sparse Symmetric Matrices (1969), reversed; nets
/// in which it is too wide to be worth it are met joint by joint. Both bodies take the impulse on the same line, so both
/// momenta are kept. The work of motors, of springs, of bodies that move and take no impulse, and of taking errors back is
/// work from outside.
class Joints {
 public:
  explicit Joints(Island& island);

  bool is_empty() const { return island_.joints.empty(); }

  /// Substeps that a step of `duration` [s] needs at least, so that no body turns far in one.
  static int least_substeps(const Island& island, Real duration);

  /// Before the sweeps of a drift of h [s]; `since` [s] is how long forces acted since the last: as in the last one, they
  /// are met by its impulses. Errors are taken back only where a drift follows.
  void begin(Real h, Real since, bool drifts);

  /// Returns the largest change of a speed [m/s].
  Real sweep();

  /// Keeps what the sweeps came to.
  void end(Real since);

  /// Begins an attempt at the step.
  void begin_attempt();

  Real outside_work() const { return outside_work_; }  // in this attempt [J]

 private:
  struct Row : JointRow {
    RigidBody *a = nullptr, *b = nullptr;                            // null: takes no impulse
    Vector3 velocity_a = Vector3::Zero(), turn_a = Vector3::Zero();  // by a unit impulse
    Vector3 velocity_b = Vector3::Zero(), turn_b = Vector3::Zero();
    Real still = 0;           // part of u that is of bodies that take no impulse
    Real mobility = 0;        // of u by a unit impulse,
    Real free_mobility = -1;  // and what is left of it when the two-sided rows answer: -1, not known
    Real lever = 1;           // of turning, so that its speeds compare [m]
    Real impulse = 0;
    std::size_t answer = 0;  // of the two-sided rows, where it begins
  };
  struct Block {                                            // of joints that are met together
    int joints = 1;                                         // that hang together, these and others
    std::vector<std::size_t> two_sided = {}, limited = {};  // rows
    SkylineMatrix matrix = {};
    bool is_redundant = false;  // some two-sided rows say what others do, or nearly
    Eigen::VectorXd asked = {}, impulses = {};
    std::vector<Real> answers = {};
  };

  void make_blocks();
  void add_block(const std::vector<int>& joints, int connected);
  void start(Real since);
  void add_row(const JointRow& asked, Real h, bool drifts, Real bends);
  void limit_recovery(Row& row, Real h, bool drifts, Real bends);
  Real bend_of(const JointRow& asked) const;
  void factor(Block& block);
  void answer(Block& block, Row& row);
  Real meet(Block& block);
  Real clip(Block& block, Row& row);
  Real speed(const Row& row) const;
  static Real coupling(const Row& one, const Row& two);
  static void push(Row& row, Real impulse);

  Island& island_;
  std::vector<JointRow> asked_;
  std::vector<Row> rows_;
  std::vector<Block> blocks_;
  struct Place {
    int block = -1;            // none where nothing moves
    int place = 0, first = 0;  // in its order, and the first that shares a body with it
  };
  std::vector<Place> places_;  // by joint
  std::vector<std::array<Real, Joint::most_rows>> start_;
  std::vector<int> start_rows_;
  std::vector<std::array<Real, Joint::most_rows>> left_;  // errors that are not yet taken back; infinity: not known
  Real outside_work_ = 0;
};

}  // namespace penalty
