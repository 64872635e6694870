// Seeded randomness and a record of the worst error: what the property tests share.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "penalty/math/types.h"

namespace penalty::testing {

/// The same numbers on every machine, unlike the distributions of the standard library.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}

  unsigned index(unsigned size) { return static_cast<unsigned>(engine_() % size); }
  Real uniform(Real low, Real high) { return low + (high - low) * static_cast<Real>(engine_()) * 0x1p-32; }
  Vector3 vector(Real size);
  Vector3 direction();
  Matrix3 rotation();

  template <int Columns>
  Eigen::Matrix<Real, 3, Columns> vectors(Eigen::Index columns, Real size) {
    Eigen::Matrix<Real, 3, Columns> result(3, columns);
    for (Eigen::Index i = 0; i < columns; ++i) result.col(i) = vector(size);
    return result;
  }

 private:
  std::mt19937 engine_;
};

/// The largest of many errors and the seed that made it; not-a-number counts as the largest.
class WorstError {
 public:
  void see(Real error, unsigned seed);
  void expect_below(Real tolerance, const std::string& law) const;

 private:
  int count_ = 0;
  Real error_ = -1;
  unsigned seed_ = 0;
};

/// |actual - expected| over |expected|, Frobenius.
template <class Actual, class Expected>
Real relative_error(const Eigen::MatrixBase<Actual>& actual, const Eigen::MatrixBase<Expected>& expected) {
  return (actual - expected).norm() / expected.norm();
}

/// The complaint of a call that must throw `Error`.
template <class Error, class Call>
std::string complaint(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace penalty::testing
