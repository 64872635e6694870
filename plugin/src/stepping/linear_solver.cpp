#include "penalty/stepping/linear_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace penalty {
namespace {

constexpr Real coarse_shift = 1e-8;  // of the scaled coarse matrix: a group on a line cannot turn about it

}  // namespace

Eigen::Index LinearSystem::num_particles() const {
  Eigen::Index sum = 0;
  for (const BodyMatrix* body : bodies) sum += body->num_particles();
  return sum;
}

void LinearSystem::clear_fixed(PackedVectors& v) const {
  visit_bodies([&v](const BodyMatrix& body, Eigen::Index first, Eigen::Index) {
    for (const int i : body.fixed) v.col(first + i).setZero();
  });
}

void LinearSystem::multiply(const PackedVectors& x, PackedVectors& y) const {
  y.setZero();
  visit_bodies([&](const BodyMatrix& body, Eigen::Index first, Eigen::Index count) {
    body.values.add_product(x.middleCols(first, count), 1, y.middleCols(first, count));
  });
  for (Eigen::Index column = num_particles(); const RigidInertia& body : rigid_bodies) {
    y.col(column).head<3>() = body.translation * x.col(column).head<3>();
    y.col(column + 1).head<3>() = body.rotation * x.col(column + 1).head<3>();
    column += 2;
  }
  for (const ContactStiffness& contact : contacts) contact.sides.push(contact.stiffness * contact.sides.distance(x), y);
  clear_fixed(y);
}

bool LinearSolver::factorize(const LinearSystem& system) {
  for (PackedVectors* v : {&residual_, &preconditioned_, &search_, &product_})
    if (v->cols() != system.num_columns()) v->setZero(4, system.num_columns());
  gather(system);
  const bool is_positive = invert_diagonal(system);
  return factorize_coarse(system) && is_positive;
}

void LinearSolver::gather(const LinearSystem& system) {
  num_particles_ = system.num_particles();
  num_groups_ = 0;
  const auto size = static_cast<std::size_t>(num_particles_);
  group_of_.resize(size);
  moves_.resize(size);
  inverse_diagonal_.resize(size);
  if (arms_.cols() != num_particles_) arms_.resize(4, num_particles_);
  system.visit_bodies([this](const BodyMatrix& body, Eigen::Index first, Eigen::Index count) {
    std::ranges::transform(body.group_of(), group_of_.begin() + first,
                           [this](int group) { return num_groups_ + group; });
    std::ranges::copy(body.moves(), moves_.begin() + first);
    std::ranges::copy(body.diagonal(), inverse_diagonal_.begin() + first);
    arms_.middleCols(first, count) = body.arms();
    num_groups_ += body.num_groups();
  });
}

bool LinearSolver::invert_diagonal(const LinearSystem& system) {
  bool is_positive = true;
  for (const ContactStiffness& contact : system.contacts) {
    const ContactSides& sides = contact.sides;
    for (int k = 0; k < sides.num_particles; ++k)
      inverse_diagonal_[sides.particles[k]] += sides.weights[k] * sides.weights[k] * contact.stiffness;
  }
  for (Matrix3& block : inverse_diagonal_) {
    const Real trace = block.trace();
    block.diagonal().array() += trace > 0 ? 1e-12 * trace : 1;
    is_positive =
        is_positive && block(0, 0) > 0 && block.topLeftCorner<2, 2>().determinant() > 0 && block.determinant() > 0;
    block = block.inverse().eval();
  }
  for (std::size_t i = 0; i < moves_.size(); ++i)
    if (moves_[i] == 0) inverse_diagonal_[i].setZero();
  return is_positive;
}

// What a contact adds to it, group by group: a rigid body, at its arm, moves by t + w x arm, too.
void LinearSolver::add_coarse_contact(const ContactStiffness& contact) {
  coarse_motions_.clear();
  const auto add = [&](int group, Real weight, const Vector3& arm) {
    const auto known = std::ranges::find(coarse_motions_, group, [](const auto& motion) { return motion.first; });
    auto& motion = known != coarse_motions_.end()
                       ? known->second
                       : coarse_motions_.emplace_back(group, Eigen::Matrix<Real, 3, 6>::Zero()).second;
    if (contact.sides.turn)
      motion.rightCols<3>().diagonal().array() += weight;
    else
      motion += (Eigen::Matrix<Real, 3, 6>() << weight * Matrix3::Identity(), -weight * cross_matrix(arm)).finished();
  };
  const ContactSides& sides = contact.sides;
  for (int k = 0; k < sides.num_particles; ++k)
    if (const int i = sides.particles[k]; moves_[i] != 0) add(group_of_[i], sides.weights[k], arms_.col(i).head<3>());
  for (int k = 0; k < sides.num_rigid; ++k) {
    const auto& [column, sign, arm] = sides.rigid[k];
    add(num_groups_ + static_cast<int>(column - num_particles_) / 2, sign, arm);
  }
  for (const auto& [group, motion] : coarse_motions_) {
    const Eigen::Matrix<Real, 6, 3> pulled = motion.transpose() * contact.stiffness;
    for (const auto& [other, moved] : coarse_motions_)
      if (other <= group) coarse_.block<6, 6>(6 * group, 6 * other) += pulled * moved;
  }
}

