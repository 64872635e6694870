#include "penalty/stepping/stable_step.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

namespace penalty {
namespace {

constexpr int largest_krylov_dimension = 60;
constexpr Real wanted_residual = 0.002;  // of the Ritz value: a tenth of a per cent in frequency

// A start vector without symmetry, the same on every machine.
Eigen::VectorXd start_vector(Eigen::Index size) {
  Eigen::VectorXd v(size);
  std::uint64_t state = 0x9e3779b97f4a7c15;
  for (Real& value : v) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    value = static_cast<Real>(state >> 11) * 0x1p-53 - 0.5;
  }
  return v;
}

}  // namespace

System taut_stiffness(const PotentialField& field, const Positions& x) {
  const auto walk = [&](System& system) { field.add_stiffness(x, StiffnessModel::taut, system); };
  System stiffness = System::with_pattern(field.num_particles(), walk);
  walk(stiffness);
  return stiffness;
}

Real gershgorin_bound(const System& stiffness, std::span<const Real> inverse_masses) {
  std::vector<Real> bounds(inverse_masses.size(), 0);
  stiffness.add_bounds(bounds);
  Real largest = 0;
  for (std::size_t i = 0; i < bounds.size(); ++i) largest = std::max(largest, bounds[i] * inverse_masses[i]);
  return largest;
}

Real largest_eigenvalue_bound(const System& stiffness, std::span<const Real> inverse_masses) {
  return largest_eigenvalue_bound([&](const Vectors& in, Forces out) { stiffness.add_product(in, 1, out); },
                                  gershgorin_bound(stiffness, inverse_masses), inverse_masses);
}

Real largest_eigenvalue_bound(const std::function<void(const Vectors&, Forces)>& add_product, Real ceiling,
                              std::span<const Real> inverse_masses) {
  const auto num_particles = static_cast<Eigen::Index>(inverse_masses.size());
  if (!(ceiling > 0)) return ceiling;

  // Lanczos on S K S with S = M^-1/2, which is symmetric and has the eigenvalues of M^-1 K.
  Eigen::ArrayXd scale(3 * num_particles);
  for (Eigen::Index i = 0; i < num_particles; ++i) scale.segment<3>(3 * i).setConstant(std::sqrt(inverse_masses[i]));
  PackedVectors in = PackedVectors::Zero(4, num_particles), out(4, num_particles);
  const auto apply = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    in.topRows<3>() = (v.array() * scale).matrix().reshaped(3, num_particles);
    out.setZero();
    add_product(in, out);
    return (out.topRows<3>().reshaped().array() * scale).matrix();
  };

  // Not orthogonalised beyond the recurrence: what is lost of that comes with the convergence at which this ends.
  Eigen::VectorXd q = (start_vector(3 * num_particles).array() * (scale > 0).cast<Real>()).matrix();
  q.normalize();
  Eigen::VectorXd q_before = Eigen::VectorXd::Zero(3 * num_particles);
  const int dimension = static_cast<int>(std::min<Eigen::Index>(largest_krylov_dimension, 3 * num_particles));
  Eigen::VectorXd diagonal(dimension), off_diagonal(dimension);
  Real bound = ceiling;
  for (int k = 0; k < dimension; ++k) {
    Eigen::VectorXd r = apply(q);
    if (k > 0) r -= off_diagonal[k - 1] * q_before;
    diagonal[k] = q.dot(r);
    r -= diagonal[k] * q;
    off_diagonal[k] = r.norm();
    const bool exhausted = off_diagonal[k] <= 1e-12 * ceiling;
    if (exhausted || k + 1 == dimension || k % 5 == 4) {
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
      ritz.computeFromTridiagonal(diagonal.head(k + 1), off_diagonal.head(k), Eigen::ComputeEigenvectors);
      const Real value = ritz.eigenvalues()[k];
      const Real residual = off_diagonal[k] * std::abs(ritz.eigenvectors()(k, k));
      bound = std::min(ceiling, value + residual);
      if (exhausted || residual <= wanted_residual * value) break;
    }
    q_before.swap(q);
    q = r / off_diagonal[k];
  }
  return bound;
}

}  // namespace penalty
