// Random elements of any kind: at rest, stretched, compressed, inverted, somewhere else; of any size and anywhere.
#pragma once
#include <stdexcept>

#include "math/random.h"
#include "penalty/constraints/kinds.h"

namespace penalty::testing {

template <class List>
struct TypesOf;
template <class... Kinds>
struct TypesOf<KindList<Kinds...>> {
  using type = ::testing::Types<Kinds...>;
};
using KindTypes = TypesOf<AllKinds>::type;

enum class Shape { noisy, stretched, compressed, inverted, anywhere };
inline constexpr unsigned num_shapes = 5;
inline constexpr unsigned num_samples = 500;

template <Constraint Kind>
struct Sample {
  static constexpr int num_points = Kind::num_points;

  unsigned seed;
  Shape shape;
  Real size;  // 1e-3 to 1e3 [m]
  Points<num_points> rest, points;
  Kind kind;

  Real difference_step() const { return 6e-6 * size; }
};

// Points in a cube of side 1 without short legs or flat corners: the gradient of C there, at rest, is not large.
template <Constraint Kind>
Points<Kind::num_points> well_shaped_points(Random& random) {
  for (;;) {
    const Points<Kind::num_points> points = random.vectors<Kind::num_points>(Kind::num_points, 0.5);
    try {
      if (Kind::at_rest(points).gradient(points).colwise().norm().sum() < 20) return points;
    } catch (const std::invalid_argument&) {
    }
  }
}

template <Constraint Kind>
Sample<Kind> sample(unsigned seed) {
  constexpr int n = Kind::num_points;
  Random random(seed);
  const Shape shape = static_cast<Shape>(seed % num_shapes);
  const Real size = std::pow(10.0, random.uniform(-3, 3));
  Points<n> rest = well_shaped_points<Kind>(random);
  if (seed / num_shapes % 2 == 1) rest.col(n - 1).swap(rest.col(n - 2));  // the other orientation
  const Vector3 axis = random.direction();
  const auto along_axis = [&](Real factor) -> Matrix3 {
    return Matrix3::Identity() + (factor - 1) * axis * axis.transpose();
  };
  const Points<n> noise = random.vectors<n>(n, 0.05);
  Points<n> points = rest;
  switch (shape) {
    case Shape::noisy:
      points = rest + noise;
      break;
    case Shape::stretched:
      points = along_axis(2.5) * rest + noise;
      break;
    case Shape::compressed:
      points = along_axis(0.3) * rest;
      break;
    case Shape::inverted:
      points = along_axis(-1.2) * rest + noise;
      break;
    case Shape::anywhere:
      points = well_shaped_points<Kind>(random);
      break;
  }
  const Points<n> turned = random.rotation() * points;
  const Vector3 away = random.vector(2);
  points = turned.colwise() + away;
  return {seed, shape, size, size * rest, size * points, Kind::at_rest(size * rest)};
}

template <Constraint Kind>
std::string trace(const Sample<Kind>& s) {
  return std::string(Kind::name) + ", seed " + std::to_string(s.seed) + ", size " + std::to_string(s.size) + " m";
}

// Sum of the vectors over the sum of their lengths.
template <int N>
Real net_force(const Gradient<N>& vectors) {
  return vectors.rowwise().sum().norm() / vectors.colwise().norm().sum();
}

// Sum of the moments over the sum of arm times length.
template <int N>
Real net_torque(const Points<N>& points, const Gradient<N>& vectors) {
  Vector3 torque = Vector3::Zero();
  Real scale = 0;
  for (int k = 0; k < N; ++k) {
    torque += points.col(k).cross(vectors.col(k));
    scale += points.col(k).norm() * vectors.col(k).norm();
  }
  return torque.norm() / scale;
}

/// Points that no kind has a regular gradient at: all in one place, on a line, in a plane.
template <int N>
std::vector<Points<N>> degenerate_points(Real size) {
  Points<N> coincident, collinear, coplanar, all_but_one;
  for (int k = 0; k < N; ++k) {
    coincident.col(k) = Vector3(1, 2, 3);
    collinear.col(k) = k * Vector3(1, -1, 0.5);
    coplanar.col(k) = Vector3(k % 2, k / 2, 0);
    all_but_one.col(k) = k == 0 ? Vector3(1, 0, 0) : Vector3(0, 0, 0);
  }
  return {size * coincident, size * collinear, size * coplanar, size * all_but_one, Points<N>::Zero()};
}

}  // namespace penalty::testing
