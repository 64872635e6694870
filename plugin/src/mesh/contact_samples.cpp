#include <cmath>
#include <stdexcept>

#include "mesh_text.h"
#include "penalty/mesh/embed.h"
#include "point_grid.h"

namespace penalty {

// Greedy: each vertex that no earlier sample is close to becomes one.
std::vector<int> contact_samples(const EmbeddedSurface& embedded, Real spacing) {
  if (!(spacing > 0) || !std::isfinite(spacing))
    throw std::invalid_argument("contact_samples: spacing is " + to_text(spacing) + ", not positive and finite");
  const Eigen::Matrix3Xd& vertices = embedded.surface.vertices;
  std::vector<int> samples;
  if (vertices.cols() == 0) return samples;
  PointGrid taken(vertices.col(0), spacing);
  for (int v = 0; v < vertices.cols(); ++v) {
    const Vector3 p = vertices.col(v);
    if (taken.nearby(p) >= 0) continue;
    taken.add(p, v);
    samples.push_back(v);
  }
  return samples;
}

}  // namespace penalty
