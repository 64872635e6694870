#include "render/projection.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace penalty::render {
namespace {

Eigen::Matrix4f look_at(const Eigen::Vector3f& eye, const Eigen::Vector3f& target, const Eigen::Vector3f& up) {
  const Eigen::Vector3f back = (eye - target).normalized(), right = up.cross(back).normalized();
  Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
  m.block<1, 3>(0, 0) = right.transpose();
  m.block<1, 3>(1, 0) = back.cross(right).transpose();
  m.block<1, 3>(2, 0) = back.transpose();
  m.block<3, 1>(0, 3) = -(m.block<3, 3>(0, 0) * eye);
  return m;
}

/// Parallel light from `direction` onto the unit sphere.
Eigen::Matrix4f light_matrix(const Eigen::Vector3f& direction) {
  constexpr float distance = 2, reach = 1.2f;
  const Eigen::Vector3f up = std::abs(direction.y()) > 0.95f ? Eigen::Vector3f::UnitZ() : Eigen::Vector3f::UnitY();
  Eigen::Matrix4f projection = Eigen::Matrix4f::Identity();
  projection(2, 2) = -1 / reach;
  projection(2, 3) = -distance / reach;
  return projection * look_at(distance * direction, Eigen::Vector3f::Zero(), up);
}

/// `shift` moves the picture by so many pixels.
Eigen::Matrix4f perspective(float field_of_view, float near, float far, const Eigen::Vector2f& resolution,
                            const Eigen::Vector2f& shift) {
  const float f = 1 / std::tan(0.5f * field_of_view);
  Eigen::Matrix4f m = Eigen::Matrix4f::Zero();
  m(0, 0) = f * resolution.y() / resolution.x();
  m(1, 1) = f;
  m(0, 2) = 2 * shift.x() / resolution.x();
  m(1, 2) = 2 * shift.y() / resolution.y();
  m(2, 2) = (far + near) / (near - far);
  m(2, 3) = 2 * far * near / (near - far);
  m(3, 2) = -1;
  return m;
}

/// `sample` is a point of the unit disc; the disc is 4 degrees wide, eight times the real sun: soft, not sharp.
Eigen::Vector3f sun_direction(const Eigen::Vector3f& to_eye, const Eigen::Vector2f& sample) {
  constexpr float disc = 0.075f, beside_camera = -1.05f, height = 0.84f;
  const float turn = std::atan2(to_eye.x(), to_eye.z()) + beside_camera;
  const Eigen::Vector3f middle =
      Eigen::Vector3f(std::cos(height) * std::sin(turn), std::sin(height), std::cos(height) * std::cos(turn));
  const Eigen::Vector3f a = middle.cross(Eigen::Vector3f::UnitY()).normalized(), b = middle.cross(a);
  return (middle + disc * (sample.x() * a + sample.y() * b)).normalized();
}

}  // namespace

PassView pass_view(const Camera& camera, const UnitSpace& space, const Sample& sample,
                   const Eigen::Vector2f& resolution) {
  PassView view;
  view.eye = space(camera.eye);
  const Eigen::Vector3f target = space(camera.target), to_eye = view.eye - target;
  const float distance = to_eye.norm();
  // The ground's far corner, and for the near side whatever stands in front of the scene.
  const float far = view.eye.norm() + 1.5f * Scene::ground_radius, near = 0.02f * distance;
  const Eigen::Vector3f up =
      std::abs(to_eye.y()) > 0.9999f * distance ? Eigen::Vector3f::UnitZ() : Eigen::Vector3f::UnitY();
  const float angle = static_cast<float>(camera.field_of_view * std::numbers::pi / 180);
  view.view_projection = perspective(angle, near, far, resolution, sample.pixel) * look_at(view.eye, target, up);
  view.sun_direction = sun_direction(to_eye, sample.disc);
  view.sky_direction = sample.sky;
  view.sun_matrix = light_matrix(view.sun_direction);
  view.sky_matrix = light_matrix(view.sky_direction);
  view.noise = sample.noise;
  view.resolution = resolution;
  return view;
}

}  // namespace penalty::render
