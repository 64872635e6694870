#include "winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace penalty {
namespace {

constexpr int leaf_size = 8;
constexpr Real far_away = 3;  // radii

Matrix3 corners(const TriangleSurface& surface, int triangle) {
  const Triangle& t = surface.triangles[triangle];
  Matrix3 points;
  for (int k = 0; k < 3; ++k) points.col(k) = surface.vertices.col(t[k]);
  return points;
}

// Over 4 pi.
Real solid_angle(const Matrix3& corners, const Vector3& point) {
  const Matrix3 p = corners.colwise() - point;
  const Real a = p.col(0).norm(), b = p.col(1).norm(), c = p.col(2).norm();
  const Real numerator = p.col(0).dot(p.col(1).cross(p.col(2)));
  const Real denominator =
      a * b * c + p.col(0).dot(p.col(1)) * c + p.col(1).dot(p.col(2)) * a + p.col(2).dot(p.col(0)) * b;
  return std::atan2(numerator, denominator) / (2 * std::numbers::pi);
}

}  // namespace

WindingNumber::WindingNumber(const TriangleSurface& surface) : surface_(surface), order_(surface.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  for (const int t : order_) middles_.push_back(corners(surface, t).rowwise().mean());
  if (!order_.empty()) build(0, static_cast<int>(order_.size()));
}

void WindingNumber::build(int begin, int end) {
  const std::size_t index = nodes_.size();
  nodes_.emplace_back();
  Node node{Vector3::Zero(), Vector3::Zero(), 0, begin, end, 0};
  Vector3 low = middles_[order_[begin]], high = low;
  Real weight = 0;
  for (int i = begin; i < end; ++i) {
    const Matrix3 p = corners(surface_, order_[i]);
    const Vector3 area = (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)) / 2;
    const Vector3& middle = middles_[order_[i]];
    node.area += area;
    node.center += area.norm() * middle;
    weight += area.norm();
    low = low.cwiseMin(middle);
    high = high.cwiseMax(middle);
  }
  node.center = weight > 0 ? Vector3(node.center / weight) : Vector3((low + high) / 2);
  for (int i = begin; i < end; ++i)
    node.radius =
        std::max(node.radius, (corners(surface_, order_[i]).colwise() - node.center).colwise().norm().maxCoeff());
  if (end - begin > leaf_size) {
    Eigen::Index axis = 0;
    (high - low).maxCoeff(&axis);
    const int middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) { return std::pair(middles_[a][axis], a) < std::pair(middles_[b][axis], b); });
    build(begin, middle);
    node.right = static_cast<int>(nodes_.size());
    build(middle, end);
  }
  nodes_[index] = node;
}

Real WindingNumber::sum(int index, const Vector3& point) const {
  const Node& node = nodes_[index];
  const Vector3 way = node.center - point;
  const Real distance = way.norm();
  if (distance > far_away * node.radius)
    return node.area.dot(way) / (4 * std::numbers::pi * distance * distance * distance);
  if (node.right > 0) return sum(index + 1, point) + sum(node.right, point);
  Real total = 0;
  for (int i = node.begin; i < node.end; ++i) total += solid_angle(corners(surface_, order_[i]), point);
  return total;
}

Real enclosure(const TriangleSurface& surface) {
  const WindingNumber winding(surface);
  Real sum = 0, total = 0;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const Matrix3 p = corners(surface, t);
    const Vector3 normal = (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)), middle = p.rowwise().mean();
    const Real area = normal.norm();
    if (!(area > 0)) continue;
    const Vector3 aside = normal * (1e-4 / std::sqrt(area));
    sum += area * std::max(std::abs(winding.at(middle - aside)), std::abs(winding.at(middle + aside)));
    total += area;
  }
  return total > 0 ? sum / total : 0;
}

}  // namespace penalty
