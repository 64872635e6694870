// A soft body of a scene: its mesh, what moves it, how it starts.
#pragma once
#include <functional>

#include "penalty/fields/potential_field.h"
#include "scenes/body_mesh.h"

namespace penalty::demo {

struct SoftObject {
  BodyMesh mesh;  // at rest
  PotentialField field;
  Real mass = 1;                     // of the body, the same for every vertex [kg]
  Eigen::Matrix3Xd positions = {};   // at the start, 3 x vertices [m]
  Eigen::Matrix3Xd velocities = {};  // at the start [m/s]; empty: it is at rest
  std::vector<int> pinned = {};      // vertices that nothing moves
  int carrier = -1;                  // but this object of the scene, which has a path; -1: none
  std::vector<int> tip = {};         // vertices whose mean drop is followed
  Real friction = 0.7;               // Coulomb coefficient, multiplied with that of what it touches
  Real restitution = 0;              // likewise; the ground has 1
  /// Called before each world step with the time at its start [s]: what changes about the elements in the course of the
  /// scene. Empty: nothing does. Before `control_start` it is not called, since looking for changes wakes the body.
  std::function<void(PotentialField& field, Real time)> control = {};
  Real control_start = 0;  // [s]
};

/// The bodies of a scene that has one.
inline std::vector<SoftObject> alone(SoftObject body) {
  std::vector<SoftObject> bodies;
  bodies.push_back(std::move(body));
  return bodies;
}

}  // namespace penalty::demo
