#include "penalty/math/affine_span.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>

namespace penalty {
namespace {

constexpr Real flat = 1e-6;  // spread that counts as none, of the scale

/// Uniform in [-1, 1): the finaliser of splitmix64 (Steele, Lea and Flood 2014), which turns a counter into random bits.
Real hash_to_unit(std::uint64_t counter) {
  std::uint64_t z = counter * 0x9e3779b97f4a7c15 + 0x9e3779b97f4a7c15;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  z ^= z >> 31;
  return static_cast<Real>(z >> 11) * 0x1p-52 - 1;
}

}  // namespace

AffineSpan affine_span(const Positions& points, Real scale) {
  AffineSpan span;
  if (points.cols() == 0) return span;
  const auto count = static_cast<Real>(points.cols());
  const Vector3 mean = points.topRows<3>().rowwise().sum() / count;
  Matrix3 covariance = Matrix3::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 d = points.col(i).head<3>() - mean;
    covariance += d * d.transpose();
  }
  covariance /= count;
  if (!covariance.allFinite()) {
    span.dimension = 3;
    return span;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(covariance, Eigen::EigenvaluesOnly);
  span.spreads = eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse();
  // The eigenvalues are no better than round-off of the largest: a plane shows spreads of 1e-8, not of zero.
  if (!(scale > 0)) scale = span.spreads[0];
  for (const Real spread : span.spreads) span.dimension += spread > flat * scale;
  return span;
}

Real unfolding_distance(const AffineSpan& rest, Eigen::Index num_points) {
  if (rest.dimension == 0) return 0;
  return 0.25 * rest.spreads[0] / std::pow(static_cast<Real>(num_points), 1.0 / rest.dimension);
}

void jitter(PackedVectors& points, std::span<const Real> inverse_masses, Real distance) {
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (inverse_masses[static_cast<std::size_t>(i)] > 0)
      for (int axis = 0; axis < 3; ++axis)
        points(axis, i) += distance * hash_to_unit(static_cast<std::uint64_t>(3 * i + axis));
}

}  // namespace penalty
