#include "penalty/fields/element_batch.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace penalty {
namespace {

/// The first use of a modifier gives every element its neutral one.
template <class Value>
std::vector<Value>& full(std::vector<Value>& values, std::size_t size, const Value& neutral = {}) {
  values.resize(size, neutral);
  return values;
}

}  // namespace

void ElementBatch::fail(std::size_t element, const std::string& what) const {
  throw std::invalid_argument(name_ + " " + std::to_string(element) + ": " + what);
}

std::size_t ElementBatch::check(int element) const {
  if (element < 0 || static_cast<std::size_t>(element) >= num_elements())
    throw std::invalid_argument(name_ + ": there is no element " + std::to_string(element) + " among the " +
                                std::to_string(num_elements()));
  return static_cast<std::size_t>(element);
}

void ElementBatch::check_stencil(std::span<const int> stencil) const {
  for (std::size_t k = 0; k < stencil.size(); ++k)
    if (stencil[k] < 0 || stencil[k] >= num_particles_)
      fail(num_elements(),
           "index " + std::to_string(stencil[k]) + " is outside the " + std::to_string(num_particles_) + " particles");
  const auto fail_twice = [this](int index) {
    fail(num_elements(), "index " + std::to_string(index) + " appears twice");
  };
  if (stencil.size() <= 8) {
    for (std::size_t k = 0; k < stencil.size(); ++k)
      for (std::size_t l = 0; l < k; ++l)
        if (stencil[k] == stencil[l]) fail_twice(stencil[k]);
  } else {
    std::vector<int> sorted(stencil.begin(), stencil.end());
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end()) fail_twice(*twice);
  }
}

void ElementBatch::check_stiffness(std::size_t element, Real stiffness) const {
  if (!(stiffness > 0) || !std::isfinite(stiffness))
    fail(element, "stiffness is " + to_text(stiffness) + " J, must be positive and finite");
}

void ElementBatch::append_element(Real stiffness) {
  stiffnesses_.push_back(stiffness);
  const std::size_t size = num_elements_ = stiffnesses_.size();
  if (!profiles_.empty()) profiles_to_change();
  if (!plasticities_.empty()) plasticities_.resize(size);
  if (!plastic_strains_.empty()) plastic_strains_.resize(size);
  if (!breakings_.empty()) breakings_.resize(size);
  if (!damping_times_.empty()) damping_times_.resize(size);
  if (!disabled_stiffnesses_.empty()) disabled_stiffnesses_.resize(size);
  ++stiffness_version_;
}

void ElementBatch::set_stiffness(int element, Real stiffness) {
  const std::size_t e = check(element);
  check_stiffness(e, stiffness);
  (stiffnesses_[e] > 0 ? stiffnesses_ : disabled_stiffnesses_)[e] = stiffness;
  ++stiffness_version_;
}

std::vector<Profile>& ElementBatch::profiles_to_change() {
  return full(profiles_, num_elements(), Profile{.period = period_});
}

void ElementBatch::set_target(int element, Real target) {
  const std::size_t e = check(element);
  if (!has_target_) fail(e, "an energy of its own has no target");
  if (!std::isfinite(target)) fail(e, "target is " + to_text(target) + ", must be finite");
  profiles_to_change()[e].target = target + (plastic_strains_.empty() ? 0 : plastic_strains_[e]);
}

void ElementBatch::set_targets(Real target) {
  for (std::size_t e = 0; e < num_elements(); ++e) set_target(static_cast<int>(e), target);
}

Real ElementBatch::target(int element) const {
  const std::size_t e = check(element);
  return profile(e).target - (plastic_strains_.empty() ? 0 : plastic_strains_[e]);
}

void ElementBatch::set_free_play(int element, Real lower, Real upper) {
  const std::size_t e = check(element);
  if (!(lower <= upper)) fail(e, "free play from " + to_text(lower) + " to " + to_text(upper) + " is empty");
  if (lower == infinite || upper == -infinite)
    fail(e, "free play from " + to_text(lower) + " to " + to_text(upper) + " has no finite strain");
  if (!has_target_ && !(lower <= 0 && upper >= 0 && upper < infinite))
    fail(e, "free play from " + to_text(lower) + " to " + to_text(upper) +
                " must hold 0 and end: an energy of its own is zero at rest and nowhere negative");
  Profile& profile = profiles_to_change()[e];
  profile.lower = lower;
  profile.upper = upper;
}

void ElementBatch::set_free_play(Real lower, Real upper) {
  for (std::size_t e = 0; e < num_elements(); ++e) set_free_play(static_cast<int>(e), lower, upper);
}

void ElementBatch::set_plasticity(int element, const Plasticity& plasticity) {
  const std::size_t e = check(element);
  if (!has_target_) fail(e, "an energy of its own has no plastic flow");
  plasticity.check();
  profiles_to_change();
  full(plastic_strains_, num_elements());
  full(plasticities_, num_elements())[e] = plasticity;
  evolves_ = true;
}

void ElementBatch::set_plasticity(const Plasticity& plasticity) {
  for (std::size_t e = 0; e < num_elements(); ++e) set_plasticity(static_cast<int>(e), plasticity);
}

Real ElementBatch::plastic_strain(int element) const {
  const std::size_t e = check(element);
  return plastic_strains_.empty() ? 0 : plastic_strains_[e];
}

void ElementBatch::set_breaking(int element, const Breaking& breaking) {
  const std::size_t e = check(element);
  breaking.check();
  full(breakings_, num_elements())[e] = breaking;
  evolves_ = true;
}

void ElementBatch::set_breaking(const Breaking& breaking) {
  for (std::size_t e = 0; e < num_elements(); ++e) set_breaking(static_cast<int>(e), breaking);
}

