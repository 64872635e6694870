#include "penalty/fields/phases.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "penalty/fields/broken_elements.h"
#include "penalty/math/isotropic_projection.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

Matrix3 edges_from_first(const Tetrahedron& t, const Positions& x) {
  Matrix3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = (x.col(t[k + 1]) - x.col(t[0])).head<3>();
  return edges;
}

}  // namespace

PhaseSwitch::PhaseSwitch(std::span<const Tetrahedron> tetrahedra, const Positions& rest,
                         const PhaseThresholds& thresholds)
    : tetrahedra_(tetrahedra.begin(), tetrahedra.end()), thresholds_(thresholds) {
  if (!(thresholds.leave > 0 && thresholds.leave <= thresholds.enter && std::isfinite(thresholds.enter)))
    throw std::invalid_argument("two phases: thresholds are " + to_text(thresholds.enter) + " to enter and " +
                                to_text(thresholds.leave) + " to leave, must be 0 < leave <= enter");
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    for (const int i : tetrahedra_[t])
      if (i < 0 || i >= rest.cols())
        throw std::invalid_argument("two phases: tetrahedron " + std::to_string(t) + ": index " + std::to_string(i) +
                                    " is outside the " + std::to_string(rest.cols()) + " particles");
    inverse_rest_.push_back(edges_from_first(tetrahedra_[t], rest).inverse());
    if (!inverse_rest_.back().allFinite())
      throw std::invalid_argument("two phases: tetrahedron " + std::to_string(t) + " has no volume at rest");
  }
}

void PhaseSwitch::set_broken(const BrokenElements& broken) {
  is_broken_.clear();
  around_.clear();
  if (broken.empty()) return;
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    is_broken_.push_back(broken.cut(tetrahedra_[t]));
    for (const int i : tetrahedra_[t]) {
      if (around_.size() <= static_cast<std::size_t>(i)) around_.resize(i + 1);
      around_[i].push_back(static_cast<int>(t));
    }
  }
}

bool PhaseSwitch::has_lost(std::span<const int> particles) const {
  if (particles.empty() || static_cast<std::size_t>(particles.front()) >= around_.size()) return false;
  bool any = false;
  for (const int t : around_[particles.front()]) {
    const Tetrahedron& corners = tetrahedra_[t];
    const bool holds_all = std::all_of(particles.begin(), particles.end(), [&](int i) {
      return std::find(corners.begin(), corners.end(), i) != corners.end();
    });
    if (holds_all && !is_broken_[t]) return false;
    any = any || holds_all;
  }
  return any;
}

Matrix3 PhaseSwitch::deformation_gradient(std::size_t t, const Positions& x) const {
  return edges_from_first(tetrahedra_[t], x) * inverse_rest_[t];
}

Real PhaseSwitch::largest_strain(const Positions& x) const {
  Real largest = 0;
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    if (is_broken(t)) continue;
    largest = std::max(largest, (signed_singular_values(deformation_gradient(t, x)).array() - 1).abs().maxCoeff());
  }
  return largest;
}

bool PhaseSwitch::looks_far(const Positions& x) const {
  const Real limit = is_far ? thresholds_.leave : thresholds_.enter;
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    if (is_broken(t)) continue;
    const Matrix3 f = deformation_gradient(t, x);
    // |s² - 1| <= |FᵀF - 1|, and |s - 1| <= |s² - 1| for s >= 0: most elements need no more.
    if (f.determinant() > 0 && (f.transpose() * f - Matrix3::Identity()).norm() <= limit) continue;
    if ((signed_singular_values(f).array() - 1).abs().maxCoeff() > limit) return true;
  }
  return false;
}

}  // namespace penalty
