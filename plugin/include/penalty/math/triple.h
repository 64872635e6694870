// Three reals in registers, for the kernels that run once an element.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// Eigen evaluates a 3-vector as a pair and a single; between a gather and a scatter that stalls on every element, and
/// plain scalars are nearly twice as fast. Elsewhere use Vector3.
struct Triple {
  Real x, y, z;

  template <class Matrix>
  static Triple column(const Matrix& m, int k) {
    return {m(0, k), m(1, k), m(2, k)};
  }

  template <class Matrix>
  void store(Matrix& m, int k) const {
    m(0, k) = x;
    m(1, k) = y;
    m(2, k) = z;
  }
};

inline Triple operator+(Triple a, Triple b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Triple operator-(Triple a, Triple b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Triple operator-(Triple a) { return {-a.x, -a.y, -a.z}; }
inline Triple operator*(Triple a, Real s) { return {a.x * s, a.y * s, a.z * s}; }
inline Real dot(Triple a, Triple b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Triple cross(Triple a, Triple b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace penalty
