// The implicit step where it should be hard: stiff bodies, long steps.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "penalty/math/types.h"

namespace penalty::study {

/// A cube of 320 tetrahedra and 1 kg that starts stretched 1.6 times, drifting and spinning, free of forces from
/// outside.
struct FlightResult {
  Real stiffness = 0;                                 // K of every element [J]
  Real rate = 0;                                      // steps a second
  Real largest_energy = 0;                            // elastic and kinetic, over that at the start
  Real end_energy = 0;                                // likewise
  Real linear_drift = 0, angular_drift = 0;           // change of the momenta, over what they were
  Real newton_iterations = 0, linear_iterations = 0;  // a step
  bool finite = true;

  bool is_stable() const;  // finite, and never more energy than at the start, but for round-off
};

/// A chain of 21 nodes of 2 g, 0.1 m apart, the last of 5 kg, that hangs from the first; moved aside by up to 1e-4 m.
struct ChainResult {
  Real stiffness = 0;  // [J]
  Real farthest = 0;   // of a node from the axis [m]
  bool finite = true;
};

FlightResult fly(Real stiffness, Real rate, Real duration);
ChainResult hang(Real stiffness, Real duration);

struct StabilityTable {
  std::vector<FlightResult> flights;  // K from 1e-2 to 1e8 J in decades, at 30, 60 and 240 Hz
  std::vector<ChainResult> chains;    // K from 1e2 to 1e6 J in decades, at 60 Hz

  bool is_stable() const;
  std::string text() const;
};

/// `flight` and `chain` are simulated times [s]; `progress` is told how much of it all is done.
StabilityTable measure_stability(Real flight, Real chain, const std::function<void(Real share)>& progress);

}  // namespace penalty::study
