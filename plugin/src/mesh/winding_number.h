// Inside or outside of any surface: closed, with holes, doubled, branching.
#pragma once
#include <vector>

#include "penalty/mesh/triangle_surface.h"

namespace penalty {

/// How often a surface goes round a point: the sum of the solid angles of its triangles (Van Oosterom and Strackee, IEEE
/// Trans. Biomed. Eng. 30, 1983) over 4 pi. Inside a closed surface 1, outside 0; inside one with holes still near 1
/// (Jacobson, Kavan and Sorkine-Hornung, SIGGRAPH 2013). Triangles that are far away, seen from the point, count
/// together as one dipole of their area (Barill et al., SIGGRAPH 2018, of first order): right to some hundredths.
class WindingNumber {
 public:
  /// `surface` is looked at as long as this lives.
  explicit WindingNumber(const TriangleSurface& surface);

  Real at(const Vector3& point) const { return nodes_.empty() ? 0 : sum(0, point); }

 private:
  struct Node {
    Vector3 center, area;  // mean of the triangles by area [m], sum of their area vectors [m²]
    Real radius;           // no corner is further from the center
    int begin, end;        // of order_
    int right;             // the left child follows its parent; 0: a leaf
  };
  void build(int begin, int end);
  Real sum(int node, const Vector3& point) const;

  const TriangleSurface& surface_;
  std::vector<int> order_;  // triangles, those of a node together
  std::vector<Vector3> middles_;
  std::vector<Node> nodes_;
};

}  // namespace penalty
