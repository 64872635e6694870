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
  Vector3 vector(Real size) {
    const Real x = uniform(-size, size), y = uniform(-size, size), z = uniform(-size, size);
    return {x, y, z};
  }
  Vector3 direction() {
    Vector3 v = vector(1);
    while (v.norm() < 0.1) v = vector(1);
    return v.normalized();
  }
  Matrix3 rotation() { return Eigen::AngleAxis<Real>(uniform(-3.1, 3.1), direction()).toRotationMatrix(); }

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
  void see(Real error, unsigned seed) {
    ++count_;
    if (std::isnan(error_) || error <= error_) return;
    error_ = error;
    seed_ = seed;
  }

  void expect_below(Real tolerance, const std::string& law) const {
    EXPECT_GT(count_, 0) << law << ": nothing was checked";
    EXPECT_LT(error_, tolerance) << law << ", seed " << seed_;
    ::testing::Test::RecordProperty(key(law), text(error_));
  }

 private:
  static std::string key(std::string law) {
    for (char& c : law)
      if (c == ' ') c = '_';
    return law;
  }
  static std::string text(Real value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.2g", value);
    return buffer;
  }

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
