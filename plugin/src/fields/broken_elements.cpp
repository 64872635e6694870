#include "penalty/fields/broken_elements.h"

#include <algorithm>

#include "penalty/fields/element_batch.h"

namespace penalty {
namespace {

// Null: nothing of it ever broke.
const ElementBatch* with_breaks(const Potential& potential) {
  const auto* batch = dynamic_cast<const ElementBatch*>(&potential);
  return batch && !batch->breaks().empty() ? batch : nullptr;
}

std::vector<int> broken_in(const ElementBatch& batch) {
  std::vector<int> elements;
  for (const Break& event : batch.breaks())
    if (!batch.is_enabled(event.element)) elements.push_back(event.element);
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  return elements;
}

}  // namespace

BreakCount count_breaks(const PotentialField& field) {
  BreakCount count;
  for (const auto& potential : field.potentials())
    if (const ElementBatch* batch = with_breaks(*potential)) {
      count.ever += batch->breaks().size();
      for (const Break& event : batch->breaks()) count.now += !batch->is_enabled(event.element);
    }
  return count;
}

BrokenElements::BrokenElements(const PotentialField& field) : BrokenElements(field.num_particles()) {
  for (const auto& potential : field.potentials()) add(*potential, field.rest_positions());
}

void BrokenElements::add(const Potential& potential, const Positions& rest) {
  const ElementBatch* batch = with_breaks(potential);
  if (!batch) return;
  const std::vector<int> broken = broken_in(*batch);
  num_broken_ += broken.size();
  batch->visit_elements(rest, [&](const ElementView& element) {
    if (std::binary_search(broken.begin(), broken.end(), element.number))
      stencils_of_[element.stencil.front()].emplace_back(element.stencil.begin(), element.stencil.end());
  });
}

bool BrokenElements::cut(std::span<const int> particles) const {
  const auto is_among = [&](int i) { return std::find(particles.begin(), particles.end(), i) != particles.end(); };
  return !empty() && std::any_of(particles.begin(), particles.end(), [&](int first) {
    const auto& stencils = stencils_of_[first];
    return std::any_of(stencils.begin(), stencils.end(), [&](const std::vector<int>& stencil) {
      return std::all_of(stencil.begin(), stencil.end(), is_among);
    });
  });
}

}  // namespace penalty