void ElementBatch::set_damping_time(int element, Real time) {
  const std::size_t e = check(element);
  if (!(time >= 0) || !std::isfinite(time))
    fail(e, "damping time is " + to_text(time) + " s, must be zero or positive");
  full(damping_times_, num_elements())[e] = time;
  damps_ = true;
}

void ElementBatch::set_damping_time(Real time) {
  for (std::size_t e = 0; e < num_elements(); ++e) set_damping_time(static_cast<int>(e), time);
}

void ElementBatch::disable(std::size_t e) {
  full(disabled_stiffnesses_, num_elements())[e] = stiffnesses_[e];
  stiffnesses_[e] = 0;
  ++num_disabled_;
}

void ElementBatch::set_enabled(int element, bool enabled) {
  const std::size_t e = check(element);
  if (enabled == (stiffnesses_[e] > 0)) return;
  if (enabled) {
    stiffnesses_[e] = disabled_stiffnesses_[e];
    --num_disabled_;
    ++stiffness_version_;
  } else {
    disable(e);
  }
}

void ElementBatch::break_idle(int element, Real strain) {
  const std::size_t e = check(element);
  if (!(stiffnesses_[e] > 0)) return;
  breaks_.push_back({element, strain, 0});
  disable(e);
}

Real ElementBatch::evolve_element(std::size_t e, Real c, Real duration) {
  if (!(stiffnesses_[e] > 0)) return 0;
  Real s = profile(e).strain(c);
  const auto energy_at = [&](Real strain) { return stiffnesses_[e] / 2 * strain * strain; };
  const Real before = energy_at(s);
  if (!plasticities_.empty()) {
    const Real flown = plasticities_[e].flow(plastic_strains_[e], s, duration) - plastic_strains_[e];
    if (flown != 0) {
      plastic_strains_[e] += flown;
      profiles_[e].target += flown;
      s = profiles_[e].strain(c);
    }
  }
  if (!breakings_.empty() && breakings_[e].breaks(s)) {
    breaks_.push_back({static_cast<int>(e), s, energy_at(s)});
    disable(e);
    return before;
  }
  return before - energy_at(s);
}

// How many stiffnesses, stiffnesses of disabled elements, targets, plastic strains and breaks there are, then all of
// them. Of elements that are as they were added: none.
void ElementBatch::append_state(std::vector<Real>& state) const {
  const bool is_default = is_plain() && !evolves_ && breaks_.empty();
  const std::size_t size = is_default ? 0 : num_elements();
  for (const std::size_t count :
       {size, is_default ? 0 : disabled_stiffnesses_.size(), profiles_.size(), plastic_strains_.size(), breaks_.size()})
    state.push_back(static_cast<Real>(count));
  if (is_default) return;
  state.insert(state.end(), stiffnesses_.begin(), stiffnesses_.end());
  state.insert(state.end(), disabled_stiffnesses_.begin(), disabled_stiffnesses_.end());
  for (const Profile& profile : profiles_) state.push_back(profile.target);
  state.insert(state.end(), plastic_strains_.begin(), plastic_strains_.end());
  for (const Break& event : breaks_)
    state.insert(state.end(), {static_cast<Real>(event.element), event.strain, event.energy});
}

std::size_t ElementBatch::set_state(std::span<const Real> state) {
  constexpr std::size_t num_counts = 5;
  std::size_t counts[num_counts], total = num_counts;
  for (std::size_t k = 0; k < num_counts; ++k) {
    const Real count = k < state.size() ? state[k] : -1;
    const bool is_list_of_breaks = k + 1 == num_counts;
    if (!(count >= 0 && count <= static_cast<Real>(state.size())) ||
        !(is_list_of_breaks || count == 0 || count == static_cast<Real>(num_elements())))
      throw std::invalid_argument(name_ + ": the state is not one of these " + std::to_string(num_elements()) +
                                  " elements: it holds " + to_text(count));
    counts[k] = static_cast<std::size_t>(count);
    total += is_list_of_breaks ? 3 * counts[k] : counts[k];
  }
  if (total > state.size())
    throw std::invalid_argument(name_ + ": the state ends early, after " + std::to_string(state.size()) + " of " +
                                std::to_string(total) + " numbers");
  const Real* next = state.data() + num_counts;
  const auto take = [&](std::size_t count) { return std::span(std::exchange(next, next + count), count); };

  if (counts[0] > 0) {
    const auto stiffnesses = take(counts[0]), disabled = take(counts[1]);
    stiffnesses_.assign(stiffnesses.begin(), stiffnesses.end());
    disabled_stiffnesses_.assign(disabled.begin(), disabled.end());
    num_disabled_ = static_cast<std::size_t>(std::count(stiffnesses_.begin(), stiffnesses_.end(), 0));
  } else {
    for (std::size_t e = 0; e < num_elements(); ++e) stiffnesses_[e] = own_stiffness(e);
    num_disabled_ = 0;
  }
  const auto targets = take(counts[2]);
  if (!targets.empty()) profiles_to_change();
  for (std::size_t e = 0; e < profiles_.size(); ++e) profiles_[e].target = targets.empty() ? 0 : targets[e];
  const auto plastic = take(counts[3]);
  if (plastic.empty())
    std::fill(plastic_strains_.begin(), plastic_strains_.end(), 0);
  else
    plastic_strains_.assign(plastic.begin(), plastic.end());
  breaks_.clear();
  for (std::size_t k = 0; k < counts[4]; ++k) {
    const auto event = take(3);
    breaks_.push_back({static_cast<int>(event[0]), event[1], event[2]});
  }
  return total;
}

}  // namespace penalty
