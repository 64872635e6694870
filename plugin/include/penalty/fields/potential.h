// What a solver knows of the elastic world: an energy of the particle positions and its derivatives.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "penalty/energy/penalty_energy.h"
#include "penalty/fields/damping_modes.h"
#include "penalty/fields/system.h"

namespace penalty {

/// One element, as `Potential::visit_elements` shows it.
struct ElementView {
  int number;                    // among the elements of its potential
  std::span<const int> stencil;  // its particles
  Real strain;                   // that is resisted: C less target and free play; 0 of a disabled element
  Real energy;                   // [J]
  bool enabled;                  // it counts
};

/// A reference to what is called with each element, for as long as a call takes: owns nothing, allocates nothing.
class ElementVisitor {
 public:
  template <class Call>
    requires(!std::is_same_v<Call, ElementVisitor> && std::is_invocable_v<const Call&, const ElementView&>)
  ElementVisitor(const Call& call)  // NOLINT(google-explicit-constructor): stands for the call
      : call_(&call),
        invoke_([](const void* callee, const ElementView& element) { (*static_cast<const Call*>(callee))(element); }) {}

  void operator()(const ElementView& element) const { invoke_(call_, element); }

 private:
  const void* call_;
  void (*invoke_)(const void*, const ElementView&);
};

/// A sum of element energies. Calls are virtual once a batch of elements, never per element. Arrays have one column a
/// particle and are never resized; functions that start with `add_` add to their output. Positions that are not finite
/// give results that are not finite, never an error. One thread at a time may use a potential: elements of many points
/// keep scratch space.
///
/// A potential of your own needs the three without a body; the others are for what damps, flows, breaks or is to be
/// looked at.
class Potential {
 public:
  explicit Potential(std::string name) : name_(std::move(name)) {}
  virtual ~Potential() = default;

  virtual Real energy(const Positions& x) const = 0;  // [J]

  /// f += -dE/dx [N]; returns E [J], which costs little on the way.
  virtual Real add_forces(const Positions& x, Forces f) const = 0;

  /// The same where nobody asks for E: most substeps of a step.
  virtual void add_forces_only(const Positions& x, Forces f) const { add_forces(x, f); }

  /// K += d²E/dx² [N/m].
  virtual void add_stiffness(const Positions& x, StiffnessModel model, System& stiffness) const = 0;

  /// D += the damping matrix [N s/m] along the constraint gradients, (time * K) dC dCᵀ: `time` [s] is the ratio of
  /// damping to stiffness, to which elements with a damping time of their own add it. The force is F = -D v.
  virtual void add_damping(const Positions& /*x*/, Real /*time*/, System& /*damping*/) const {}

  /// The same matrix times `duration` as modes, where `has_damping_modes`; others damp by `dissipate` alone.
  virtual void add_damping_modes(const Positions& /*x*/, Real /*time*/, Real /*duration*/,
                                 DampingModes& /*modes*/) const {}

  /// Takes velocity along the constraint gradients away, implicitly and element by element, as F = -D v acting for
  /// `duration` would, but no more than neighbours that move along allow: for few elements. Each update is a set of internal impulses: linear and angular momentum stay what they are, and
  /// kinetic energy only falls, for any duration. Particles of zero inverse mass keep their velocity.
  virtual void dissipate(const Positions& /*x*/, std::span<const Real> /*inverse_masses*/, Real /*time*/,
                         Real /*duration*/, Forces /*v*/) const {}

  /// Plastic flow and breaking over `duration` [s], judged at `x`; returns the elastic energy that this took [J].
  virtual Real evolve(const Positions& /*x*/, Real /*duration*/) { return 0; }

  /// Calls visit(element) for every element, in the order in which they were added, disabled ones too.
  virtual void visit_elements(const Positions& /*x*/, const ElementVisitor& /*visit*/) const {}

  /// Appends what `evolve` may change, so that it can be set again; `set_state` takes as many numbers from the front
  /// and returns how many. Throws std::invalid_argument if they are not of this potential.
  virtual void append_state(std::vector<Real>& /*state*/) const {}
  virtual std::size_t set_state(std::span<const Real> /*state*/) { return 0; }

  std::string_view name() const { return name_; }
  std::size_t num_elements() const { return num_elements_; }

  /// Some elements have a damping time of their own: `dissipate` has work to do even at time 0.
  bool damps() const { return damps_; }
  bool has_damping_modes() const { return has_damping_modes_; }
  bool evolves() const { return evolves_; }  // `evolve` may have something to do

  /// Grows with every change that may raise the stiffness: what was estimated from it is then out of date.
  std::uint64_t stiffness_version() const { return stiffness_version_; }

 protected:
  std::string name_;
  std::size_t num_elements_ = 0;
  bool damps_ = false, has_damping_modes_ = false, evolves_ = false;
  std::uint64_t stiffness_version_ = 0;
};

}  // namespace penalty
