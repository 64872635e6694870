// The implicit step in contact where it should be hard: stiff bodies, long steps, heavy loads.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "penalty/math/types.h"

namespace penalty::study {

/// What came of something that falls. Energies are over what the fall from its height gives.
struct Impact {
  Real gain = 0;          // of energy, at most, since the start
  Real kinetic_end = 0;   // kinetic energy at the end
  Real depth = 0;         // of a node in what it touches, at most [m]
  Real least_volume = 1;  // of a tetrahedron, over that at rest
  Real milliseconds = 0;  // CPU time of a step in contact
  bool finite = true;

  bool is_stable() const;  // finite, and no more energy than a thousandth gained
};

/// A torus of 4374 tetrahedra and 1 kg falls by 2 m on a plane.
struct Drop : Impact {
  Real stiffness = 0;     // K of every element [J]
  Real rate = 0;          // steps a second
  Real damping_time = 0;  // [s]
};

/// It lies there, and a rigid slab, 3 m x 0.4 m x 3 m, comes down on it at 6 m/s; 60 steps a second.
struct Slab : Impact {
  Real mass = 0;       // [kg]
  Real stiffness = 0;  // [J]
};

Drop drop(Real stiffness, Real rate, Real damping_time, Real duration);
Slab load(Real mass, Real stiffness, Real duration);

struct ImpactTable {
  std::vector<Drop> drops;  // K from 0.1 to 1e8 J in decades, at 30, 60 and 240 Hz, without damping and with 0.01 s
  std::vector<Slab> slabs;  // 10, 100 and 1000 kg; K from 10 to 1e5 J in decades

  bool is_stable() const;
  std::string text() const;
};

/// `duration` is the simulated time of each [s]; `progress` is told how much of it all is done.
ImpactTable measure_impacts(Real duration, const std::function<void(Real share)>& progress);

}  // namespace penalty::study
