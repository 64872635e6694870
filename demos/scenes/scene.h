// A scene in a Bullet world. No Bullet in this header: the same program is linked with either precision.
#pragma once
#include <memory>
#include <optional>

#include "penalty/stepping/particles.h"
#include "penalty/stepping/step_report.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {

/// "float32" or "float64": the build of Bullet below.
std::string_view bullet_precision();

struct Energies {  // [J]
  Real elastic = 0, kinetic = 0, rigid_kinetic = 0;
  Real gravitational = 0;  // of soft and rigid bodies; zero at y = 0
  Real total() const { return elastic + kinetic + rigid_kinetic + gravitational; }
};

/// Momenta of everything that moves, and the sums of magnitudes that they are to be compared with.
struct Momenta {
  Vector3 linear, angular;  // angular: about the origin [kg m/s], [kg m²/s]
  Real linear_scale = 0, angular_scale = 0;
};

class Scene {
 public:
  /// Throws std::invalid_argument for numbers that the plugin refuses.
  Scene(SceneSetup setup, WorldKind world);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// One world step [s].
  void step(Real duration);
  Real time() const;  // [s]

  const SceneSetup& setup() const;  // its field has gone into the world
  const PotentialField& field() const;
  const Particles& particles() const;
  const StepReport& report() const;

  std::vector<LedgerEntry> ledger() const;  // one entry a batch of elements; names are valid as long as the scene
  const EnergyFlows& flows() const;         // since the start
  bool is_asleep() const;

  Energies energies() const;
  Momenta momenta() const;
  std::vector<Pose> objects() const;  // in the order of the setup

  /// Deepest contact point below the true surfaces of ground and rigid objects, whatever the plugin thinks [m]; 0: none
  /// is.
  Real penetration() const;

  /// Mean drop of the tip's vertices below their start, which is the rest shape [m]; empty without a tip.
  std::optional<Real> tip_drop() const;

  /// What the setup measures; of a body that may sleep also how long it did and how often it woke.
  std::vector<Fact> facts() const;

  /// Nothing from outside acts: both momenta should stay what they are.
  bool is_free() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace penalty::demo
