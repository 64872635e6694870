// A scene at a moment, as far as it measures itself.
#pragma once
#include <string>
#include <vector>

#include "penalty/fields/potential_field.h"
#include "penalty/stepping/particles.h"
#include "scenes/pose.h"

namespace penalty::demo {

/// A measured number that the summary gives under this name.
struct Fact {
  std::string name;
  double value;
};

struct SoftState {
  const Particles& particles;
  const PotentialField& field;
};

struct SceneState {
  Real time = 0;                       // [s]
  std::vector<SoftState> bodies = {};  // as in the setup
  std::vector<Pose> objects = {};      // likewise

  const PackedVectors& x(std::size_t body = 0) const { return bodies[body].particles.positions; }  // [m]
  const PotentialField& field(std::size_t body = 0) const { return bodies[body].field; }
};

}  // namespace penalty::demo
