// The camera, set once for a clip from the bounds of everything that happens in it, so that the picture never jumps.
#pragma once
#include <Eigen/Core>
#include <limits>

namespace penalty::render {

/// The extent of a clip: the outermost points in many directions, of which the convex hull is nearly that of all points
/// added; a box alone would leave a picture half empty. Non-finite points are left out.
class Bounds {
 public:
  void add(const Eigen::Vector3d& point, double radius = 0);  // a ball, or a point [m]
  void add(const Bounds& other);

  bool empty() const { return count_ == 0; }
  Eigen::Vector3d low() const { return low_; }  // of the axis-aligned box [m]
  Eigen::Vector3d high() const { return high_; }
  /// Outermost points [m], one column a direction; meaningless while empty.
  Eigen::Matrix3Xd extremes() const;

 private:
  static constexpr int directions = 96;
  void offer(int direction, const Eigen::Vector3d& point, double along);

  Eigen::Vector3d low_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high_ = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());
  Eigen::Matrix<double, 3, directions> extremes_ = Eigen::Matrix<double, 3, directions>::Zero();
  Eigen::Matrix<double, 1, directions> along_ =
      Eigen::Matrix<double, 1, directions>::Constant(-std::numeric_limits<double>::infinity());
  long count_ = 0;
};

/// Where to look from, and how: y points up.
struct View {
  double azimuth = 28;        // [degrees] 0 looks along -z, 90 along -x
  double elevation = 16;      // [degrees] above the horizon, -89 to 89
  double field_of_view = 32;  // [degrees] vertical
  // The part of the picture that the bounds may fill, in shares of its half width and half height from the middle: room
  // is left for the title above, and on both sides for what falls there.
  double left = -0.80, right = 0.72, bottom = -0.84, top = 0.62;
};

struct Camera {
  Eigen::Vector3d eye{0, 0, 4};           // [m]
  Eigen::Vector3d target{0, 0, 0};        // [m]
  double field_of_view = 32;              // [degrees] vertical
  Eigen::Vector3d scene_center{0, 0, 0};  // [m] of the sphere that holds everything that casts a shadow
  double scene_radius = 1;                // [m] of that sphere; sizes of grid, markers and shadows follow from it
};

/// The nearest camera from which all of `bounds` is seen. `aspect` is width / height. Throws std::invalid_argument for
/// empty bounds, impossible angles or margins; bounds of no extent get a radius of 0.5 m.
Camera frame_camera(const Bounds& bounds, double aspect, const View& view = {});

/// Distance between the fine lines of the ground's grid [m]: 1, 2 or 5 times a power of ten, for captions.
double grid_spacing(const Camera& camera);

}  // namespace penalty::render
