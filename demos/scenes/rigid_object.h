// What a scene has besides its soft bodies: balls and boxes, free or moved along a path.
#pragma once
#include <functional>
#include <variant>

#include "scenes/pose.h"

namespace penalty::demo {

struct Ball {
  Real radius;  // [m]
};
struct Block {
  Vector3 half_extents;  // [m]
};

struct RigidObject {
  std::variant<Ball, Block> shape;
  Pose pose = {};         // at the start
  Real mass = 0;          // [kg]; 0: it stands still, or follows `path`
  float friction = 0.7f;  // Coulomb coefficient, multiplied with that of what it touches
  bool scenery = false;   // drawn in grey: the stage, not a player
  /// Where it is at a time [s], whatever it meets; empty: left to its mass. pose is then path(0).
  std::function<Pose(Real time)> path = {};
  bool pushes_back() const { return mass > 0 && !path; }
};

/// Moment of inertia about the principal axes [kg m²].
Vector3 inertia(const RigidObject& object);

/// How deep `point` lies below the surface at pose `pose` [m]; negative outside.
Real depth(const RigidObject& object, const Pose& pose, const Vector3& point);

/// Twice the smallest extent from the middle [m].
Real thickness(const RigidObject& object);

}  // namespace penalty::demo
