// Random elements of any kind: at rest, stretched, compressed, inverted, somewhere else; of any size and anywhere.
#pragma once
#include <stdexcept>
#include <tuple>

#include "math/random.h"
#include "penalty/kinds/kinds.h"

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

/// Makes rest states of any kind, also of one with parameters: of points in a region of `size` [m].
template <Constraint Kind>
Kind prototype(Real size) {
  if constexpr (std::same_as<Kind, Distance>)
    return Distance::to(size * Vector3::Ones());
  else
    return Kind{};
}

/// Whether net force and net torque vanish: always, unless the kind says that something outside holds it.
template <class Kind>
inline constexpr bool conserves_momentum = [] {
  if constexpr (requires { Kind::conserves_momentum; })
    return Kind::conserves_momentum;
  else
    return true;
}();

/// The kinds that nothing outside holds.
template <class List>
struct InternalTypesOf;
template <class... Kinds>
struct InternalTypesOf<KindList<Kinds...>> {
  template <class... Types>
  static ::testing::Types<Types...> listed(std::tuple<Types...>);
  template <class Kind>
  using Kept = std::conditional_t<conserves_momentum<Kind>, std::tuple<Kind>, std::tuple<>>;
  using type = decltype(listed(std::tuple_cat(std::declval<Kept<Kinds>>()...)));
};
using InternalKindTypes = InternalTypesOf<AllKinds>::type;

/// The same element elsewhere: what a kind holds besides its points moves with them.
template <Constraint Kind>
Kind moved(Kind kind, const Matrix3& rotation, const Vector3& translation) {
  if constexpr (std::same_as<Kind, Distance>) kind.target = rotation * kind.target + translation;
  return kind;
}

template <class Kind>
inline constexpr bool wraps = std::same_as<Kind, TetrahedronDihedralAngle> || std::same_as<Kind, BendingAngle>;
template <class Kind>
inline constexpr bool is_singular_where_flat =
    wraps<Kind> || std::same_as<Kind, CornerAngle> || std::same_as<Kind, TriangleArea>;

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

// Without short legs or flat corners: the gradient of C there, at rest, is not large.
template <Constraint Kind>
bool is_well_shaped(const Points<Kind::num_points>& points) {
  try {
    return prototype<Kind>(1).at_rest(points).gradient(points).colwise().norm().sum() < 20;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

// In a cube of side 1.
template <Constraint Kind>
Points<Kind::num_points> well_shaped_points(Random& random) {
  Points<Kind::num_points> points;
  do points = random.vectors<Kind::num_points>(Kind::num_points, 0.5);
  while (!is_well_shaped<Kind>(points));
  return points;
}

// Whether differences of C, a few 1e-6 apart, can be compared with derivatives: not next to a point where a triangle
// has no normal, nor where an angle jumps by a turn.
template <Constraint Kind>
bool is_smooth_around(const Kind& kind, const Points<Kind::num_points>& points) {
  if constexpr (is_singular_where_flat<Kind>)
    if (!is_well_shaped<Kind>(points)) return false;
  if constexpr (std::same_as<Kind, CornerAngle>)  // its gradient stays small up to 0 and pi, its Hessian does not
    if (!is_well_shaped<TriangleArea>(points)) return false;
  return !wraps<Kind> || std::abs(kind.value(points)) < 3.1;
}

// A draw that is not smooth is drawn again, so that every seed gives a sample of its shape.
template <Constraint Kind>
Sample<Kind> sample(unsigned seed) {
  constexpr int n = Kind::num_points;
  Random random(seed);
  const Shape shape = static_cast<Shape>(seed % num_shapes);
  const Real size = std::pow(10.0, random.uniform(-3, 3));
  Points<n> rest, points;
  do {
    rest = well_shaped_points<Kind>(random);
    if constexpr (n > 1)
      if (seed / num_shapes % 2 == 1) rest.col(n - 1).swap(rest.col(n - 2));  // the other orientation
    const Vector3 axis = random.direction();
    const auto along_axis = [&](Real factor) -> Matrix3 {
      return Matrix3::Identity() + (factor - 1) * axis * axis.transpose();
    };
    const Points<n> noise = random.vectors<n>(n, 0.05);
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
  } while (!is_smooth_around(prototype<Kind>(1).at_rest(rest), points));
  const Points<n> turned = random.rotation() * points;
  const Vector3 away = random.vector(2);
  points = turned.colwise() + away;
  return {seed, shape, size, size * rest, size * points, prototype<Kind>(size).at_rest(size * rest)};
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
