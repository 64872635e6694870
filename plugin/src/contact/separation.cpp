// The part of SurfacePair that keeps features from crossing.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "penalty/contact/surface_pair.h"

namespace penalty {
namespace {

constexpr Real kept_share = 0.1;  // of the distance, or of the thickness, that a drift must leave

// Calls visit(i, j) for the points of the first feature and those of the second.
template <class Visit>
void visit_points(bool are_edges, const Visit& visit) {
  const int size_of_first = are_edges ? 2 : 1;
  for (int i = 0; i < size_of_first; ++i)
    for (int j = size_of_first; j < 4; ++j) visit(i, j);
}

// Least distance along n of points of the first feature from those of the second.
Real separation(const Vector3& n, const std::array<Vector3, 4>& x, bool are_edges) {
  Real least = std::numeric_limits<Real>::infinity();
  visit_points(are_edges, [&](int i, int j) { least = std::min(least, n.dot(x[i] - x[j])); });
  return least;
}

}  // namespace

Vector3 SurfacePair::direction(const FeaturePair& q, const ClosestPoints& closest) const {
  const Real distance = closest.difference.norm();
  if (!has_no_direction(q, distance)) return closest.difference / distance;
  const ContactSurface& two = second(q);
  if (q.are_edges || !two.is_closed()) return Vector3::Zero();
  const Vector3 a = two.position(q.points[1]);
  return (two.position(q.points[2]) - a).cross(two.position(q.points[3]) - a).normalized();
}

Real SurfacePair::separated_share(FeaturePair& q, Real h, Real reach) const {
  find_difference(q);
  const Real distance = q.distance;
  if (has_no_direction(q, distance)) return 1;
  const Real radius = b_->radius(), bend = b_->bend(h);
  const Real kept = std::min(
      distance, std::max(radius + kept_share * std::min(std::max<Real>(distance - radius, 0), q.thickness - radius),
                         2 * least_distance(q)));
  if (reach + bend < distance - kept) return 1;
  std::array<Vector3, 4> v;
  for (int k = 0; k < 4; ++k) v[k] = surface_of(q, k).velocity(q.points[k]);
  Real relative2 = 0;
  for (int k = 1; k < 4; ++k) relative2 = std::max(relative2, (v[k] - v[0]).squaredNorm());
  if (2 * h * std::sqrt(relative2) < distance - kept) return 1;
  std::array<Vector3, 4> start, end;
  for (int k = 0; k < 4; ++k) {
    start[k] = surface_of(q, k).position(q.points[k]);
    end[k] = start[k] + h * v[k];
  }
  const Vector3 n = q.difference / distance;
  const bool is_separated = separation(n, start, q.are_edges) > 0;
  if (is_separated && separation(n, end, q.are_edges) >= kept + bend) return 1;
  const Vector3 after = (q.are_edges ? closest_points_of_edges(end[0], end[1], end[2], end[3])
                                     : closest_points_of_triangle(end[0], end[1], end[2], end[3]))
                            .difference;
  const Real distance_after = after.norm();
  if (distance_after >= kept + bend && distance_after > 0 && separation(after / distance_after, start, q.are_edges) > 0)
    return 1;
  if (!is_separated) return 0;
  Real share = 1;
  visit_points(q.are_edges, [&](int i, int j) {
    const Real before = n.dot(start[i] - start[j]), closing = before - n.dot(end[i] - end[j]) + bend;
    if (closing > 0) share = std::min(share, std::max<Real>(before - kept, 0) / closing);
  });
  return std::min(share, std::nextafter(Real(1), Real(0)));
}

}  // namespace penalty
