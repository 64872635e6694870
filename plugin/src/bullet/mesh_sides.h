// On which side of triangle meshes the points of a soft body belong.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "mesh_contact.h"
#include "penalty/contact/weighted_point.h"
#include "penalty/fields/potential_field.h"
#include "penalty/stepping/particles.h"

class btCollisionObject;
class btCollisionShape;

namespace penalty {

struct Pose;

/// A soft body that comes near meshes, at the beginning of a step.
struct MeshVisitor {
  const Particles& particles;
  const PotentialField& field;            // whose elements hold the particles together
  std::span<const WeightedPoint> points;  // that may touch; empty: every particle
};

/// A triangle has two sides, and a point belongs on that where it is: unless it got there through the triangle, by depth
/// or by round-off. So the ways of all points relative to each mesh near the body are followed, from step to step: who
/// passes an odd number of triangles is on the wrong side from there on, until it is back, or away around the rim of the
/// mesh.
///
/// A body that appears in a mesh has no past. Elements that a mesh cuts have their particles on two sides of it: the
/// parts between cuts are of two colours, and those of the colour that has less mass are on the wrong side. An element
/// that is cut twice is not cut: a body may straddle a thin wall, and cloth hang over a ridge.
class MeshSides {
 public:
  MeshSides();
  ~MeshSides();

  /// Forgets the meshes that did not come near in the last step.
  void begin_step();

  /// Forgets all: the points are others from now on.
  void forget();

  /// Follows the body to where it is now relative to the meshes of the object, which is at `pose`, as far as they come within
  /// `reach` [m].
  void approach(const btCollisionObject& object, const Pose& pose, const MeshVisitor& body, Real reach);

  /// Whether a point is to be asked for its planes wherever it is: it is on the wrong side of one of these meshes, or may
  /// have passed one.
  bool follows(int point) const;

  /// Appends the planes of one of its points against these meshes, in the frame of the object. `way`: that the point will go
  /// relative to the object, left to itself [m]; `margin`: that it keeps [m].
  void append_planes(int point, const Vector3& way, Real margin, Real reach, std::vector<SurfacePoint>& found);

 private:
  struct Mesh;

  std::vector<std::unique_ptr<Mesh>> meshes_;
  std::vector<Mesh*> near_;  // of the object that was approached last
};

}  // namespace penalty
