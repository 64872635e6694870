#include "penalty/stepping/linear_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace penalty {
namespace {

constexpr int particles_in_group = 40;  // least, and
constexpr int most_groups = 40;         // of a large body: the factorisation costs the cube of it
constexpr Real coarse_shift = 1e-8;     // of the scaled coarse matrix: a group on a line cannot turn about it

/// Groups of `size` neighbours, grown breadth first; a rest too small to be one joins a neighbour.
std::vector<int> group_neighbours(const BlockMatrix& matrix, int size) {
  const int num_particles = matrix.num_particles();
  std::vector<int> group(num_particles, -1), queue;
  int groups = 0;
  for (int seed = 0; seed < num_particles; ++seed) {
    if (group[seed] >= 0) continue;
    queue.assign(1, seed);
    group[seed] = groups;
    int neighbour = -1;  // a group that was there before
    for (std::size_t next = 0; next < queue.size() && static_cast<int>(queue.size()) < size; ++next)
      matrix.visit_row(queue[next], [&](int j, const Matrix3&) {
        if (group[j] < 0 && static_cast<int>(queue.size()) < size) {
          group[j] = groups;
          queue.push_back(j);
        } else if (group[j] >= 0 && group[j] != groups) {
          neighbour = group[j];
        }
      });
    if (static_cast<int>(queue.size()) < size / 4 && neighbour >= 0)
      for (const int i : queue) group[i] = neighbour;
    else
      ++groups;
  }
  return group;
}

}  // namespace

void LinearSystem::clear_fixed(PackedVectors& v) const {
  for (const int i : fixed) v.col(i).setZero();
}

void LinearSystem::multiply(const PackedVectors& x, PackedVectors& y) const {
  const int num_particles = matrix.num_particles();
  y.setZero();
  matrix.add_product(x.leftCols(num_particles), 1, y.leftCols(num_particles));
  for (std::size_t k = 0; k < rigid_bodies.size(); ++k) {
    const Eigen::Index column = num_particles + 2 * static_cast<Eigen::Index>(k);
    y.col(column).head<3>() = rigid_bodies[k].translation * x.col(column).head<3>();
    y.col(column + 1).head<3>() = rigid_bodies[k].rotation * x.col(column + 1).head<3>();
  }
  for (const ContactStiffness& contact : contacts) contact.sides.push(contact.stiffness * contact.sides.distance(x), y);
  clear_fixed(y);
}

void LinearSolver::set_pattern(const BlockMatrix& matrix) {
  const int num_particles = matrix.num_particles();
  group_of_ = group_neighbours(matrix, std::max(particles_in_group, num_particles / most_groups));
  const int groups = group_of_.empty() ? 0 : *std::max_element(group_of_.begin(), group_of_.end()) + 1;
  group_begin_.assign(groups + 1, 0);
  for (const int group : group_of_) ++group_begin_[group + 1];
  for (int g = 0; g < groups; ++g) group_begin_[g + 1] += group_begin_[g];
  group_members_.resize(num_particles);
  std::vector<int> next(group_begin_.begin(), group_begin_.end() - 1);
  for (int i = 0; i < num_particles; ++i) group_members_[next[group_of_[i]]++] = i;

  diagonal_.resize(num_particles);
  inverse_diagonal_.resize(num_particles);
  moves_.resize(num_particles);
  arms_.setZero(4, num_particles);
  coarse_blocks_.resize(6 * groups, 6 * groups);
  coarse_vector_.resize(6 * groups);
}

void LinearSolver::factorize(const LinearSystem& system, const Positions& x) {
  std::fill(moves_.begin(), moves_.end(), 1);
  for (const int i : system.fixed) moves_[i] = 0;
  sum_blocks(system);
  sum_coarse_blocks(system, x);
  factorize_contacts(system);
}

void LinearSolver::factorize_contacts(const LinearSystem& system) {
  for (PackedVectors* v : {&residual_, &preconditioned_, &search_, &product_})
    if (v->cols() != system.num_columns()) v->setZero(4, system.num_columns());
  invert_diagonal(system);
  factorize_coarse(system);
}

void LinearSolver::sum_blocks(const LinearSystem& system) {
  const int num_particles = system.matrix.num_particles();
  for (int i = 0; i < num_particles; ++i) diagonal_[i] = system.matrix.blocks().diagonal(i);
  for (const RankOneTerm& term : system.matrix.terms())
    if (term.coefficient > 0)
      for (std::size_t k = 0; k < term.particles.size(); ++k) {
        const Vector3 d = term.direction.col(static_cast<Eigen::Index>(k));
        diagonal_[term.particles[k]] += term.coefficient * (d * d.transpose());
      }
}

