#include "penalty/kinds/shape_match.h"

#include <Eigen/Eigenvalues>

#include "penalty/math/rigid_fit.h"

namespace penalty {

ShapeMatch ShapeMatch::at_rest(const Points<dynamic>& rest) const {
  const auto fail = [](const std::string& what) { throw std::invalid_argument(std::string(name) + ": " + what); };
  if (rest.cols() < 3) fail(std::to_string(rest.cols()) + " points, must be at least 3");
  if (!weights_.empty() && static_cast<Eigen::Index>(weights_.size()) != rest.cols())
    fail(std::to_string(rest.cols()) + " points and " + std::to_string(weights_.size()) + " weights");
  RestShape shape;
  shape.weights = weights_.empty() ? std::vector<Real>(rest.cols(), 1) : weights_;
  shape.total_weight = 0;
  shape.arms = rest.colwise() - rest.col(0).eval();
  Vector3 mean = Vector3::Zero();
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    shape.total_weight += shape.weights[i];
    mean += shape.weights[i] * shape.arms.col(i);
  }
  mean /= shape.total_weight;
  shape.arms.colwise() -= mean;
  Real size = 0;
  Matrix3 inertia = Matrix3::Zero();
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const Vector3 q = shape.arms.col(i);
    size += shape.weights[i] * q.squaredNorm();
    inertia += shape.weights[i] * (q.squaredNorm() * Matrix3::Identity() - q * q.transpose());
  }
  require_rest_value(name, "weighted sum of squared distances to the rest centre", size);
  shape.scale = 1 / size;
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(inertia);
  for (int k = 0; k < 3; ++k) {
    const Real moment = eigen.eigenvalues()[k];
    if (moment > 1e-13 * size)
      shape.whiten.col(k) = eigen.eigenvectors().col(k) / std::sqrt(moment);
    else
      shape.whiten.col(k).setZero();
  }
  ShapeMatch kind;
  kind.weights_ = weights_;
  kind.rest_ = std::make_shared<const RestShape>(std::move(shape));
  return kind;
}

ShapeMatch::Fit ShapeMatch::best_fit(const Points<dynamic>& p) const {
  assert(rest_ && p.cols() == rest_->arms.cols());
  Fit fit;
  fit.center.setZero();
  for (Eigen::Index i = 0; i < p.cols(); ++i) fit.center += rest_->weights[i] * (p.col(i) - p.col(0));
  fit.center /= rest_->total_weight;
  fit.stretch.setZero();
  for (Eigen::Index i = 0; i < p.cols(); ++i)
    fit.stretch += (rest_->weights[i] * (p.col(i) - p.col(0) - fit.center)) * rest_->arms.col(i).transpose();
  fit.rotation = best_rotation(fit.stretch);
  return fit;
}

Real ShapeMatch::energy(const Points<dynamic>& p) const {
  const Fit fit = best_fit(p);
  Real sum = 0;
  for (Eigen::Index i = 0; i < p.cols(); ++i) sum += rest_->weights[i] * fit.deviation(*rest_, p, i).squaredNorm();
  return sum * rest_->scale / 2;
}

Real ShapeMatch::energy_and_gradient(const Points<dynamic>& p, Gradient<dynamic>& g) const {
  assert(g.cols() == p.cols());
  const Fit fit = best_fit(p);
  Real sum = 0;
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    const Vector3 deviation = fit.deviation(*rest_, p, i);
    const Real factor = rest_->weights[i] * rest_->scale;
    sum += factor * deviation.squaredNorm();
    g.col(i) = factor * deviation;
  }
  return sum / 2;
}

