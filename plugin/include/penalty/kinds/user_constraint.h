// A constraint that the user of the library writes: any callable of a few points.
#pragma once
#include <algorithm>
#include <cassert>
#include <type_traits>
#include <utility>

#include "penalty/kinds/gradient_check.h"
#include "penalty/kinds/kind.h"
#include "penalty/math/automatic_differentiation.h"

namespace penalty {

/// What C is, for a function f with the value f0 at rest.
enum class RestValue {
  as_given,    // C = f: f is zero at rest by itself
  subtracted,  // C = f - f0
  relative     // C = (f - f0) / f0: dimensionless, for lengths, areas, volumes
};

/// A function f(points) of N points, or of any number for N = dynamic, as a constraint C; see RestValue. The callables
/// are part of the type, as in a template of one's own: no virtual call, nothing allocated, and a callable without
/// captures takes no room. Make a prototype with one of
///
///     user_constraint<N>(f, gradient)     f and df/dp written by hand: the fastest
///     differentiated_constraint<N>(f)     f written once for any scalar, derivatives exact, with Hessian
///     difference_constraint<N>(f)         f as a black box, central differences, Gauss-Newton stiffness
///
/// and bind it with `at_rest(points)`:
///
///     auto stretch = differentiated_constraint<3>([](const auto& p) {
///       const auto a = (p.col(1) - p.col(0)).eval(), b = (p.col(2) - p.col(0)).eval();
///       return a.squaredNorm() + b.squaredNorm() - a.dot(b);
///     }, RestValue::relative);
///     auto kind = stretch.at_rest(points);
///
/// Where f has no finite derivative, C has none either: f must be finite wherever a run may take the points.
/// A callable with captures makes a kind that can be copied but not assigned.
template <int N, class Function>
class UserConstraint {
 public:
  static constexpr std::string_view name = "user constraint";
  static constexpr int num_points = N;
  static_assert(N == dynamic || N >= 1);

  explicit UserConstraint(Function function, RestValue rest_value = RestValue::subtracted)
      : function_(std::move(function)), rest_value_(rest_value) {}

  /// The kind that is zero at `rest` (as_given: whose C is f). Throws std::invalid_argument for a value at rest that is
  /// not finite, and for one that is zero if C is relative to it.
  UserConstraint at_rest(const Points<N>& rest) const {
    UserConstraint kind = *this;
    if constexpr (requires { kind.function_.bind(rest); }) kind.function_.bind(rest);
    const Real value = function_.value(rest);
    if (rest_value_ == RestValue::relative) {
      require_rest_value(name, "relative to its value at rest, which", value);
    } else if (value - value != 0) {
      throw std::invalid_argument(std::string(name) + ": value at rest is " + to_text(value));
    }
    if (rest_value_ != RestValue::as_given) kind.offset_ = value;
    if (rest_value_ == RestValue::relative) kind.scale_ = 1 / value;
    return kind;
  }

  Real value(const Points<N>& p) const { return (function_.value(p) - offset_) * scale_; }

  Gradient<N> gradient(const Points<N>& p) const {
    Gradient<N> g(3, p.cols());
    value_and_gradient(p, g);
    return g;
  }

  /// Overwrites `g`, which has the size of `p`.
  Real value_and_gradient(const Points<N>& p, Gradient<N>& g) const {
    assert(g.cols() == p.cols());
    const Real value = function_.value_and_gradient(p, g);
    if (scale_ != 1) g *= scale_;
    return (value - offset_) * scale_;
  }

  Hessian<N> hessian(const Points<N>& p) const
    requires requires(const Function& f) { f.hessian(p); }
  {
    Hessian<N> h = function_.hessian(p);
    if (scale_ != 1) h *= scale_;
    return h;
  }

  RestValue rest_value() const { return rest_value_; }

