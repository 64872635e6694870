// Random elements of any kind of the list: at rest, stretched, compressed, inverted, somewhere else; of any size and
// anywhere.
#pragma once
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "math/random.h"
#include "penalty/kinds/kinds.h"

namespace penalty::testing {

/// The kinds of a list for which Keep<Kind>::value is true, as GoogleTest wants them.
template <class List, template <class> class Keep>
struct TypesThat;
template <class... Kinds, template <class> class Keep>
struct TypesThat<KindList<Kinds...>, Keep> {
  template <class... Types>
  static ::testing::Types<Types...> listed(std::tuple<Types...>);
  using Type = decltype(listed(
      std::tuple_cat(std::declval<std::conditional_t<Keep<Kinds>::value, std::tuple<Kinds>, std::tuple<>>>()...)));
};

template <class Kind>
struct Any : std::true_type {};
using KindTypes = TypesThat<OwnKinds, Any>::Type;

/// Constraints of few points: what the chain rule makes dense matrices of.
template <class Kind>
struct IsFixedConstraint : std::bool_constant<Constraint<Kind> && Kind::num_points != dynamic> {};
using ConstraintTypes = TypesThat<OwnKinds, IsFixedConstraint>::Type;

/// Those that nothing outside holds.
template <class Kind>
struct IsInternal : std::bool_constant<IsFixedConstraint<Kind>::value && conserves_momentum<Kind>> {};
using InternalTypes = TypesThat<OwnKinds, IsInternal>::Type;

/// The volume of a tetrahedron, positive for that of the unit axes; of columns of any scalar.
inline constexpr auto volume_of = [](const auto& p) {
  return (p.col(1) - p.col(0)).dot((p.col(2) - p.col(0)).cross(p.col(3) - p.col(0))) / 6;
};

enum class Shape { noisy, stretched, compressed, inverted, anywhere };
inline constexpr unsigned num_shapes = 5;
inline constexpr unsigned num_samples = 500;

/// What a kind measures: C, or of an energy of its own psi.
template <ElementKind Kind>
Real measure(const Kind& kind, const Points<Kind::num_points>& p) {
  if constexpr (Constraint<Kind>)
    return kind.value(p);
  else
    return kind.energy(p);
}

template <ElementKind Kind>
Gradient<Kind::num_points> gradient_of(const Kind& kind, const Points<Kind::num_points>& p) {
  if constexpr (Constraint<Kind>) {
    return kind.gradient(p);
  } else {
    Gradient<Kind::num_points> g(3, p.cols());
    kind.energy_and_gradient(p, g);
    return g;
  }
}

template <class Kind>
inline constexpr bool has_hessian = HasHessian<Kind> || ElasticEnergy<Kind>;

template <ElementKind Kind>
Hessian<Kind::num_points> hessian_of(const Kind& kind, const Points<Kind::num_points>& p) {
  if constexpr (Constraint<Kind>)
    return kind.hessian(p);
  else
    return kind.energy_hessian(p);
}

/// The same element elsewhere: what a kind holds besides its points moves with them.
template <ElementKind Kind>
Kind moved(const Kind& kind, const Matrix3& rotation, const Vector3& translation) {
  if constexpr (requires { kind.moved(rotation, translation); })
    return kind.moved(rotation, translation);
  else
    return kind;
}

template <ElementKind Kind>
struct Sample {
  static constexpr int num_points = Kind::num_points;

  unsigned seed;
  Shape shape;
  Real size;  // 1e-3 to 1e3 [m]
  Points<num_points> rest, points;
  Kind kind;

  Real difference_step() const { return 6e-6 * size; }
};

// Whether differences a few 1e-6 apart can be compared with derivatives at these points, some 1 m in size: neither
// gradient nor Hessian is large, as next to a point where a triangle has no normal, and an angle is not about to jump
// by a turn.
template <ElementKind Kind>
bool is_smooth_around(const Kind& kind, const Points<Kind::num_points>& points) {
  constexpr Real steepest = Constraint<Kind> ? 20 : 400;  // energies go with the square
  if (!(gradient_of(kind, points).colwise().norm().sum() < steepest)) return false;
  if constexpr (has_hessian<Kind>)
    if (!(hessian_of(kind, points).norm() < 20 * steepest)) return false;
  return period_of<Kind> == 0 || std::abs(measure(kind, points)) < period_of<Kind> / 2 - 0.04;
}

template <ElementKind Kind>
bool is_well_shaped(const Points<Kind::num_points>& points) {
  try {
    return is_smooth_around(example_of<Kind>(1).at_rest(points), points);
  } catch (const std::invalid_argument&) {
    return false;
  }
}

// In a cube of side 1.
template <ElementKind Kind>
Points<Kind::num_points> well_shaped_points(Random& random) {
  for (;;) {
    const Points<Kind::num_points> points = random.vectors<Kind::num_points>(num_example_points<Kind>, 0.5);
    if (is_well_shaped<Kind>(points)) return points;
  }
}

// A draw that is not smooth is drawn again, so that every seed gives a sample of its shape.
template <ElementKind Kind>
Sample<Kind> sample(unsigned seed) {
  constexpr int n = Kind::num_points;
  constexpr int count = num_example_points<Kind>;
  Random random(seed);
  const Shape shape = static_cast<Shape>(seed % num_shapes);
  const Real size = std::pow(10.0, random.uniform(-3, 3));
  Points<n> rest, points;
  do {
    rest = well_shaped_points<Kind>(random);
    if constexpr (count > 1)
      if (seed / num_shapes % 2 == 1) rest.col(count - 1).swap(rest.col(count - 2));  // the other orientation
    const Vector3 axis = random.direction();
    const auto along_axis = [&](Real factor) -> Matrix3 {
      return Matrix3::Identity() + (factor - 1) * axis * axis.transpose();
    };
    const Points<n> noise = random.vectors<n>(count, 0.05);
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
  } while (!is_well_shaped<Kind>(rest) || !is_smooth_around(example_of<Kind>(1).at_rest(rest), points));
  const Points<n> turned = random.rotation() * points;
  const Vector3 away = random.vector(2);
  points = turned.colwise() + away;
  return {seed, shape, size, size * rest, size * points, example_of<Kind>(size).at_rest(size * rest)};
}

template <ElementKind Kind>
std::string trace(const Sample<Kind>& s) {
  std::ostringstream text;
  text << Kind::name << ", seed " << s.seed << ", size " << s.size << " m";
  return text.str();
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
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    torque += Vector3(points.col(k)).cross(Vector3(vectors.col(k)));
    scale += points.col(k).norm() * vectors.col(k).norm();
  }
  return torque.norm() / scale;
}

/// Points that no kind has a regular gradient at: all in one place, on a line, in a plane.
template <int N>
std::vector<Points<N>> degenerate_points(int count, Real size) {
  Points<N> coincident(3, count), collinear(3, count), coplanar(3, count), all_but_one(3, count);
  for (int k = 0; k < count; ++k) {
    coincident.col(k) = Vector3(1, 2, 3);
    collinear.col(k) = k * Vector3(1, -1, 0.5);
    const int column = k % 2, row = k / 2;
    coplanar.col(k) = Vector3(column, row, 0);
    all_but_one.col(k) = k == 0 ? Vector3(1, 0, 0) : Vector3(0, 0, 0);
  }
  return {size * coincident, size * collinear, size * coplanar, size * all_but_one, 0 * coincident};
}

}  // namespace penalty::testing
