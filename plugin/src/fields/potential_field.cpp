#include "penalty/fields/potential_field.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "penalty/fields/broken_elements.h"

namespace penalty {

PotentialField::PotentialField(const Eigen::Matrix3Xd& rest_positions) : rest_(pack(rest_positions)) {
  for (Eigen::Index i = 0; i < rest_positions.cols(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (!std::isfinite(rest_positions(axis, i)))
        throw std::invalid_argument("field: rest position " + std::to_string(i) + ": coordinate " + "xyz"[axis] +
                                    " is " + to_text(rest_positions(axis, i)));
}

Potential& PotentialField::add(std::unique_ptr<Potential> potential) {
  if (!potential) throw std::invalid_argument("field: null potential");
  phases_.reserve(phases_.size() + 1);
  potentials_.push_back(std::move(potential));
  phases_.emplace_back();
  return *potentials_.back();
}

void PotentialField::check_size(const PotentialField& other, const char* what) const {
  if (other.num_particles() != num_particles())
    throw std::invalid_argument("field: " + std::string(what) + " has " + std::to_string(other.num_particles()) +
                                " particles, this one " + std::to_string(num_particles()));
}

void PotentialField::add(PotentialField field) {
  check_size(field, "the field to be added");
  const auto first = static_cast<int>(switches_.size());
  for (Phase& phase : field.phases_)
    if (phase.decided_by >= 0) phase.decided_by += first;
  switches_.reserve(switches_.size() + field.switches_.size());
  phases_.reserve(phases_.size() + field.phases_.size());
  potentials_.reserve(potentials_.size() + field.potentials_.size());
  std::move(field.switches_.begin(), field.switches_.end(), std::back_inserter(switches_));
  std::move(field.phases_.begin(), field.phases_.end(), std::back_inserter(phases_));
  std::move(field.potentials_.begin(), field.potentials_.end(), std::back_inserter(potentials_));
}

void PotentialField::add_soft_phase(std::span<const Tetrahedron> tetrahedra, PotentialField soft,
                                    const PhaseThresholds& thresholds) {
  check_size(soft, "the soft phase");
  if (!switches_.empty() || !soft.switches_.empty())
    throw std::invalid_argument("field: one of the phases is of two phases itself");
  switches_.emplace_back(tetrahedra, rest_, thresholds);
  phases_.assign(potentials_.size(), {.decided_by = 0, .soft = false});
  phases_.insert(phases_.begin(), soft.potentials_.size(), {.decided_by = 0, .soft = true});
  potentials_.insert(potentials_.begin(), std::make_move_iterator(soft.potentials_.begin()),
                     std::make_move_iterator(soft.potentials_.end()));
}

bool PotentialField::is_soft() const {
  return std::any_of(switches_.begin(), switches_.end(), [](const PhaseSwitch& s) { return s.is_far; });
}

Real PotentialField::largest_strain(const Positions& x) const {
  Real largest = 0;
  for (const PhaseSwitch& phases : switches_) largest = std::max(largest, phases.largest_strain(x));
  return largest;
}

void PotentialField::note_breaks() {
  const BreakCount count = count_breaks(*this);
  if (count == noted_) return;
  noted_ = count;
  for (std::size_t k = 0; k < switches_.size(); ++k) {
    BrokenElements broken(count.now > 0 ? num_particles() : 0);
    for (std::size_t p = 0; p < potentials_.size(); ++p)
      if (phases_[p].decided_by == static_cast<int>(k)) broken.add(*potentials_[p], rest_);
    switches_[k].set_broken(broken);
  }
}

void PotentialField::break_what_is_lost(int phases, const Positions& x) {
  if (!switches_[phases].any_broken()) return;
  for (std::size_t p = 0; p < potentials_.size(); ++p) {
    auto* batch = dynamic_cast<ElementBatch*>(potentials_[p].get());
    if (!batch || phases_[p].decided_by != phases || acts(p)) continue;
    std::vector<std::pair<int, Real>> lost;
    batch->visit_elements(x, [&](const ElementView& element) {
      if (element.enabled && switches_[phases].has_lost(element.stencil))
        lost.emplace_back(element.number, element.strain);
    });
    for (const auto& [element, strain] : lost) batch->break_idle(element, strain);
  }
}

Real PotentialField::choose_phase(const Positions& x) {
  if (switches_.empty()) return 0;
  note_breaks();
  Real added = 0;
  for (std::size_t k = 0; k < switches_.size(); ++k) {
    if (switches_[k].looks_far(x) == switches_[k].is_far) continue;
    const auto energy_of_phase = [&] {
      Real sum = 0;
      for (std::size_t p = 0; p < potentials_.size(); ++p)
        if (phases_[p].decided_by == static_cast<int>(k) && acts(p)) sum += potentials_[p]->energy(x);
      return sum;
    };
    const Real before = energy_of_phase();
    break_what_is_lost(static_cast<int>(k), x);
    switches_[k].is_far = !switches_[k].is_far;
    added += energy_of_phase() - before;
  }
  return added;
}

ElementBatch* PotentialField::find(std::string_view name) {
  return static_cast<ElementBatch*>(
      find_if([name](const Potential& p) { return dynamic_cast<const ElementBatch*>(&p) && p.name() == name; }));
}

ElementBatch& PotentialField::batch(std::string_view name) {
  if (ElementBatch* found = find(name)) return *found;
  fail_to_find("no batch \"" + std::string(name) + "\"");
}

void PotentialField::fail_to_find(const std::string& what) const {
  std::string names;
  for (const auto& potential : potentials_)
    names += (names.empty() ? "\"" : ", \"") + std::string(potential->name()) + "\"";
  throw std::invalid_argument("field: " + what + "; there is " + (names.empty() ? "nothing" : names));
}

std::size_t PotentialField::num_elements() const {
  std::size_t sum = 0;
  for (const auto& potential : potentials_) sum += potential->num_elements();
  return sum;
}

Real PotentialField::energy(const Positions& x) const {
  Real sum = 0;
  for_each_acting([&](const Potential& p) { sum += p.energy(x); });
  return sum;
}

Real PotentialField::add_forces(const Positions& x, Forces f) const {
  Real sum = 0;
  for_each_acting([&](const Potential& p) { sum += p.add_forces(x, f); });
  return sum;
}

void PotentialField::add_forces_only(const Positions& x, Forces f) const {
  for_each_acting([&](const Potential& p) { p.add_forces_only(x, f); });
}

void PotentialField::add_stiffness(const Positions& x, StiffnessModel model, System& stiffness) const {
  const auto add = [&](const Potential& p) { p.add_stiffness(x, model, stiffness); };
  if (stiffness.is_counting())
    for (const auto& potential : potentials_) add(*potential);
  else if (model == StiffnessModel::taut)
    for_each_stiff(add);
  else
    for_each_acting(add);
}

void PotentialField::add_damping(const Positions& x, Real time, System& damping) const {
  if (damping.is_counting())
    for (const auto& potential : potentials_) potential->add_damping(x, time, damping);
  else
    for_each_acting([&](const Potential& p) { p.add_damping(x, time, damping); });
}

void PotentialField::dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                               Forces v) const {
  for_each_acting([&](const Potential& p) { p.dissipate(x, inverse_masses, time, duration, v); });
}

bool PotentialField::damps() const {
  bool any = false;
  for_each_acting([&](const Potential& p) { any = any || p.damps(); });
  return any;
}

bool PotentialField::evolves() const {
  bool any = false;
  for_each_acting([&](const Potential& p) { any = any || p.evolves(); });
  return any;
}

Real PotentialField::evolve(const Positions& x, Real duration) {
  Real taken = 0;
  for_each_acting([&](Potential& p) { taken += p.evolve(x, duration); });
  return taken;
}

std::uint64_t PotentialField::stiffness_version() const {
  std::uint64_t sum = potentials_.size();
  for (const auto& potential : potentials_) sum += potential->stiffness_version();
  return sum;
}

void PotentialField::visit_elements(const Positions& x, const ElementVisitor& visit) const {
  for (std::size_t k = 0; k < potentials_.size(); ++k)
    if (acts(k))
      potentials_[k]->visit_elements(x, visit);
    else
      potentials_[k]->visit_elements(x, [&](const ElementView& element) {
        visit({.number = element.number, .stencil = element.stencil, .strain = 0, .energy = 0, .enabled = false});
      });
}

FieldState PotentialField::state() const {
  FieldState state;
  get_state(state);
  return state;
}

void PotentialField::get_state(FieldState& state) const {
  state.values.clear();
  for (const PhaseSwitch& phases : switches_) state.values.push_back(phases.is_far);
  for (const auto& potential : potentials_) potential->append_state(state.values);
}

void PotentialField::set_state(const FieldState& state) {
  noted_.reset();
  std::span<const Real> values = state.values;
  if (values.size() < switches_.size())
    throw std::invalid_argument("field: the state holds " + std::to_string(values.size()) + " numbers for " +
                                std::to_string(switches_.size()) + " phases and what they hold");
  for (std::size_t k = 0; k < switches_.size(); ++k) switches_[k].is_far = values[k] != 0;
  values = values.subspan(switches_.size());
  for (const auto& potential : potentials_) values = values.subspan(potential->set_state(values));
  if (!values.empty())
    throw std::invalid_argument("field: the state holds " + std::to_string(values.size()) + " numbers too many");
}

}  // namespace penalty
