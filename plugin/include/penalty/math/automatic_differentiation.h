// Numbers that carry their derivatives: a function written once gives its gradient and its Hessian.
#pragma once
#include <array>
#include <cmath>
#include <compare>

#include "penalty/math/types.h"

// The functions have a namespace of their own, so that code of namespace penalty still finds those of numbers.
namespace penalty::jet {

/// A value with its first and, for Order 2, second derivatives along `Directions` directions. Arithmetic follows the
/// chain rule, so f evaluated on jets gives f and its derivatives, exact to round-off.
///
/// Where a function has no derivative (sqrt, abs and pow at 0, acos and asin at -1 and 1, atan2 at the origin) zero is
/// taken, which keeps a stencil of coincident points finite; min and max have the derivative of the branch they take.
///
/// Every operation returns a jet. (Eigen's AutoDiffScalar returns expressions that refer to temporaries, so that
/// `[](const auto& p) { return p.norm() / 2; }` would read memory that is gone.)
template <int Directions, int Order>
struct Jet {
  static_assert(Directions >= 1 && (Order == 1 || Order == 2));
  static constexpr int num_second = Order == 2 ? Directions * (Directions + 1) / 2 : 0;

  Jet() = default;                                            // not initialised, as a Real
  Jet(Real constant) : value(constant), first{}, second{} {}  // NOLINT: implicit, so that numbers and jets mix

  /// The coordinate that `direction` moves.
  static Jet variable(Real value, int direction) {
    Jet x(value);
    x.first[direction] = 1;
    return x;
  }

  /// d² / d(row) d(column), for Order 2.
  Real second_derivative(int row, int column) const {
    return row >= column ? second[row * (row + 1) / 2 + column] : second[column * (column + 1) / 2 + row];
  }

