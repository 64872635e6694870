#include "render/camera.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "render/picture.h"

namespace penalty::render {
namespace {

constexpr double aspect = 16.0 / 9;

/// Place in the picture, -1 to 1.
Eigen::Array2d seen(const Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d back = (camera.eye - camera.target).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(back).normalized(), up = back.cross(right);
  const Eigen::Vector3d q = point - camera.eye;
  const double slope = std::tan(camera.field_of_view * std::numbers::pi / 360);
  return Eigen::Array2d(q.dot(right) / aspect, q.dot(up)) / (slope * -q.dot(back));
}

TEST(Camera, FillsItsWindowAndNoMore) {
  const Eigen::Vector3d low(-3, 0, -0.2), high(2, 1, 0.3);
  Bounds bounds;
  for (int i = 0; i < 8; ++i)
    bounds.add({i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z()});
  for (const double azimuth : {0.0, 28.0, 90.0, 200.0})
    for (const double elevation : {-20.0, 0.0, 16.0, 89.0}) {
      const View view{.azimuth = azimuth, .elevation = elevation};
      const Camera camera = frame_camera(bounds, aspect, view);
      Eigen::Array2d least(1e9, 1e9), most(-1e9, -1e9);
      for (int i = 0; i < 8; ++i) {
        const Eigen::Array2d p =
            seen(camera, {i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z()});
        least = least.min(p);
        most = most.max(p);
      }
      const auto where = ::testing::Message() << "azimuth " << azimuth << ", elevation " << elevation;
      EXPECT_GT(least.x(), view.left - 0.01) << where;
      EXPECT_LT(most.x(), view.right + 0.01) << where;
      EXPECT_GT(least.y(), view.bottom - 0.01) << where;
      EXPECT_LT(most.y(), view.top + 0.01) << where;
      const double used = std::max((most.x() - least.x()) / (view.right - view.left),
                                   (most.y() - least.y()) / (view.top - view.bottom));
      EXPECT_GT(used, 0.97) << where << ": stands too far away";
    }
}

TEST(Camera, LooksFromTheGivenSide) {
  Bounds bounds;
  bounds.add({5, 6, 7}, 1);
  const auto direction = [&](double azimuth, double elevation) -> Eigen::Vector3d {
    const Camera camera = frame_camera(bounds, aspect, {.azimuth = azimuth, .elevation = elevation});
    return (camera.eye - camera.target).normalized();
  };
  EXPECT_TRUE(direction(0, 0).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
  EXPECT_TRUE(direction(90, 0).isApprox(Eigen::Vector3d::UnitX(), 1e-9));
  EXPECT_NEAR(direction(10, 30).y(), 0.5, 1e-9);
}

TEST(Camera, ScalesAndMovesWithTheScene) {
  Bounds here, there;
  const Eigen::Vector3d offset(300, -20, 7);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-1, 0.5, 2)}) {
    here.add(p, 0.5);
    there.add(offset + 100 * p, 50);
  }
  const Camera a = frame_camera(here, aspect), b = frame_camera(there, aspect);
  EXPECT_GT(a.scene_radius, 1);
  EXPECT_NEAR(b.scene_radius, 100 * a.scene_radius, 1e-6);
  EXPECT_TRUE(b.eye.isApprox(offset + 100 * a.eye, 1e-6));
  EXPECT_TRUE(b.target.isApprox(offset + 100 * a.target, 1e-6));
}

TEST(Camera, SceneSphereHoldsEverything) {
  Frame frame;
  Transform turned = at({1, 2, 3});
  turned.leftCols<3>() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  frame.bodies = {{.shape = Box{{1, 2, 0.1}}, .transform = turned},
                  {.shape = Sphere{0.5}, .transform = at({-2, 0, 0})},
                  {.shape = Cylinder{0.4, 1}, .transform = turned},
                  {.shape = Capsule{0.3, 1}, .transform = at({0, -3, 0})}};
  frame.markers = {{.position = {0, 5, 0}}};
  const Bounds bounds = bounds_of(frame);
  EXPECT_NEAR(bounds.low().x(), -2.5, 1e-9);
  EXPECT_NEAR(bounds.low().y(), -4.3, 1e-9);
  EXPECT_NEAR(bounds.high().y(), 5, 1e-9);
  const Camera camera = frame_camera(bounds, aspect);
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(1, 2, 0.1), Eigen::Vector3d(-1, -2, 0.1)})
    EXPECT_LE((turned * corner.homogeneous() - camera.scene_center).norm(), camera.scene_radius);
  EXPECT_LE((Eigen::Vector3d(0, -4.3, 0) - camera.scene_center).norm(), camera.scene_radius);
}

TEST(Camera, PointsThatAreNoPointsAreLeftOut) {
  Bounds bounds;
  bounds.add({std::nan(""), 0, 0});
  bounds.add({0, INFINITY, 0});
  EXPECT_TRUE(bounds.empty());
  EXPECT_THROW(frame_camera(bounds, aspect), std::invalid_argument);
  bounds.add({1, 2, 3});
  const Camera camera = frame_camera(bounds, aspect);  // a single point still has a camera
  EXPECT_GT((camera.eye - camera.target).norm(), 0.5);
  EXPECT_THROW(frame_camera(bounds, 0), std::invalid_argument);
  EXPECT_THROW(frame_camera(bounds, aspect, {.elevation = 95}), std::invalid_argument);
  EXPECT_THROW(frame_camera(bounds, aspect, {.left = 0.5, .right = 0.2}), std::invalid_argument);
}

TEST(Camera, GridSpacingIsRound) {
  EXPECT_DOUBLE_EQ(grid_spacing({.scene_radius = 2}), 0.5);
  EXPECT_DOUBLE_EQ(grid_spacing({.scene_radius = 200}), 50);
  EXPECT_DOUBLE_EQ(grid_spacing({.scene_radius = 0.05}), 0.01);
}

}  // namespace
}  // namespace penalty::render