bool LinearSolver::factorize_coarse(const LinearSystem& system) {
  const Eigen::Index of_particles = 6 * Eigen::Index(num_groups_);
  const Eigen::Index size = of_particles + 6 * static_cast<Eigen::Index>(system.rigid_bodies.size());
  if (size == 0) return true;
  coarse_.resize(size, size);
  coarse_scale_.resize(size);
  coarse_vector_.resize(size);
  coarse_.setZero();
  Eigen::Index at = 0;
  for (const BodyMatrix* body : system.bodies) {
    const Eigen::Index count = body->coarse().rows();
    coarse_.block(at, at, count, count) = body->coarse();
    at += count;
  }
  for (const RigidInertia& body : system.rigid_bodies) {
    coarse_.block<3, 3>(at, at) = body.translation;
    coarse_.block<3, 3>(at + 3, at + 3) = body.rotation;
    at += 6;
  }
  for (const ContactStiffness& contact : system.contacts) add_coarse_contact(contact);
  for (Eigen::Index k = 0; k < coarse_.rows(); ++k)
    coarse_scale_[k] = coarse_(k, k) > 0 ? 1 / std::sqrt(coarse_(k, k)) : 0;
  for (Eigen::Index column = 0; column < coarse_.cols(); ++column) {
    coarse_.col(column).array() *= coarse_scale_.array() * coarse_scale_[column];
    coarse_(column, column) = 1 + coarse_shift;
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(coarse_);
  const bool is_positive = cholesky.info() == Eigen::Success;
  if (!is_positive) coarse_scale_.setZero();  // no coarse space, then
  return is_positive;
}

void LinearSolver::precondition(const PackedVectors& r, PackedVectors& z) {
  coarse_vector_.setZero();
  for (Eigen::Index i = 0; i < num_particles_; ++i) {
    const Vector3 own = r.col(i).head<3>();
    z.col(i).head<3>() = inverse_diagonal_[i] * own;
    const int row = 6 * group_of_[i];
    coarse_vector_.segment<3>(row) += own;
    coarse_vector_.segment<3>(row + 3) += Vector3(arms_.col(i).head<3>()).cross(own);
  }
  for (Eigen::Index row = 6 * Eigen::Index(num_groups_), i = num_particles_; i < r.cols(); ++i, row += 3)
    coarse_vector_.segment<3>(row) = r.col(i).head<3>();
  coarse_vector_.array() *= coarse_scale_.array();
  coarse_.triangularView<Eigen::Lower>().solveInPlace(coarse_vector_);
  coarse_.triangularView<Eigen::Lower>().adjoint().solveInPlace(coarse_vector_);
  coarse_vector_.array() *= coarse_scale_.array();
  for (Eigen::Index row = 6 * Eigen::Index(num_groups_), i = num_particles_; i < r.cols(); ++i, row += 3)
    z.col(i).head<3>() = coarse_vector_.segment<3>(row);
  for (Eigen::Index i = 0; i < num_particles_; ++i) {
    const int row = 6 * group_of_[i];
    const Vector3 turn = coarse_vector_.segment<3>(row + 3);
    z.col(i).head<3>() += moves_[i] * (coarse_vector_.segment<3>(row) + turn.cross(Vector3(arms_.col(i).head<3>())));
  }
}

Real LinearSolver::squared_norm(const PackedVectors& r) {
  precondition(r, preconditioned_);
  return r.cwiseProduct(preconditioned_).sum();
}

int LinearSolver::solve(const LinearSystem& system, const PackedVectors& b, const LinearOptions& options,
                        PackedVectors& x) {
  x.setZero(4, b.cols());
  residual_ = b;
  system.clear_fixed(residual_);
  precondition(residual_, preconditioned_);
  Real rz = residual_.cwiseProduct(preconditioned_).sum();
  int iterations = 0;
  const Real enough = options.tolerance * options.tolerance * rz;
  was_positive_ = !(rz < 0);
  if (!(rz > 0)) return 0;
  search_ = preconditioned_;
  while (iterations < options.max_iterations) {
    system.multiply(search_, product_);
    const Real curvature = search_.cwiseProduct(product_).sum();
    was_positive_ = curvature > 0;
    if (!was_positive_) break;
    const Real length = rz / curvature;
    x += length * search_;
    residual_ -= length * product_;
    ++iterations;
    precondition(residual_, preconditioned_);
    const Real next = residual_.cwiseProduct(preconditioned_).sum();
    if (!(next > enough)) break;
    search_ = preconditioned_ + (next / rz) * search_;
    rz = next;
  }
  if (iterations == 0) x = preconditioned_;  // no curvature: downhill at least
  return iterations;
}

}  // namespace penalty