void LinearSolver::invert_diagonal(const LinearSystem& system) {
  inverse_diagonal_ = diagonal_;
  for (const ContactStiffness& contact : system.contacts) {
    const ContactSides& sides = contact.sides;
    for (int k = 0; k < sides.num_particles; ++k)
      inverse_diagonal_[sides.particles[k]] += sides.weights[k] * sides.weights[k] * contact.stiffness;
  }
  for (Matrix3& block : inverse_diagonal_) {
    const Real trace = block.trace();
    block.diagonal().array() += trace > 0 ? 1e-12 * trace : 1;
    block = block.inverse().eval();
  }
  for (const int i : system.fixed) inverse_diagonal_[i].setZero();
}

// What block (i, j) adds to the lower triangle of Zᵀ A Z, where column 6g + k of Z is the k-th rigid motion of group g:
// particle i, at r_i from its centre, moves by t + w x r_i.
void LinearSolver::add_coarse_block(int i, int j, const Matrix3& block) {
  const int row = 6 * group_of_[i], column = 6 * group_of_[j];
  if (column > row || moves_[i] == 0 || moves_[j] == 0) return;
  const Matrix3 arm_i = cross_matrix(arms_.col(i).head<3>());
  const Matrix3 turned = block * cross_matrix(arms_.col(j).head<3>());
  coarse_blocks_.block<3, 3>(row, column) += block;
  coarse_blocks_.block<3, 3>(row, column + 3) -= turned;
  coarse_blocks_.block<3, 3>(row + 3, column) += arm_i * block;
  coarse_blocks_.block<3, 3>(row + 3, column + 3) -= arm_i * turned;
}

void LinearSolver::sum_coarse_blocks(const LinearSystem& system, const Positions& x) {
  const int groups = num_groups();
  for (int g = 0; g < groups; ++g) {
    const std::span<const int> members(group_members_.data() + group_begin_[g],
                                       group_members_.data() + group_begin_[g + 1]);
    Vector3 center = Vector3::Zero();
    for (const int i : members) center += x.col(i).head<3>() / static_cast<Real>(members.size());
    Real radius2 = 0;
    for (const int i : members) radius2 = std::max(radius2, (x.col(i).head<3>() - center).squaredNorm());
    const Real scale = radius2 > 0 ? 1 / std::sqrt(radius2) : 0;
    for (const int i : members) arms_.col(i).head<3>() = scale * (x.col(i).head<3>() - center);
  }
  coarse_blocks_.setZero();
  for (int i = 0; i < system.matrix.num_particles(); ++i)
    system.matrix.blocks().visit_row(i, [&](int j, const Matrix3& block) { add_coarse_block(i, j, block); });
  for (const RankOneTerm& term : system.matrix.terms()) {
    auto motion = coarse_vector_.head(coarse_blocks_.rows());
    motion.setZero();
    for (std::size_t k = 0; k < term.particles.size(); ++k) {
      const int i = term.particles[k], row = 6 * group_of_[i];
      const Vector3 d = moves_[i] * term.direction.col(static_cast<Eigen::Index>(k));
      motion.segment<3>(row) += d;
      motion.segment<3>(row + 3) += Vector3(arms_.col(i).head<3>()).cross(d);
    }
    coarse_blocks_.selfadjointView<Eigen::Lower>().rankUpdate(motion, term.coefficient);
  }
}

// What a contact adds to it, group by group: a rigid body, at its arm, moves by t + w x arm, too.
void LinearSolver::add_coarse_contact(const LinearSystem& system, const ContactStiffness& contact) {
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
    add(num_groups() + (column - system.matrix.num_particles()) / 2, sign, arm);
  }
  for (const auto& [group, motion] : coarse_motions_) {
    const Eigen::Matrix<Real, 6, 3> pulled = motion.transpose() * contact.stiffness;
    for (const auto& [other, moved] : coarse_motions_)
      if (other <= group) coarse_.block<6, 6>(6 * group, 6 * other) += pulled * moved;
  }
}

