#include "penalty/math/rigid_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <limits>

namespace penalty {

Matrix3 best_rotation(const Matrix3& a) {
  const auto cofactors = [](const Matrix3& m) {
    Matrix3 c;
    c << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
    return c;
  };
  const Real size = a.norm();
  if (size > std::numeric_limits<Real>::min()) {
    const Matrix3 scaled = a / size;
    Matrix3 r = scaled + cofactors(scaled);
    Matrix3 c = cofactors(r);
    Real determinant = r.col(0).dot(c.col(0));
    if (determinant > 1e-5) {
      for (int step = 0; step < 20; ++step) {
        const Real scale = std::sqrt(c.norm() / (determinant * r.norm()));
        const Matrix3 next = r * (scale / 2) + c * (0.5 / (determinant * scale));
        const Real change = (next - r).squaredNorm();
        r = next;
        if (change < 1e-16) return r;  // the error is quadratic in the last step
        c = cofactors(r);
        determinant = r.col(0).dot(c.col(0));
      }
    }
  }
  if (!a.allFinite()) return Matrix3::Identity();  // the run is lost, and Jacobi's method would not end well
  const Eigen::JacobiSVD<Matrix3> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3 u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

RigidVelocity best_rigid_velocity(const Points<dynamic>& points, const Points<dynamic>& velocities,
                                  std::span<const Real> weights, PointWeights kind) {
  const auto weight = [&](Eigen::Index i) { return kind == PointWeights::direct ? weights[i] : 1 / weights[i]; };
  RigidVelocity rigid;
  rigid.origin = points.col(0);
  Real total = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Real w = weight(i);
    total += w;
    rigid.from_origin += w * (points.col(i) - rigid.origin);
    rigid.linear += w * velocities.col(i);
  }
  if (!(total > 0)) return {};
  rigid.from_origin /= total;
  rigid.linear /= total;
  Matrix3 inertia = Matrix3::Zero();
  Vector3 momentum = Vector3::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 arm = rigid.arm(points.col(i)), speed = velocities.col(i) - rigid.linear;
    inertia += weight(i) * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
    momentum += weight(i) * arm.cross(speed);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(inertia);
  for (int k = 0; k < 3; ++k)
    if (eigen.eigenvalues()[k] > 1e-13 * eigen.eigenvalues()[2])
      rigid.angular +=
          eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(momentum) / eigen.eigenvalues()[k]);
  return rigid;
}

}  // namespace penalty
