// Vertices of balls and spheres: an icosahedron, its faces cut evenly and bent round.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "penalty/fields/topology.h"

namespace penalty {

// The faces of a regular icosahedron about the origin: corner indices, counter-clockwise seen from outside.
struct Icosahedron {
  std::array<Vector3, 12> corners;
  std::vector<Triangle> faces;

  Icosahedron() {
    std::size_t count = 0;
    for (Real one : {-1.0, 1.0})
      for (Real golden : {-std::numbers::phi, std::numbers::phi})
        for (const Vector3& corner : {Vector3(0, one, golden), Vector3(one, golden, 0), Vector3(golden, 0, one)})
          corners[count++] = corner.normalized();
    const auto joined = [this](int a, int b) { return corners[a].dot(corners[b]) > 0.4; };  // 1/sqrt(5) along an edge
    for (int a = 0; a < 12; ++a)
      for (int b = a + 1; b < 12; ++b)
        for (int c = b + 1; c < 12; ++c)
          if (joined(a, b) && joined(b, c) && joined(a, c)) {
            const bool outward = corners[a].dot(corners[b].cross(corners[c])) > 0;
            faces.push_back(outward ? Triangle{a, b, c} : Triangle{a, c, b});
          }
  }
};

// Vertices of the ball, each made once although up to five faces of the icosahedron share it: a vertex is known by the
// corners it lies between and their weights.
class BallVertices {
 public:
  BallVertices(const Icosahedron& icosahedron, Real radius, int layers)
      : icosahedron_(icosahedron), radius_(radius), layers_(layers) {}

  // Weights are whole numbers; their sum is the layer.
  int at(const Triangle& face, const std::array<int, 3>& weights) {
    std::array<std::uint64_t, 3> parts;
    for (int k = 0; k < 3; ++k)
      parts[k] =
          weights[k] == 0 ? 0 : static_cast<std::uint64_t>(face[k] + 1) << 8 | static_cast<std::uint64_t>(weights[k]);
    std::sort(parts.begin(), parts.end());
    const std::uint64_t key = parts[0] << 32 | parts[1] << 16 | parts[2];
    const auto [entry, is_new] = index_.try_emplace(key, static_cast<int>(positions_.size()));
    if (is_new) positions_.push_back(position(face, weights));
    return entry->second;
  }

  Eigen::Matrix3Xd columns() const {
    Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(positions_.size()));
    for (std::size_t i = 0; i < positions_.size(); ++i) matrix.col(static_cast<Eigen::Index>(i)) = positions_[i];
    return matrix;
  }

 private:
  // Sines instead of the weights themselves keep the spacing along the edges of the icosahedron even.
  Vector3 position(const Triangle& face, const std::array<int, 3>& weights) const {
    const int layer = weights[0] + weights[1] + weights[2];
    if (layer == 0) return Vector3::Zero();
    const Real edge_angle = std::atan(Real{2});
    Vector3 direction = Vector3::Zero();
    for (int k = 0; k < 3; ++k) direction += std::sin(edge_angle * weights[k] / layer) * icosahedron_.corners[face[k]];
    return radius_ * layer / layers_ * direction.normalized();
  }

  const Icosahedron& icosahedron_;
  Real radius_;
  int layers_;
  std::unordered_map<std::uint64_t, int> index_;
  std::vector<Vector3> positions_;
};

}  // namespace penalty