void LinearSolver::factorize_coarse(const LinearSystem& system) {
  const Eigen::Index of_particles = 6 * num_groups();
  const Eigen::Index size = of_particles + 6 * static_cast<Eigen::Index>(system.rigid_bodies.size());
  if (size == 0) return;
  coarse_.resize(size, size);
  coarse_scale_.resize(size);
  coarse_vector_.resize(size);
  coarse_.topLeftCorner(of_particles, of_particles) = coarse_blocks_;
  coarse_.bottomRows(size - of_particles).setZero();
  for (std::size_t k = 0; k < system.rigid_bodies.size(); ++k) {
    const Eigen::Index at = of_particles + 6 * static_cast<Eigen::Index>(k);
    coarse_.block<3, 3>(at, at) = system.rigid_bodies[k].translation;
    coarse_.block<3, 3>(at + 3, at + 3) = system.rigid_bodies[k].rotation;
  }
  for (const ContactStiffness& contact : system.contacts) add_coarse_contact(system, contact);
  for (Eigen::Index k = 0; k < coarse_.rows(); ++k)
    coarse_scale_[k] = coarse_(k, k) > 0 ? 1 / std::sqrt(coarse_(k, k)) : 0;
  for (Eigen::Index column = 0; column < coarse_.cols(); ++column) {
    coarse_.col(column).array() *= coarse_scale_.array() * coarse_scale_[column];
    coarse_(column, column) = 1 + coarse_shift;
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(coarse_);
  if (cholesky.info() != Eigen::Success) coarse_scale_.setZero();  // no coarse space, then
}

void LinearSolver::precondition(const LinearSystem& system, const PackedVectors& r, PackedVectors& z) {
  coarse_vector_.setZero();
  const int num_particles = system.matrix.num_particles();
  for (int i = 0; i < num_particles; ++i) {
    const Vector3 own = r.col(i).head<3>();
    z.col(i).head<3>() = inverse_diagonal_[i] * own;
    const int row = 6 * group_of_[i];
    coarse_vector_.segment<3>(row) += own;
    coarse_vector_.segment<3>(row + 3) += Vector3(arms_.col(i).head<3>()).cross(own);
  }
  for (Eigen::Index row = 6 * num_groups(), i = num_particles; i < r.cols(); ++i, row += 3)
    coarse_vector_.segment<3>(row) = r.col(i).head<3>();
  coarse_vector_.array() *= coarse_scale_.array();
  coarse_.triangularView<Eigen::Lower>().solveInPlace(coarse_vector_);
  coarse_.triangularView<Eigen::Lower>().adjoint().solveInPlace(coarse_vector_);
  coarse_vector_.array() *= coarse_scale_.array();
  for (Eigen::Index row = 6 * num_groups(), i = num_particles; i < r.cols(); ++i, row += 3)
    z.col(i).head<3>() = coarse_vector_.segment<3>(row);
  for (int i = 0; i < num_particles; ++i) {
    const int row = 6 * group_of_[i];
    const Vector3 turn = coarse_vector_.segment<3>(row + 3);
    z.col(i).head<3>() += moves_[i] * (coarse_vector_.segment<3>(row) + turn.cross(Vector3(arms_.col(i).head<3>())));
  }
}

Real LinearSolver::squared_norm(const LinearSystem& system, const PackedVectors& r) {
  precondition(system, r, preconditioned_);
  return r.cwiseProduct(preconditioned_).sum();
}

LinearReport LinearSolver::solve(const LinearSystem& system, const PackedVectors& b, const LinearOptions& options,
                                 PackedVectors& x) {
  x.setZero(4, b.cols());
  residual_ = b;
  system.clear_fixed(residual_);
  precondition(system, residual_, preconditioned_);
  Real rz = residual_.cwiseProduct(preconditioned_).sum();
  LinearReport report{.squared_norm = rz};
  const Real enough = options.tolerance * options.tolerance * rz;
  if (!(rz > 0)) return report;
  search_ = preconditioned_;
  while (report.iterations < options.max_iterations) {
    system.multiply(search_, product_);
    const Real curvature = search_.cwiseProduct(product_).sum();
    if (!(curvature > 0)) break;
    const Real length = rz / curvature;
    x += length * search_;
    residual_ -= length * product_;
    ++report.iterations;
    precondition(system, residual_, preconditioned_);
    const Real next = residual_.cwiseProduct(preconditioned_).sum();
    if (!(next > enough)) break;
    search_ = preconditioned_ + (next / rz) * search_;
    rz = next;
  }
  if (report.iterations == 0) x = preconditioned_;  // no curvature: downhill at least
  return report;
}

}  // namespace penalty
