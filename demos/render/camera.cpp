#include "render/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "render/ticks.h"

namespace penalty::render {
namespace {

/// Unit vectors spread evenly over the sphere: a golden spiral.
template <int Count>
Eigen::Matrix<double, 3, Count> even_directions() {
  Eigen::Matrix<double, 3, Count> directions;
  for (int i = 0; i < Count; ++i) {
    const double y = 1 - (2 * i + 1.0) / Count, flat = std::sqrt(1 - y * y), turn = 2.399963229728653 * i;
    directions.col(i) << flat * std::cos(turn), y, flat * std::sin(turn);
  }
  return directions;
}

void check(const Bounds& bounds, double aspect, const View& view) {
  if (bounds.empty()) throw std::invalid_argument("frame_camera: the bounds are empty");
  if (!(aspect > 0) || !std::isfinite(aspect)) throw std::invalid_argument("frame_camera: aspect must be positive");
  if (!std::isfinite(view.azimuth) || !(std::abs(view.elevation) <= 89))
    throw std::invalid_argument("frame_camera: elevation must lie within -89 to 89 degrees");
  if (!(view.field_of_view >= 1 && view.field_of_view <= 120))
    throw std::invalid_argument("frame_camera: field of view must lie within 1 to 120 degrees");
  if (!(view.left >= -1 && view.left < view.right && view.right <= 1 && view.bottom >= -1 && view.bottom < view.top &&
        view.top <= 1))
    throw std::invalid_argument("frame_camera: left < right and bottom < top must lie within -1 to 1");
}

}  // namespace

void Bounds::offer(int direction, const Eigen::Vector3d& point, double along) {
  if (along <= along_[direction]) return;
  along_[direction] = along;
  extremes_.col(direction) = point;
}

void Bounds::add(const Eigen::Vector3d& point, double radius) {
  static const Eigen::Matrix<double, 3, directions> axes = even_directions<directions>();
  if (!point.allFinite() || !std::isfinite(radius)) return;
  low_ = low_.cwiseMin((point.array() - radius).matrix());
  high_ = high_.cwiseMax((point.array() + radius).matrix());
  const Eigen::Matrix<double, 1, directions> along = (point.transpose() * axes).array() + radius;
  for (int i = 0; i < directions; ++i) offer(i, point + radius * axes.col(i), along[i]);
  ++count_;
}

void Bounds::add(const Bounds& other) {
  low_ = low_.cwiseMin(other.low_);
  high_ = high_.cwiseMax(other.high_);
  for (int i = 0; i < directions; ++i) offer(i, other.extremes_.col(i), other.along_[i]);
  count_ += other.count_;
}

Eigen::Matrix3Xd Bounds::extremes() const { return extremes_; }

Camera frame_camera(const Bounds& bounds, double aspect, const View& view) {
  check(bounds, aspect, view);
  Camera camera;
  camera.field_of_view = view.field_of_view;
  camera.scene_center = 0.5 * (bounds.low() + bounds.high());
  Eigen::Matrix3Xd points = bounds.extremes().colwise() - camera.scene_center;
  double radius = std::sqrt(points.colwise().squaredNorm().maxCoeff());
  if (radius < 1e-12 * (1 + camera.scene_center.norm())) {
    radius = 0.5;
    points.leftCols<6>() << 0.5 * Eigen::Matrix3d::Identity(), -0.5 * Eigen::Matrix3d::Identity();
  }
  camera.scene_radius = 1.04 * radius;  // what lies between the directions looked into may stand out a little

  // Axes of the picture: right, up, and back to the eye.
  constexpr double degree = std::numbers::pi / 180;
  const double azimuth = view.azimuth * degree, elevation = view.elevation * degree;
  Eigen::Matrix3d axes;
  axes.row(2) << std::cos(elevation) * std::sin(azimuth), std::sin(elevation), std::cos(elevation) * std::cos(azimuth);
  axes.row(0) << std::cos(azimuth), 0, -std::sin(azimuth);
  axes.row(1) = axes.row(2).cross(axes.row(0));
  points = axes * points;

  // From the eye at (s, d) a point (x, z) is seen at (x - s) / (k (d - z)), k the slope of the picture's edge. It lies
  // between low and high if x + high k z - high k d <= s <= x + low k z - low k d. Some s satisfies all points if
  // max(x + high k z) - min(x + low k z) <= (high - low) k d; the same for y.
  const double slope_y = std::tan(0.5 * view.field_of_view * degree);
  const Eigen::Vector2d slope(slope_y * aspect, slope_y);
  const Eigen::Vector2d low = slope.cwiseProduct(Eigen::Vector2d(view.left, view.bottom));
  const Eigen::Vector2d high = slope.cwiseProduct(Eigen::Vector2d(view.right, view.top));
  const Eigen::Vector2d most = (points.topRows<2>() + high * points.row(2)).rowwise().maxCoeff();
  const Eigen::Vector2d least = (points.topRows<2>() + low * points.row(2)).rowwise().minCoeff();
  // Not closer than the scene is deep, where the perspective would be wild.
  const double nearest = points.row(2).maxCoeff() + 0.2 * radius;
  const double distance = std::max(nearest, (most - least).cwiseQuotient(high - low).maxCoeff());
  const Eigen::Vector2d shift = 0.5 * (most - distance * high + least - distance * low);
  camera.target = camera.scene_center + axes.topRows<2>().transpose() * shift;
  camera.eye = camera.target + distance * axes.row(2).transpose();
  return camera;
}

double grid_spacing(const Camera& camera) { return nice_step(0.2 * camera.scene_radius); }

}  // namespace penalty::render
