// What a constraint kind is: a scalar function of a few points.
#pragma once
#include <concepts>
#include <stdexcept>
#include <string>
#include <string_view>

#include "penalty/math/text.h"

namespace penalty {

/// A scalar C(p_0 .. p_{n-1}) that is zero at rest: dimensionless for lengths, areas and volumes, in radians for angles,
/// so that its stiffness K is an energy in joules for every kind. A kind is a small value type; it never sees K, an
/// index or a mass. `at_rest(points)` makes one that is zero at the given points: a static function, or, for a kind with
/// parameters, a member of a prototype that holds them. `num_points` is `dynamic` for a kind of any number of points.
template <class Kind>
concept Constraint = requires(const Kind c, const Points<Kind::num_points>& p) {
  { Kind::name } -> std::convertible_to<std::string_view>;
  { c.value(p) } -> std::same_as<Real>;
  { c.gradient(p) } -> std::convertible_to<Gradient<Kind::num_points>>;
};

/// A kind may give its second derivative; without it the stiffness is Gauss-Newton's.
template <class Kind>
concept HasHessian = Constraint<Kind> && requires(const Kind c, const Points<Kind::num_points>& p) {
  { c.hessian(p) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// A kind may give value and gradient in one pass, where they share work: the kernel of every step.
template <class Kind>
concept HasValueAndGradient = Constraint<Kind> &&
    requires(const Kind c, const Points<Kind::num_points>& p, Gradient<Kind::num_points>& g) {
  { c.value_and_gradient(p, g) } -> std::same_as<Real>;
};

/// A kind may give the positive semidefinite matrix nearest to dC dCᵀ + strain d²C, where it has a quicker way to it than
/// the eigenvectors of the Hessian.
template <class Kind>
concept HasProjectedStiffness = Constraint<Kind> && requires(const Kind c, const Points<Kind::num_points>& p) {
  { c.projected_stiffness(p, Real()) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// A kind that is an energy itself, not the square of a constraint: E = K psi(p) with psi dimensionless, zero at rest and
/// nowhere less, and K in joules as for constraints. `energy_and_gradient` overwrites its second argument with dpsi/dp.
template <class Kind>
concept ElasticEnergy = requires(const Kind e, const Points<Kind::num_points>& p, Gradient<Kind::num_points>& g) {
  { Kind::name } -> std::convertible_to<std::string_view>;
  { e.energy(p) } -> std::same_as<Real>;
  { e.energy_and_gradient(p, g) } -> std::same_as<Real>;
  { e.energy_hessian(p) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// An energy may give a positive semidefinite matrix of its own that stands for d²psi/dp²: no less than that, and equal
/// to it where it is positive semidefinite itself.
template <class Kind>
concept HasProjectedHessian = ElasticEnergy<Kind> && requires(const Kind e, const Points<Kind::num_points>& p) {
  { e.projected_hessian(p) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// C and dC/dp at once; `gradient` is overwritten.
template <Constraint Kind>
[[gnu::always_inline]] inline Real value_and_gradient(const Kind& kind, const Points<Kind::num_points>& points,
                                                      Gradient<Kind::num_points>& gradient) {
  if constexpr (HasValueAndGradient<Kind>) {
    return kind.value_and_gradient(points, gradient);
  } else {
    gradient = kind.gradient(points);
    return kind.value(points);
  }
}

/// Throws std::invalid_argument "<kind>: <what> is <value>" unless |value| > 0 and finite: a rest value that C is divided by.
inline void require_rest_value(std::string_view kind, std::string_view what, Real value) {
  if (!(value < 0 || value > 0) || value - value != 0)
    throw std::invalid_argument(std::string(kind) + ": " + std::string(what) + " is " + to_text(value));
}

}  // namespace penalty