  Real value;
  std::array<Real, Directions> first;
  [[no_unique_address]] std::array<Real, num_second> second;  // lower triangle, row by row
};

/// f(x) from f, f' and f'' at x: ∇f = f' ∇x, ∇²f = f' ∇²x + f'' ∇x ∇xᵀ.
template <int D, int O>
Jet<D, O> chain(const Jet<D, O>& x, Real f, Real f1, Real f2) {
  Jet<D, O> result;
  result.value = f;
  for (int i = 0; i < D; ++i) result.first[i] = f1 * x.first[i];
  if constexpr (O == 2) {
    for (int i = 0, k = 0; i < D; ++i) {
      const Real slope = f2 * x.first[i];
      for (int j = 0; j <= i; ++j, ++k) result.second[k] = f1 * x.second[k] + slope * x.first[j];
    }
  }
  return result;
}

/// f(x, y) from f and its partial derivatives at (x, y).
template <int D, int O>
Jet<D, O> chain(const Jet<D, O>& x, const Jet<D, O>& y, Real f, Real fx, Real fy, Real fxx, Real fxy, Real fyy) {
  Jet<D, O> result;
  result.value = f;
  for (int i = 0; i < D; ++i) result.first[i] = fx * x.first[i] + fy * y.first[i];
  if constexpr (O == 2) {
    for (int i = 0, k = 0; i < D; ++i) {
      const Real of_x = fxx * x.first[i] + fxy * y.first[i], of_y = fxy * x.first[i] + fyy * y.first[i];
      for (int j = 0; j <= i; ++j, ++k)
        result.second[k] = fx * x.second[k] + fy * y.second[k] + of_x * x.first[j] + of_y * y.first[j];
    }
  }
  return result;
}

inline Real finite_or_zero(Real x) { return x - x == 0 ? x : 0; }

template <int D, int O>
Jet<D, O> operator+(const Jet<D, O>& x, const Jet<D, O>& y) {
  Jet<D, O> sum = x;
  sum += y;
  return sum;
}
template <int D, int O>
Jet<D, O> operator-(const Jet<D, O>& x, const Jet<D, O>& y) {
  Jet<D, O> difference = x;
  difference -= y;
  return difference;
}
template <int D, int O>
Jet<D, O> operator*(const Jet<D, O>& x, const Jet<D, O>& y) {
  return chain(x, y, x.value * y.value, y.value, x.value, 0, 1, 0);
}
template <int D, int O>
Jet<D, O> operator/(const Jet<D, O>& x, const Jet<D, O>& y) {
  const Real inverse = 1 / y.value, ratio = x.value * inverse;
  return chain(x, y, ratio, inverse, -ratio * inverse, 0, -inverse * inverse, 2 * ratio * inverse * inverse);
}

template <int D, int O>
Jet<D, O> operator+(Jet<D, O> x, Real c) {
  x.value += c;
  return x;
}
template <int D, int O>
Jet<D, O> operator+(Real c, const Jet<D, O>& x) {
  return x + c;
}
template <int D, int O>
Jet<D, O> operator-(const Jet<D, O>& x, Real c) {
  return x + (-c);
}
template <int D, int O>
Jet<D, O> operator-(Real c, const Jet<D, O>& x) {
  return chain(x, c - x.value, -1, 0);
}
template <int D, int O>
Jet<D, O> operator-(const Jet<D, O>& x) {
  return chain(x, -x.value, -1, 0);
}
template <int D, int O>
Jet<D, O> operator*(const Jet<D, O>& x, Real c) {
  return chain(x, c * x.value, c, 0);
}
template <int D, int O>
Jet<D, O> operator*(Real c, const Jet<D, O>& x) {
  return x * c;
}
template <int D, int O>
Jet<D, O> operator/(const Jet<D, O>& x, Real c) {
  return chain(x, x.value / c, 1 / c, 0);
}
template <int D, int O>
Jet<D, O> operator/(Real c, const Jet<D, O>& x) {
  const Real ratio = c / x.value;
  return chain(x, ratio, -ratio / x.value, 2 * ratio / (x.value * x.value));
}

template <int D, int O>
Jet<D, O>& operator+=(Jet<D, O>& x, const Jet<D, O>& y) {
  x.value += y.value;
  for (int i = 0; i < D; ++i) x.first[i] += y.first[i];
  for (int k = 0; k < Jet<D, O>::num_second; ++k) x.second[k] += y.second[k];
  return x;
}
template <int D, int O>
Jet<D, O>& operator-=(Jet<D, O>& x, const Jet<D, O>& y) {
  x.value -= y.value;
  for (int i = 0; i < D; ++i) x.first[i] -= y.first[i];
  for (int k = 0; k < Jet<D, O>::num_second; ++k) x.second[k] -= y.second[k];
  return x;
}
template <int D, int O, class Factor>
Jet<D, O>& operator*=(Jet<D, O>& x, const Factor& y) {
  return x = x * y;
}
template <int D, int O, class Divisor>
Jet<D, O>& operator/=(Jet<D, O>& x, const Divisor& y) {
  return x = x / y;
}
template <int D, int O>
Jet<D, O>& operator+=(Jet<D, O>& x, Real c) {
  x.value += c;
  return x;
}
template <int D, int O>
Jet<D, O>& operator-=(Jet<D, O>& x, Real c) {
  x.value -= c;
  return x;
}

template <int D, int O>
bool operator==(const Jet<D, O>& x, const Jet<D, O>& y) {
  return x.value == y.value;
}
template <int D, int O>
auto operator<=>(const Jet<D, O>& x, const Jet<D, O>& y) {
  return x.value <=> y.value;
}
template <int D, int O>
bool operator==(const Jet<D, O>& x, Real c) {
  return x.value == c;
}
template <int D, int O>
auto operator<=>(const Jet<D, O>& x, Real c) {
  return x.value <=> c;
}

template <int D, int O>
Jet<D, O> sqrt(const Jet<D, O>& x) {
  const Real root = std::sqrt(x.value), f1 = finite_or_zero(1 / (2 * root));
  return chain(x, root, f1, finite_or_zero(-f1 / (2 * x.value)));
}
template <int D, int O>
Jet<D, O> cbrt(const Jet<D, O>& x) {
  const Real root = std::cbrt(x.value), f1 = finite_or_zero(1 / (3 * root * root));
  return chain(x, root, f1, finite_or_zero(-2 * f1 / (3 * x.value)));
}
template <int D, int O>
Jet<D, O> pow(const Jet<D, O>& x, Real power) {
  const auto term = [&](Real coefficient, Real exponent) {
    return coefficient == 0 ? 0 : finite_or_zero(coefficient * std::pow(x.value, exponent));
  };
  return chain(x, std::pow(x.value, power), term(power, power - 1), term(power * (power - 1), power - 2));
}
template <int D, int O>
Jet<D, O> abs(const Jet<D, O>& x) {
  return chain(x, std::abs(x.value), static_cast<Real>((x.value > 0) - (x.value < 0)), 0);
}
template <int D, int O>
Jet<D, O> exp(const Jet<D, O>& x) {
  const Real f = std::exp(x.value);
  return chain(x, f, f, f);
}
template <int D, int O>
Jet<D, O> log(const Jet<D, O>& x) {
  return chain(x, std::log(x.value), 1 / x.value, -1 / (x.value * x.value));
}
template <int D, int O>
Jet<D, O> sin(const Jet<D, O>& x) {
  const Real f = std::sin(x.value);
  return chain(x, f, std::cos(x.value), -f);
}
template <int D, int O>
Jet<D, O> cos(const Jet<D, O>& x) {
  const Real f = std::cos(x.value);
  return chain(x, f, -std::sin(x.value), -f);
}
template <int D, int O>
Jet<D, O> tan(const Jet<D, O>& x) {
  const Real f = std::tan(x.value);
  return chain(x, f, 1 + f * f, 2 * f * (1 + f * f));
}
template <int D, int O>
Jet<D, O> tanh(const Jet<D, O>& x) {
  const Real f = std::tanh(x.value);
  return chain(x, f, 1 - f * f, -2 * f * (1 - f * f));
}
template <int D, int O>
Jet<D, O> acos(const Jet<D, O>& x) {
  const Real f1 = finite_or_zero(-1 / std::sqrt((1 - x.value) * (1 + x.value)));
  return chain(x, std::acos(x.value), f1, x.value * f1 * f1 * f1);
}
template <int D, int O>
Jet<D, O> asin(const Jet<D, O>& x) {
  const Real f1 = finite_or_zero(1 / std::sqrt((1 - x.value) * (1 + x.value)));
  return chain(x, std::asin(x.value), f1, x.value * f1 * f1 * f1);
}
template <int D, int O>
Jet<D, O> atan(const Jet<D, O>& x) {
  const Real f1 = 1 / (1 + x.value * x.value);
  return chain(x, std::atan(x.value), f1, -2 * x.value * f1 * f1);
}
template <int D, int O>
Jet<D, O> atan2(const Jet<D, O>& y, const Jet<D, O>& x) {
  const Real inverse = finite_or_zero(1 / (x.value * x.value + y.value * y.value));
  const Real fy = x.value * inverse, fx = -y.value * inverse;
  return chain(y, x, std::atan2(y.value, x.value), fy, fx, 2 * fx * fy, fx * fx - fy * fy, -2 * fx * fy);
}
template <int D, int O>
Jet<D, O> hypot(const Jet<D, O>& x, const Jet<D, O>& y) {
  return sqrt(x * x + y * y);
}
template <int D, int O>
Jet<D, O> min(const Jet<D, O>& x, const Jet<D, O>& y) {
  return y < x ? y : x;
}
template <int D, int O>
Jet<D, O> max(const Jet<D, O>& x, const Jet<D, O>& y) {
  return x < y ? y : x;
}
template <int D, int O>
bool isfinite(const Jet<D, O>& x) {
  return std::isfinite(x.value);
}

}  // namespace penalty::jet

namespace penalty {
using jet::Jet;
}

// What Eigen must know of a scalar that is not its own: that it is real, and that it mixes with Real.
template <int D, int O>
struct Eigen::NumTraits<penalty::Jet<D, O>> : Eigen::NumTraits<penalty::Real> {
  using Real = penalty::Jet<D, O>;
  using NonInteger = penalty::Jet<D, O>;
  using Nested = penalty::Jet<D, O>;
  using Literal = penalty::Real;
  // NOLINTNEXTLINE(readability-identifier-naming): Eigen's names
  enum { RequireInitialization = 1, ReadCost = 1 + D, AddCost = 1 + D, MulCost = 3 * (1 + D) };
};
template <int D, int O, class Operation>
struct Eigen::ScalarBinaryOpTraits<penalty::Jet<D, O>, penalty::Real, Operation> {
  using ReturnType = penalty::Jet<D, O>;
};
template <int D, int O, class Operation>
struct Eigen::ScalarBinaryOpTraits<penalty::Real, penalty::Jet<D, O>, Operation> {
  using ReturnType = penalty::Jet<D, O>;
};
