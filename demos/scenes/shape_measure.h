// How far a body is from its rest shape: measured from the mesh alone, not through the potential that moves it.
#pragma once
#include <span>
#include <vector>

#include "penalty/fields/topology.h"

namespace penalty::demo {

struct ShapeErrors {
  std::size_t edges = 0, tetrahedra = 0;  // that were measured
  Real length_mean = 0, length_max = 0;   // |L - L0| / L0 over the edges
  Real volume_mean = 0, volume_max = 0;   // |V - V0| / V0 over the tetrahedra; NaN without any
  int inverted = 0;                       // tetrahedra of volume zero or less

  /// Those of both bodies together.
  ShapeErrors& operator+=(const ShapeErrors& other);
};

class ShapeMeasure {
 public:
  ShapeMeasure(const Eigen::Matrix3Xd& rest, std::span<const Tetrahedron> tetrahedra)
      : ShapeMeasure(rest, edges_of(tetrahedra), tetrahedra) {}
  ShapeMeasure(const Eigen::Matrix3Xd& rest, std::vector<Edge> edges, std::span<const Tetrahedron> tetrahedra = {});

  ShapeErrors errors(const Positions& x) const;

  /// Mean |L - L0| / L0 of the edges that meet in a vertex; 0 where none does.
  Eigen::VectorXd vertex_strains(const Positions& x) const;

  /// Largest distance of a vertex to the rest shape after the best rotation and translation (least squares, never a
  /// reflection), over the diagonal of the rest bounding box.
  Real rest_error(const Positions& x) const;

 private:
  Eigen::Matrix3Xd rest_;
  std::vector<Tetrahedron> tetrahedra_;
  std::vector<Edge> edges_;
  std::vector<Real> lengths_, volumes_;
};

}  // namespace penalty::demo
