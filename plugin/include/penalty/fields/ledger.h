// What the elements of a field hold: energies and strains, one by one, batch by batch, particle by particle.
#pragma once
#include "penalty/fields/potential_field.h"

namespace penalty {

/// A line of the energy ledger: one batch of elements at one instant. Strains are those that are resisted: C less
/// target and free play.
struct LedgerEntry {
  std::string name;
  std::size_t num_elements = 0, num_enabled = 0;
  Real energy = 0;                           // [J]
  Real mean_strain = 0, largest_strain = 0;  // of |strain|, over the enabled elements
  int largest_element = -1;                  // where it is largest
};

/// One entry a potential of the field. Of a phase that does not act no element is enabled.
std::vector<LedgerEntry> ledger(const PotentialField& field, const Positions& x);

// The following take a field or a potential: whatever has `visit_elements`.

/// The resisted strain of every element, in the order in which they were added; 0 where it is disabled.
template <class Elements>
std::vector<Real> strains(const Elements& elements, const Positions& x) {
  std::vector<Real> strains;
  strains.reserve(elements.num_elements());
  elements.visit_elements(x, [&](const ElementView& element) { strains.push_back(element.strain); });
  return strains;
}

/// The energy of every element [J], in the same order.
template <class Elements>
std::vector<Real> energies(const Elements& elements, const Positions& x) {
  std::vector<Real> energies;
  energies.reserve(elements.num_elements());
  elements.visit_elements(x, [&](const ElementView& element) { energies.push_back(element.energy); });
  return energies;
}

/// The share of each particle in the energy of its elements [J]: equal shares for all points of an element.
template <class Elements>
Eigen::VectorXd particle_energies(const Elements& elements, const Positions& x) {
  Eigen::VectorXd energies = Eigen::VectorXd::Zero(x.cols());
  elements.visit_elements(x, [&](const ElementView& element) {
    const Real share = element.energy / static_cast<Real>(element.stencil.size());
    for (const int i : element.stencil) energies[i] += share;
  });
  return energies;
}

}  // namespace penalty
