#include "penalty/fields/ledger.h"

#include <cmath>

namespace penalty {

std::vector<LedgerEntry> ledger(const PotentialField& field, const Positions& x) {
  std::vector<LedgerEntry> entries;
  for (std::size_t k = 0; k < field.potentials().size(); ++k) {
    const Potential& potential = *field.potentials()[k];
    LedgerEntry entry{.name = std::string(potential.name()), .num_elements = potential.num_elements()};
    if (field.acts(k))
      potential.visit_elements(x, [&](const ElementView& element) {
        if (!element.enabled) return;
        const Real strain = std::abs(element.strain);
        entry.energy += element.energy;
        entry.mean_strain += strain;
        if (entry.num_enabled++ == 0 || strain > entry.largest_strain) {
          entry.largest_strain = strain;
          entry.largest_element = element.number;
        }
      });
    if (entry.num_enabled > 0) entry.mean_strain /= static_cast<Real>(entry.num_enabled);
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace penalty
