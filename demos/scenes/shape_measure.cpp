#include "scenes/shape_measure.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace penalty::demo {

namespace {

void raise(Real& largest, Real error) {
  if (!(error <= largest)) largest = error;  // a NaN stays visible
}

}  // namespace

ShapeErrors& ShapeErrors::operator+=(const ShapeErrors& other) {
  const auto join = [](std::size_t count, Real& mean, Real& largest, std::size_t more, Real their_mean, Real theirs) {
    if (count == 0) {
      mean = their_mean;
      largest = theirs;
    } else if (more > 0) {
      mean += (their_mean - mean) * static_cast<Real>(more) / static_cast<Real>(count + more);
      raise(largest, theirs);
    }
  };
  join(edges, length_mean, length_max, other.edges, other.length_mean, other.length_max);
  join(tetrahedra, volume_mean, volume_max, other.tetrahedra, other.volume_mean, other.volume_max);
  edges += other.edges;
  tetrahedra += other.tetrahedra;
  inverted += other.inverted;
  return *this;
}

ShapeMeasure::ShapeMeasure(const Eigen::Matrix3Xd& rest, std::vector<Edge> edges,
                           std::span<const Tetrahedron> tetrahedra)
    : rest_(rest),
      tetrahedra_(tetrahedra.begin(), tetrahedra.end()),
      edges_(std::move(edges)),
      volumes_(signed_volumes(rest, tetrahedra)) {
  for (const auto& [a, b] : edges_) lengths_.push_back((rest.col(b) - rest.col(a)).norm());
}

ShapeErrors ShapeMeasure::errors(const Positions& x) const {
  ShapeErrors errors{.edges = edges_.size(), .tetrahedra = tetrahedra_.size()};
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Vector3 d = (x.col(edges_[e][1]) - x.col(edges_[e][0])).head<3>();
    const Real error = std::abs(d.norm() / lengths_[e] - 1);
    errors.length_mean += error / static_cast<Real>(edges_.size());
    raise(errors.length_max, error);
  }
  if (tetrahedra_.empty()) errors.volume_mean = errors.volume_max = std::numeric_limits<Real>::quiet_NaN();
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    const auto corner = [&](int k) -> Vector3 { return x.col(tetrahedra_[t][k]).head<3>(); };
    const Vector3 origin = corner(0);
    const Real volume = (corner(1) - origin).dot((corner(2) - origin).cross(corner(3) - origin)) / 6;
    const Real error = std::abs(volume / volumes_[t] - 1);
    errors.volume_mean += error / static_cast<Real>(tetrahedra_.size());
    raise(errors.volume_max, error);
    if (!(volume > 0)) ++errors.inverted;
  }
  return errors;
}

Eigen::VectorXd ShapeMeasure::vertex_strains(const Positions& x) const {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(x.cols()), counts = sums;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const Vector3 d = (x.col(edges_[e][1]) - x.col(edges_[e][0])).head<3>();
    const Real strain = std::abs(d.norm() / lengths_[e] - 1);
    for (const int i : edges_[e]) {
      sums[i] += strain;
      counts[i] += 1;
    }
  }
  return (counts.array() > 0).select(sums.array() / counts.array(), 0);
}

Real ShapeMeasure::rest_error(const Positions& x) const {
  if (!x.allFinite()) return std::numeric_limits<Real>::quiet_NaN();
  const Eigen::Matrix3Xd now = x.topRows<3>();
  const Vector3 rest_mean = rest_.rowwise().mean(), mean = now.rowwise().mean();
  // Kabsch: of all rotations R, V diag(1, 1, det) Uᵀ comes nearest, for sum (x - mean)(rest - mean)ᵀ = V S Uᵀ.
  const Matrix3 covariance = (now.colwise() - mean) * (rest_.colwise() - rest_mean).transpose();
  const Eigen::JacobiSVD<Matrix3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3 signs(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  const Matrix3 rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  const Eigen::Matrix3Xd best = (rotation * (rest_.colwise() - rest_mean)).colwise() + mean;
  const Real diagonal = (rest_.rowwise().maxCoeff() - rest_.rowwise().minCoeff()).norm();
  return (now - best).colwise().norm().maxCoeff() / diagonal;
}

}  // namespace penalty::demo
