// Groups of points for shape matching.
#pragma once
#include "kinds/samples.h"
#include "penalty/kinds/shape_match.h"

namespace penalty::testing {

enum class Group { solid, planar, collinear };

struct GroupSample {
  Points<dynamic> rest, points;
  std::vector<Real> weights;
  ShapeMatch kind;
  Real size;  // [m]
};

inline Points<dynamic> rest_points(Random& random, Group group, int n) {
  Points<dynamic> rest = random.vectors<dynamic>(n, 1);
  if (group != Group::solid) rest.row(2).setZero();
  if (group == Group::collinear) rest.row(1).setZero();
  return random.rotation() * rest;
}

// Noisy, stretched, compressed, inverted and arbitrary groups of 3 to 8 points, of any size, somewhere.
inline GroupSample sample(unsigned seed, Group group = Group::solid) {
  Random random(seed);
  const int n = 3 + static_cast<int>(random.index(6)) + (group == Group::solid ? 1 : 0);
  const Points<dynamic> rest = rest_points(random, group, n);
  Matrix3 change = Matrix3::Identity();
  const Vector3 axis = random.direction();
  const Real factor = std::array<Real, 5>{1, 2.5, 0.3, -0.6, 1}[seed % 5];
  change += (factor - 1) * axis * axis.transpose();
  Points<dynamic> points = random.rotation() * change * rest + random.vectors<dynamic>(n, seed % 5 == 4 ? 1.0 : 0.1);
  points.colwise() += random.vector(2);
  std::vector<Real> weights;
  weights.reserve(n);
  for (int i = 0; i < n; ++i) weights.push_back(random.uniform(0.5, 3));
  const Real size = std::pow(10.0, random.uniform(-3, 3));
  return {size * rest, size * points, weights, ShapeMatch(weights).at_rest(size * rest), size};
}

inline Points<dynamic> cube() {
  Points<dynamic> p(3, 8);
  for (int i = 0; i < 8; ++i) p.col(i) = Vector3(i & 1, i >> 1 & 1, i >> 2);
  return p;
}

}  // namespace penalty::testing