ShapeMatch::Spins ShapeMatch::spins(const Points<dynamic>& p, bool psd) const {
  const Fit fit = best_fit(p);
  const RestShape& rest = *rest_;
  const Matrix3 product = fit.rotation.transpose() * fit.stretch;
  const Matrix3 s = (product + product.transpose()) / 2;
  const Matrix3 g = s.trace() * Matrix3::Identity() - s;
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(rest.whiten.transpose() * g * rest.whiten);
  Spins spins{fit.rotation, rest.whiten * eigen.eigenvectors(), Vector3::Zero()};
  for (int k = 0; k < 3; ++k)
    if (spins.axes.col(k).squaredNorm() * rest.total_weight > 0)
      spins.coefficients[k] = -rest.scale / std::max(eigen.eigenvalues()[k], psd ? 1 : 1e-8);
  return spins;
}

Hessian<dynamic> ShapeMatch::energy_hessian(const Points<dynamic>& p) const {
  Hessian<dynamic> h = Hessian<dynamic>::Zero(p.size(), p.size());
  visit_stiffness(
      p, false, [&h](int i, Real factor) { h.diagonal().segment<3>(3 * i).array() += factor; },
      [&h](Real factor, const Gradient<dynamic>& mode) {
        h += factor * mode.reshaped() * mode.reshaped().transpose();
      });
  return h;
}

void ShapeMatch::damping_force(const Points<dynamic>& p, const Points<dynamic>& velocities, Real damping,
                               Gradient<dynamic>& force) const {
  const RigidVelocity rigid = best_rigid_velocity(p, velocities, rest_->weights);
  for (Eigen::Index i = 0; i < p.cols(); ++i)
    force.col(i) = -damping * rest_->weights[i] * rest_->scale * (velocities.col(i) - rigid.at(p.col(i)));
}

ShapeMatch::PrincipalAxes ShapeMatch::principal_axes(const Points<dynamic>& p) const {
  const RestShape& rest = *rest_;
  PrincipalAxes principal{Vector3::Zero(), Vector3::Zero(), Matrix3::Identity()};
  for (Eigen::Index i = 0; i < p.cols(); ++i) principal.center += rest.weights[i] / rest.total_weight * p.col(i);
  Matrix3 inertia = Matrix3::Zero();
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    const Vector3 arm = p.col(i) - principal.center;
    inertia += rest.weights[i] * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(inertia);
  principal.axes = eigen.eigenvectors();
  for (int k = 0; k < 3; ++k)
    if (eigen.eigenvalues()[k] > 1e-12 * eigen.eigenvalues()[2]) principal.moments[k] = eigen.eigenvalues()[k];
  return principal;
}

void ShapeMatch::damp(const Points<dynamic>& p, std::span<const Real> inverse_masses, Real damping,
                      Points<dynamic>& velocities) const {
  const Eigen::Index n = p.cols();
  assert(static_cast<Eigen::Index>(inverse_masses.size()) == n && velocities.cols() == n);
  Real mass = 0;
  bool pinned = false;
  for (Eigen::Index i = 0; i < n; ++i) {
    pinned = pinned || !(inverse_masses[i] > 0);
    mass += 1 / inverse_masses[i];
  }
  if (!pinned) {
    const RigidVelocity rigid = best_rigid_velocity(p, velocities, inverse_masses, PointWeights::inverse);
    const Real share = 1 - 1 / (1 + damping * rest_->scale * rest_->total_weight / mass);
    for (Eigen::Index i = 0; i < n; ++i) velocities.col(i) -= share * (velocities.col(i) - rigid.at(p.col(i)));
    return;
  }
  // Each point has a damper d w_i / S0 to the rigid motion. Eliminating the velocities after the step, these act like
  // dampers u_i in place of w_i on the velocities before, which is what the rigid motion is to be fitted with.
  thread_local std::vector<Real> softened;
  softened.resize(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i)
    softened[i] = rest_->weights[i] / (1 + damping * rest_->scale * rest_->weights[i] * inverse_masses[i]);
  const RigidVelocity rigid = best_rigid_velocity(p, velocities, softened);
  for (Eigen::Index i = 0; i < n; ++i)
    velocities.col(i) -=
        damping * rest_->scale * softened[i] * inverse_masses[i] * (velocities.col(i) - rigid.at(p.col(i)));
}

}  // namespace penalty
