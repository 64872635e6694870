// A run: the scene stepped from start to end, and what was seen of it.
#pragma once
#include <functional>
#include <vector>

#include "main/command_line.h"
#include "scenes/scene.h"
#include "scenes/shape_measure.h"

namespace penalty::demo {

/// After a step, or at the start.
struct StepRecord {
  Real time = 0;  // [s]
  Energies energies;
  ShapeErrors errors;
  Real penetration = 0;    // below the true rigid surfaces [m]
  Real contact_depth = 0;  // below the planes of contact, which lie a margin outside [m]
  bool implicit = false;   // the step was
  int substeps = 0, retries = 0, newton_iterations = 0;
  Real milliseconds = 0;             // CPU time of the world step
  std::optional<Real> tip_drop;      // [m]
  std::vector<LedgerEntry> batches;  // in the order of the field
  EnergyFlows flows;                 // of the soft bodies, since the start
};

/// What a picture needs of a soft body.
struct SoftRecord {
  Eigen::Matrix3Xd positions;       // of the simulated vertices [m]
  Eigen::VectorXd values;           // what the colours show, one a simulated vertex
  std::vector<Triangle> triangles;  // that are left to draw; empty: all of them
};

/// What a picture needs.
struct FrameRecord {
  Real time = 0;
  std::vector<SoftRecord> bodies;
  std::vector<Pose> objects;
};

struct Recording {
  std::uint32_t seed = 0;
  std::vector<StepRecord> steps;                    // the start first
  std::vector<FrameRecord> frames;                  // the start first; empty unless asked for
  Real rest_error = 0;                              // of the body where it is largest
  std::vector<Fact> facts;                          // of this scene alone, at the end
  std::optional<Real> linear_drift, angular_drift;  // relative; empty where something from outside acts
  bool finite = true;
  std::string failure;  // where a run that turned non-finite did so
  bool recovered() const { return finite && rest_error < 1e-2; }
};

/// |E - (E_start + received - lost)| over the largest E of the run, E the elastic and kinetic energy of the soft bodies
/// at the end: what the energy ledger leaves unexplained. 0 where there is no energy at all.
Real ledger_residual(const std::vector<StepRecord>& steps);

/// Clips show 30 frames a second, or each step of a slower world; of a long run they are a time lapse.
struct FramePlan {
  Real interval = 0;  // of simulated time between frames [s]; 0: none are kept
  Real frames_per_second = 30;
};
FramePlan plan_frames(Real duration, Real rate);

/// What the colours of a run show.
Coloring coloring(const RunOptions& options, const SceneSetup& setup);

/// Runs `scene` from its start. `progress` is told the number of steps done.
Recording record(Scene& scene, const RunOptions& options, long steps, const FramePlan& frames,
                 const std::function<void(long)>& progress);

}  // namespace penalty::demo
