#include "scenes/rigid_object.h"

#include <gtest/gtest.h>

namespace penalty::demo {
namespace {

const Matrix3 turned = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
const Pose pose{turned, {1, -2, 0.5}};

Vector3 world(const Vector3& local) { return pose.rotation * local + pose.position; }

TEST(RigidObject, DepthIsTheDistanceToTheNearestFace) {
  const RigidObject block{.shape = Block{{1, 2, 3}}};
  EXPECT_NEAR(depth(block, pose, world({0, 0, 0})), 1, 1e-14);
  EXPECT_NEAR(depth(block, pose, world({0.2, -1.9, 1})), 0.1, 1e-14);
  EXPECT_NEAR(depth(block, pose, world({0, 0, 3.5})), -0.5, 1e-14);
  EXPECT_LT(depth(block, pose, world({1.1, 2.1, 3.1})), 0);
  const RigidObject ball{.shape = Ball{0.5}};
  EXPECT_NEAR(depth(ball, pose, world({0.3, 0, 0})), 0.2, 1e-14);
  EXPECT_NEAR(depth(ball, pose, world({0, -1, 0})), -0.5, 1e-14);
}

TEST(RigidObject, InertiaIsThatOfItsShape) {
  EXPECT_EQ(inertia({.shape = Ball{2}, .mass = 5}), Vector3::Constant(8));
  // m/3 (b² + c²), half extents b and c.
  EXPECT_TRUE(inertia({.shape = Block{{1, 2, 3}}, .mass = 3}).isApprox(Vector3(13, 10, 5), 1e-15));
}

TEST(RigidObject, TakesImpulsesOnlyIfItIsFree) {
  EXPECT_TRUE((RigidObject{.shape = Ball{1}, .mass = 1}.pushes_back()));
  EXPECT_FALSE((RigidObject{.shape = Ball{1}}.pushes_back()));
  EXPECT_FALSE((RigidObject{.shape = Ball{1}, .mass = 1, .path = [](Real) { return Pose(); }}.pushes_back()));
}

}  // namespace
}  // namespace penalty::demo
