// What of the surfaces of soft bodies crosses, and how near they come: measured on what is drawn, by tests of its own.
// What keeps them apart has no part in it.
#pragma once
#include <vector>

#include "penalty/contact/box_tree.h"
#include "scenes/body_mesh.h"
#include "scenes/rigid_object.h"
#include "scenes/scene_state.h"

namespace penalty::demo {

class DrawnSurface {
 public:
  explicit DrawnSurface(BodyMesh mesh);
  void move_to(const PackedVectors& positions);  // of the vertices of the mesh [m]

  /// Edges of this surface that go through triangles of `other`, which may be this one, and share no vertex with them.
  long crossings(const DrawnSurface& other) const;

  /// Least distance of a vertex of this surface from a triangle of `other` that it is no corner of [m]; `reach` if none is
  /// as near as that.
  Real distance(const DrawnSurface& other, Real reach) const;

  /// Least distance of the surface from a point [m], and whether it encloses that point.
  Real distance(const Vector3& point) const;
  bool encloses(const Vector3& point) const;

  const Eigen::Matrix3Xd& vertices() const { return x_; }  // [m]

 private:
  Vector3 at(int vertex) const { return x_.col(vertex); }
  Box box_of(std::span<const int> vertices) const;

  BodyMesh mesh_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  std::vector<int> corners_;  // of triangles, each once
  Eigen::Matrix3Xd x_;
  BoxTree tree_;
};

/// Whether they have something in common: their surfaces cross, or one lies inside the other.
bool overlap(const DrawnSurface& a, const DrawnSurface& b);

/// The surfaces of all bodies of a scene, followed from step to step.
class SurfaceWatch {
 public:
  /// Distances beyond `reach` [m] are not looked for.
  SurfaceWatch(const std::vector<BodyMesh>& meshes, Real reach);

  void see(const SceneState& state);

  const std::vector<DrawnSurface>& surfaces() const { return surfaces_; }
  // In all that was seen:
  long crossings() const { return crossings_; }            // of one with another
  long self_crossings() const { return self_crossings_; }  // of each with itself
  Real least_distance() const { return least_; }           // of both kinds, or `reach` [m]
  // In what was seen last:
  int overlapping_pairs() const;

 private:
  std::vector<DrawnSurface> surfaces_;
  Real reach_, least_;
  long crossings_ = 0, self_crossings_ = 0;
};

}  // namespace penalty::demo
