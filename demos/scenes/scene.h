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

/// Momenta of the soft bodies, and the sums of magnitudes that they are to be compared with.
struct Momenta {
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();  // angular: about the origin [kg m/s], [kg m²/s]
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

  const SceneSetup& setup() const;  // its fields have gone into the world
  SceneState state() const;         // refers to the scene
  const PotentialField& field(std::size_t body = 0) const;
  const Particles& particles(std::size_t body = 0) const;
  const StepReport& report(std::size_t body) const;
  StepReport report() const;  // of all bodies: sums and extremes

  std::vector<LedgerEntry> ledger() const;  // one entry a batch of elements, body by body
  EnergyFlows flows() const;                // of all bodies, since the start
  bool is_asleep() const;                   // all bodies are

  Energies energies() const;
  Momenta momenta() const;
  std::vector<Pose> objects() const;  // in the order of the setup

  /// Deepest contact point below the true surfaces of ground and rigid objects, whatever the plugin thinks [m]; 0: none
  /// is.
  Real penetration() const;

  /// Mean drop of the tips' vertices below their start, which is the rest shape [m]; empty without a tip.
  std::optional<Real> tip_drop() const;

  /// What the setup measures; of bodies that may sleep also how long they did and how often they woke.
  std::vector<Fact> facts() const;

  /// Nothing from outside acts: both momenta should stay what they are.
  bool is_free() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace penalty::demo
