// What a kind of element may say of itself: all of it is on this page.
#pragma once
#include <concepts>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "penalty/math/text.h"

namespace penalty {

/// A scalar C(p_0 .. p_{n-1}) that is zero at rest: dimensionless for lengths, areas and volumes, in radians for
/// angles, so that its stiffness K is an energy in joules for every kind. A kind is a small value type; it never sees
/// K, an index or a mass. `at_rest(points)` makes one that is zero at the given points: a static function, or, for a
/// kind with parameters, a member of a prototype that holds them; it throws std::invalid_argument, beginning with the
/// name, for points that it cannot be at rest in. `num_points` is `dynamic` for a kind of any number of points.
///
/// Degenerate points are no error: value and gradient are finite everywhere, and the header says what they are.
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
concept HasValueAndGradient =
    Constraint<Kind> && requires(const Kind c, const Points<Kind::num_points>& p, Gradient<Kind::num_points>& g) {
      { c.value_and_gradient(p, g) } -> std::same_as<Real>;
    };

/// A kind may give the positive semidefinite matrix nearest to dC dCᵀ + strain d²C, where it has a quicker way to it
/// than the eigenvectors of the Hessian.
template <class Kind>
concept HasProjectedStiffness = Constraint<Kind> && requires(const Kind c, const Points<Kind::num_points>& p) {
  { c.projected_stiffness(p, Real()) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// A kind that is an energy itself, not the square of a constraint: E = K psi(p) with psi dimensionless, zero at rest
/// and nowhere less, and K in joules as for constraints. `energy_and_gradient` overwrites its second argument with
/// dpsi/dp.
template <class Kind>
concept ElasticEnergy = requires(const Kind e, const Points<Kind::num_points>& p, Gradient<Kind::num_points>& g) {
  { Kind::name } -> std::convertible_to<std::string_view>;
  { e.energy(p) } -> std::same_as<Real>;
  { e.energy_and_gradient(p, g) } -> std::same_as<Real>;
  { e.energy_hessian(p) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// An energy may give its gradient alone where psi costs extra: `energy_gradient` overwrites its second argument.
template <class Kind>
concept HasEnergyGradient = ElasticEnergy<Kind> && requires(const Kind e, const Points<Kind::num_points>& p,
                                                            Gradient<Kind::num_points>& g) { e.energy_gradient(p, g); };

/// What elements are made of: a constraint C with E = K/2 s(C)², or an energy of its own, E = K psi. For the latter C
/// stands for sqrt(2 psi), so that profiles mean the same.
template <class Kind>
concept ElementKind = Constraint<Kind> || ElasticEnergy<Kind>;

/// An energy may give a positive semidefinite matrix of its own that stands for d²psi/dp²: no less than that, and equal
/// to it where it is positive semidefinite itself.
template <class Kind>
concept HasProjectedHessian = ElasticEnergy<Kind> && requires(const Kind e, const Points<Kind::num_points>& p) {
  { e.projected_hessian(p) } -> std::convertible_to<Hessian<Kind::num_points>>;
};

/// A constraint of any number of points whose Hessian couples only few pairs of them: `visit_hessian_blocks(p, visit)`
/// calls visit(i, j, block), `visit_hessian_pattern(visit)` calls visit(i, j).
template <class Kind>
concept HasSparseHessian = Constraint<Kind> && requires(const Kind k, const Points<Kind::num_points>& p) {
  k.visit_hessian_blocks(p, [](int, int, const Matrix3&) {});
  k.visit_hessian_pattern([](int, int) {});
};

/// An energy of any number of points whose Hessian is a diagonal and few rank-one terms: `visit_stiffness(p, psd,
/// visit_diagonal, visit_mode)`.
template <class Kind>
concept HasDiagonalAndModes = ElasticEnergy<Kind> && requires(const Kind k, const Points<Kind::num_points>& p) {
  k.visit_stiffness(p, true, [](int, Real) {}, [](Real, const Gradient<Kind::num_points>&) {});
};

/// An energy may damp along modes of its own: `visit_damping_modes(p, visit)` calls visit(weight, gradient) for each,
/// and the damping matrix is the sum of d weight g gᵀ. The one mode of a constraint is dC, that of any other energy
/// also.
template <class Kind>
concept HasDampingModes = ElasticEnergy<Kind> && requires(const Kind kind, const Points<Kind::num_points>& p) {
  kind.visit_damping_modes(p, [](Real, const Gradient<Kind::num_points>&) {});
};

/// Whether the first of these modes are those of the edges, (0, 1), (0, 2) .. (n-2, n-1), each along its edge:
/// `static constexpr bool damps_edges`. Those of neighbours are then one.
template <class Kind>
inline constexpr bool damps_edges = [] {
  if constexpr (requires { Kind::damps_edges; })
    return Kind::damps_edges;
  else
    return false;
}();

/// Or all motion but the rigid one: `damping_force(p, v, d)` of the group, `damp(p, inverse_masses, d * duration, v)`,
/// its implicit step, and `visit_damping(p, visit_diagonal, visit_mode)`, its matrix.
template <class Kind>
concept HasRigidDamping =
    ElasticEnergy<Kind> && requires(const Kind kind, const Points<Kind::num_points>& p, Points<Kind::num_points>& v,
                                    std::span<const Real> inverse_masses) {
      { kind.damping_force(p, v, Real()) } -> std::convertible_to<Gradient<Kind::num_points>>;
      kind.damp(p, inverse_masses, Real(), v);
      kind.visit_damping(p, [](int, Real) {}, [](Real, const Gradient<Kind::num_points>&) {});
    };

/// What C jumps by where an angle comes full circle: `static constexpr Real period`; 0 of any other kind.
template <class Kind>
inline constexpr Real period_of = [] {
  if constexpr (requires { Kind::period; })
    return Kind::period;
  else
    return Real(0);
}();

/// Whether net force and net torque vanish: always, unless `static constexpr bool conserves_momentum` says that
/// something outside holds the points. What that is moves with them by a member `moved(rotation, translation)`.
template <class Kind>
inline constexpr bool conserves_momentum = [] {
  if constexpr (requires { Kind::conserves_momentum; })
    return Kind::conserves_momentum;
  else
    return true;
}();

/// Whether all points may be in one place at rest: `static constexpr bool rests_in_one_place`; of most kinds they may
/// not.
template <class Kind>
inline constexpr bool rests_in_one_place = [] {
  if constexpr (requires { Kind::rests_in_one_place; })
    return Kind::rests_in_one_place;
  else
    return false;
}();

/// A prototype to make elements of `size` [m] of, for tests and benchmarks: a kind with parameters has `static Kind
/// example(size)` with usual ones, any other is its own prototype.
template <ElementKind Kind>
Kind example_of(Real size) {
  if constexpr (requires { Kind::example(size); })
    return Kind::example(size);
  else
    return Kind{};
}

/// The number of points of an example: a kind of any number has `static constexpr int num_example_points`.
template <ElementKind Kind>
inline constexpr int num_example_points = [] {
  if constexpr (Kind::num_points == dynamic)
    return Kind::num_example_points;
  else
    return Kind::num_points;
}();

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

/// Throws std::invalid_argument "<kind>: <what> is <value>" unless |value| > 0 and finite: a rest value that C is
/// divided by.
inline void require_rest_value(std::string_view kind, std::string_view what, Real value) {
  if (!(value < 0 || value > 0) || value - value != 0)
    throw std::invalid_argument(std::string(kind) + ": " + std::string(what) + " is " + to_text(value));
}

}  // namespace penalty