 private:
  [[no_unique_address]] Function function_;
  RestValue rest_value_;
  Real offset_ = 0, scale_ = 1;  // C = (f - offset) * scale
};

namespace detail {

/// Scratch of one callable in one thread, kept from call to call: a stencil of any number of points is copied without
/// allocating, as long as their number stays. `Owner` tells callables apart.
template <class Owner, class Matrix>
Matrix& thread_scratch(Eigen::Index columns) {
  thread_local Matrix matrix;
  matrix.resize(3, columns);
  return matrix;
}

template <int N, class Value, class GradientOfValue>
struct HandWrittenFunction {
  static constexpr bool overwrites = std::is_invocable_v<const GradientOfValue&, const Points<N>&, Gradient<N>&>;
  static_assert(std::is_invocable_r_v<Real, const Value&, const Points<N>&>,
                "the value must be callable as Real(const Points<N>&)");
  static_assert(
      overwrites || std::is_invocable_r_v<Gradient<N>, const GradientOfValue&, const Points<N>&>,
      "the gradient must be callable as Gradient<N>(const Points<N>&) or void(const Points<N>&, Gradient<N>&)");

  Real value(const Points<N>& p) const { return value_of(p); }
  Real value_and_gradient(const Points<N>& p, Gradient<N>& g) const {
    if constexpr (overwrites) {
      gradient_of(p, g);
    } else {
      g = gradient_of(p);
    }
    return value_of(p);
  }

  [[no_unique_address]] Value value_of;
  [[no_unique_address]] GradientOfValue gradient_of;
};

template <int N, class Value>
struct DifferentiatedFunction {
  static_assert(std::is_invocable_r_v<Real, const Value&, const Points<N>&>,
                "the function must be callable as auto(const auto& points), with 3 x N matrices of Real and of Jet");
  template <int Directions, int Order>
  using JetPoints = Eigen::Matrix<Jet<Directions, Order>, 3, N>;

  Real value(const Points<N>& p) const { return value_of(p); }

  Real value_and_gradient(const Points<N>& p, Gradient<N>& g) const {
    if constexpr (N != dynamic) {
      const Jet<3 * N, 1> f = value_of(variables<1>(p));
      for (int k = 0; k < 3 * N; ++k) g.data()[k] = f.first[k];
      return f.value;
    } else {
      constexpr int points_a_pass = 4;
      using J = Jet<3 * points_a_pass, 1>;
      auto& x = thread_scratch<DifferentiatedFunction, JetPoints<3 * points_a_pass, 1>>(p.cols());
      for (Eigen::Index k = 0; k < p.size(); ++k) x.data()[k] = J(p.data()[k]);
      Real value = 0;
      for (Eigen::Index first = 0; first < p.size(); first += 3 * points_a_pass) {
        const int count = static_cast<int>(std::min<Eigen::Index>(3 * points_a_pass, p.size() - first));
        for (int k = 0; k < count; ++k) x.data()[first + k].first[k] = 1;
        const J f = value_of(std::as_const(x));
        for (int k = 0; k < count; ++k) {
          g.data()[first + k] = f.first[k];
          x.data()[first + k].first[k] = 0;
        }
        value = f.value;
      }
      return value;
    }
  }

  Hessian<N> hessian(const Points<N>& p) const {
    Hessian<N> h(p.size(), p.size());
    if constexpr (N != dynamic) {
      const Jet<3 * N, 2> f = value_of(variables<2>(p));
      for (int i = 0; i < 3 * N; ++i)
        for (int j = 0; j < 3 * N; ++j) h(i, j) = f.second_derivative(i, j);
    } else {
      auto& x = thread_scratch<DifferentiatedFunction, JetPoints<6, 2>>(p.cols());
      for (Eigen::Index k = 0; k < p.size(); ++k) x.data()[k] = Jet<6, 2>(p.data()[k]);
      const auto seed = [&x](Eigen::Index point, int direction, Real slope) {
        for (int axis = 0; axis < 3; ++axis) x(axis, point).first[direction + axis] = slope;
      };
      for (Eigen::Index i = 0; i < p.cols(); ++i) {
        seed(i, 0, 1);
        for (Eigen::Index j = 0; j <= i; ++j) {
          const int direction = i == j ? 0 : 3;
          seed(j, direction, 1);
          const Jet<6, 2> f = value_of(std::as_const(x));
          for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
              h(3 * i + a, 3 * j + b) = h(3 * j + b, 3 * i + a) = f.second_derivative(a, direction + b);
          if (i != j) seed(j, direction, 0);
        }
        seed(i, 0, 0);
      }
    }
    return h;
  }

