#include "penalty/math/affine_span.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>

#include "penalty/math/rigid_fit.h"

namespace penalty {
namespace {

constexpr Real flat = 1e-6;             // spread that counts as none, of the scale
constexpr Real unfolded_share = 0.1;    // of the rest shape that is added,
constexpr Real unfolded_jitter = 1e-3;  // and of the mean distance of its points

/// Uniform in [-1, 1): the finaliser of splitmix64 (Steele, Lea and Flood 2014), which turns a counter into random
/// bits.
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

void jitter(PackedVectors& points, std::span<const Real> inverse_masses, Real distance) {
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (inverse_masses[static_cast<std::size_t>(i)] > 0)
      for (int axis = 0; axis < 3; ++axis)
        points(axis, i) += distance * hash_to_unit(static_cast<std::uint64_t>(3 * i + axis));
}

bool unfold(PackedVectors& points, const Positions& rest, const AffineSpan& rest_span,
            std::span<const Real> inverse_masses) {
  if (rest_span.dimension == 0 || affine_span(points, rest_span.spreads[0]).dimension >= rest_span.dimension)
    return false;
  const auto count = static_cast<Real>(rest.cols());
  const Vector3 rest_mean = rest.topRows<3>().rowwise().sum() / count,
                mean = points.topRows<3>().rowwise().sum() / count;
  Matrix3 covariance = Matrix3::Zero();
  for (Eigen::Index i = 0; i < rest.cols(); ++i)
    covariance += (points.col(i).head<3>() - mean) * (rest.col(i).head<3>() - rest_mean).transpose();
  // Of a body in one place round-off alone is left, and it fits no way better than as it is.
  const bool fits = covariance.norm() > flat * flat * count * rest_span.spreads.squaredNorm();
  const Matrix3 rotation = fits ? best_rotation(covariance) : Matrix3(Matrix3::Identity());
  for (Eigen::Index i = 0; i < rest.cols(); ++i)
    if (inverse_masses[static_cast<std::size_t>(i)] > 0)
      points.col(i).head<3>() += unfolded_share * (rotation * (rest.col(i).head<3>() - rest_mean));
  jitter(points, inverse_masses, unfolded_jitter * rest_span.spreads[0] / std::pow(count, 1.0 / rest_span.dimension));
  return true;
}

}  // namespace penalty
