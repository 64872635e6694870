// What all batches share, whatever their kind: stiffnesses, and the modifiers that change at run time.
#pragma once
#include <string>

#include "penalty/fields/potential.h"

namespace penalty {

/// An element that broke: it has left the field.
struct Break {
  int element;
  Real strain;  // when it was found broken
  Real energy;  // that it held [J]
};

/// How many elements broke, and how many of them are still out of the field: while neither changes, no more did.
struct BreakCount {
  std::size_t ever = 0, now = 0;

  bool operator==(const BreakCount&) const = default;
};

/// The elements of a batch, numbered in the order in which they were added, and what may change about each of them
/// while the simulation runs. Elements start plain; a modifier costs time only in the batch that uses it. Inside a
/// Bullet world make changes through `AttachedBodies::edit`, which wakes the body.
///
/// Setters throw std::invalid_argument that names batch, element and value.
class ElementBatch : public Potential {
 public:
  /// K [J], positive and finite.
  void set_stiffness(int element, Real stiffness);
  Real stiffness(int element) const { return own_stiffness(check(element)); }

  /// The C that counts as rest, finite; 0 at first. A muscle that contracts to 80 % of its rest length has target -0.2.
  /// Refused by kinds that are energies of their own: these have no scalar rest value.
  void set_target(int element, Real target);
  void set_targets(Real target);
  Real target(int element) const;

  /// Free play about the target, lower <= upper, either of them infinite if need be: only stretching is resisted from
  /// (-infinite, 0), only compression from (0, infinite).
  /// For a kind that is an energy of its own it must hold 0 and end.
  void set_free_play(int element, Real lower, Real upper);
  void set_free_play(Real lower, Real upper);

  /// Plastic flow; refused, as targets are, by kinds that are energies of their own.
  void set_plasticity(int element, const Plasticity& plasticity);
  void set_plasticity(const Plasticity& plasticity);
  Real plastic_strain(int element) const;

  /// The element breaks where its strain leaves [lower, upper].
  void set_breaking(int element, const Breaking& breaking);
  void set_breaking(const Breaking& breaking);
  /// Every element that broke, in the order of breaking; a broken element stays disabled until it is enabled again.
  const std::vector<Break>& breaks() const { return breaks_; }
  /// Breaks an element that holds no energy now; nothing if it is disabled.
  void break_idle(int element, Real strain);

  /// Ratio of damping to stiffness of this element [s], on top of that of the step; zero or positive.
  void set_damping_time(int element, Real time);
  void set_damping_time(Real time);

  /// A disabled element has no force, stiffness, damping or energy.
  void set_enabled(int element, bool enabled);
  bool is_enabled(int element) const { return stiffnesses_[check(element)] > 0; }

  void append_state(std::vector<Real>& state) const override;
  std::size_t set_state(std::span<const Real> state) override;

 protected:
  /// `period` as in Profile.
  ElementBatch(int num_particles, std::string name, bool has_target, Real period)
      : Potential(std::move(name)), num_particles_(num_particles), has_target_(has_target), period_(period) {}

  [[noreturn]] void fail(std::size_t element, const std::string& what) const;
  std::size_t check(int element) const;
  void check_stencil(std::span<const int> stencil) const;
  void check_stiffness(std::size_t element, Real stiffness) const;
  void append_element(Real stiffness);

  /// No element is modified or switched off: the loop over them needs no test.
  bool is_plain() const { return profiles_.empty() && num_disabled_ == 0; }
  Profile profile(std::size_t e) const { return profiles_.empty() ? Profile{} : profiles_[e]; }
  Real damping_time(std::size_t e, Real time) const { return damping_times_.empty() ? time : time + damping_times_[e]; }

  const Real* damping_times() const { return damping_times_.empty() ? nullptr : damping_times_.data(); }  // [s]

  /// Plastic flow and breaking of one element at deviation c; returns the energy that it lost [J].
  Real evolve_element(std::size_t e, Real c, Real duration);

  int num_particles_;
  std::vector<Real> stiffnesses_;  // in force: 0 of a disabled element [J]

 private:
  Real own_stiffness(std::size_t e) const {
    return disabled_stiffnesses_.empty() || stiffnesses_[e] > 0 ? stiffnesses_[e] : disabled_stiffnesses_[e];
  }
  std::vector<Profile>& profiles_to_change();
  void disable(std::size_t e);

  bool has_target_;
  Real period_;
  std::size_t num_disabled_ = 0;
  // Each is empty until its first use, then of full size.
  std::vector<Profile> profiles_;
  std::vector<Plasticity> plasticities_;
  std::vector<Real> plastic_strains_;  // the part of the targets that flowed
  std::vector<Breaking> breakings_;
  std::vector<Real> damping_times_;         // [s]
  std::vector<Real> disabled_stiffnesses_;  // of disabled elements, to return to [J]
  std::vector<Break> breaks_;
};

}  // namespace penalty