  [[no_unique_address]] Value value_of;

 private:
  template <int Order>
  static JetPoints<3 * N, Order> variables(const Points<N>& p) {
    JetPoints<3 * N, Order> x;
    for (int k = 0; k < 3 * N; ++k) x.data()[k] = Jet<3 * N, Order>::variable(p.data()[k], k);
    return x;
  }
};

template <int N, class Value>
struct DifferencedFunction {
  static_assert(std::is_invocable_r_v<Real, const Value&, const Points<N>&>,
                "the function must be callable as Real(const Points<N>&)");

  void bind(const Points<N>& rest) { step = relative_step * stencil_size<N>(rest); }

  Real value(const Points<N>& p) const { return value_of(p); }

  Real value_and_gradient(const Points<N>& p, Gradient<N>& g) const {
    const Real h = step > 0 ? step : relative_step * stencil_size<N>(p);
    if constexpr (N != dynamic) {
      g = central_difference_gradient<N>(value_of, p, h);
    } else {
      auto& moved = thread_scratch<DifferencedFunction, Points<N>>(p.cols());
      moved = p;
      for (Eigen::Index i = 0; i < p.cols(); ++i) g.col(i) = central_difference_column<N>(value_of, moved, i, h);
    }
    return value_of(p);
  }

  static constexpr Real relative_step = 6e-6;
  [[no_unique_address]] Value value_of;
  Real step = 0;  // [m]; 0 before there is a rest shape
};

}  // namespace detail

/// f and df/dp by hand: Real value(const Points<N>&) and Gradient<N> gradient(const Points<N>&), or, without a
/// temporary for N = dynamic, void gradient(const Points<N>&, Gradient<N>&), which overwrites. `check_gradient`
/// compares the two.
template <int N, class Value, class GradientOfValue>
auto user_constraint(Value value, GradientOfValue gradient, RestValue rest_value = RestValue::subtracted) {
  using Function = detail::HandWrittenFunction<N, Value, GradientOfValue>;
  return UserConstraint<N, Function>(Function{std::move(value), std::move(gradient)}, rest_value);
}

/// f as a generic callable, auto f(const auto& p): p is a 3 x N Eigen matrix of Real or of Jet, and f returns its
/// scalar. Call the functions of <cmath> without std:: (sqrt(x), atan2(y, x)), write constants as numbers, and end a
/// vector expression that is kept in `auto` with .eval().
///
/// For N = dynamic a gradient takes n / 4 calls of f on jets of 12 directions, a Hessian n (n + 1) / 2 calls: meant for
/// tens of points, not thousands. The jets are kept from call to call, 13 reals a coordinate in each thread.
template <int N, class Value>
auto differentiated_constraint(Value value, RestValue rest_value = RestValue::subtracted) {
  using Function = detail::DifferentiatedFunction<N, Value>;
  return UserConstraint<N, Function>(Function{std::move(value)}, rest_value);
}

/// f alone, Real value(const Points<N>&), with central differences of 6e-6 of the largest extent at rest (seed eq.
/// 4-6): 6 N calls of f a gradient, relative error below 1e-8 for a smooth f, and no Hessian.
template <int N, class Value>
auto difference_constraint(Value value, RestValue rest_value = RestValue::subtracted) {
  using Function = detail::DifferencedFunction<N, Value>;
  return UserConstraint<N, Function>(Function{std::move(value), 0}, rest_value);
}

}  // namespace penalty
