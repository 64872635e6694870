#include "penalty/stepping/step_report.h"

namespace penalty {

std::span<const EnergyFlows::Part> EnergyFlows::parts() {
  static constexpr Part list[] = {{"constant_forces", &EnergyFlows::constant_forces},
                                  {"contacts", &EnergyFlows::contacts},
                                  {"couplings", &EnergyFlows::couplings},
                                  {"driving", &EnergyFlows::driving},
                                  {"changes", &EnergyFlows::changes},
                                  {"damping", &EnergyFlows::damping},
                                  {"drag", &EnergyFlows::drag},
                                  {"inelastic", &EnergyFlows::inelastic},
                                  {"integration", &EnergyFlows::integration},
                                  {"contact_loss", &EnergyFlows::contact_loss}};
  return list;
}

EnergyFlows& EnergyFlows::operator+=(const EnergyFlows& other) {
  for (const Part& part : parts()) this->*part.member += other.*part.member;
  return *this;
}

}  // namespace penalty
