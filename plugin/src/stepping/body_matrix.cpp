#include "penalty/stepping/body_matrix.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace penalty {
namespace {

constexpr int particles_in_group = 40;  // least

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

void BodyMatrix::make_groups(int most) {
  const int num_particles = values.num_particles();
  group_of_ = group_neighbours(values.blocks(), std::max(particles_in_group, (num_particles + most - 1) / most));
  const int groups = group_of_.empty() ? 0 : *std::max_element(group_of_.begin(), group_of_.end()) + 1;
  group_begin_.assign(groups + 1, 0);
  for (const int group : group_of_) ++group_begin_[group + 1];
  for (int g = 0; g < groups; ++g) group_begin_[g + 1] += group_begin_[g];
  group_members_.resize(num_particles);
  std::vector<int> next(group_begin_.begin(), group_begin_.end() - 1);
  for (int i = 0; i < num_particles; ++i) group_members_[next[group_of_[i]]++] = i;

  diagonal_.resize(num_particles);
  moves_.resize(num_particles);
  arms_.setZero(4, num_particles);
  coarse_.resize(6 * groups, 6 * groups);
  motion_.resize(6 * groups);
}

void BodyMatrix::factorize(const Positions& x) {
  std::fill(moves_.begin(), moves_.end(), 1);
  for (const int i : fixed) moves_[i] = 0;
  sum_diagonal();
  sum_coarse(x);
}

void BodyMatrix::sum_diagonal() {
  const int num_particles = values.num_particles();
  for (int i = 0; i < num_particles; ++i) diagonal_[i] = values.blocks().diagonal(i);
  for (const RankOneTerm& term : values.terms())
    if (term.coefficient > 0)
      for (std::size_t k = 0; k < term.particles.size(); ++k) {
        const Vector3 d = term.direction.col(static_cast<Eigen::Index>(k));
        diagonal_[term.particles[k]] += term.coefficient * (d * d.transpose());
      }
}

// What block (i, j) adds to the lower triangle of Zᵀ A Z, where column 6g + k of Z is the k-th rigid motion of group g:
// particle i, at r_i from its centre, moves by t + w x r_i.
void BodyMatrix::add_coarse_block(int i, int j, const Matrix3& block) {
  const int row = 6 * group_of_[i], column = 6 * group_of_[j];
  if (column > row || moves_[i] == 0 || moves_[j] == 0) return;
  const Matrix3 arm_i = cross_matrix(arms_.col(i).head<3>());
  const Matrix3 turned = block * cross_matrix(arms_.col(j).head<3>());
  coarse_.block<3, 3>(row, column) += block;
  coarse_.block<3, 3>(row, column + 3) -= turned;
  coarse_.block<3, 3>(row + 3, column) += arm_i * block;
  coarse_.block<3, 3>(row + 3, column + 3) -= arm_i * turned;
}

void BodyMatrix::sum_coarse(const Positions& x) {
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
  coarse_.setZero();
  for (int i = 0; i < values.num_particles(); ++i)
    values.blocks().visit_row(i, [&](int j, const Matrix3& block) { add_coarse_block(i, j, block); });
  for (const RankOneTerm& term : values.terms()) {
    motion_.setZero();
    for (std::size_t k = 0; k < term.particles.size(); ++k) {
      const int i = term.particles[k], row = 6 * group_of_[i];
      const Vector3 d = moves_[i] * term.direction.col(static_cast<Eigen::Index>(k));
      motion_.segment<3>(row) += d;
      motion_.segment<3>(row + 3) += Vector3(arms_.col(i).head<3>()).cross(d);
    }
    coarse_.selfadjointView<Eigen::Lower>().rankUpdate(motion_, term.coefficient);
  }
}

}  // namespace penalty
