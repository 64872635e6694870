// Small scenes and pixel statistics for the tests of the renderer.
#pragma once
#include <dlfcn.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include "render/renderer.h"

namespace penalty::render::test {

inline constexpr int width = 320, height = 180;

/// One thread a renderer, so that tests that run side by side do not fight for the cores.
inline RendererOptions options_for(Backend backend, int samples = 1) {
  setenv("LP_NUM_THREADS", "1", 0);
  return {.backend = backend, .width = width, .height = height, .samples = samples};
}

/// Of Mesa 25.1 and later. The library stays loaded: the renderer leaves it so, too.
inline bool osmesa_is_gone() {
  const std::vector<std::string> names = BackendLibraries{}.osmesa;
  return std::none_of(names.begin(), names.end(),
                      [](const std::string& name) { return dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL); });
}

/// A sphere of 2 * 24 * 48 triangles, seen from outside counter-clockwise.
inline SoftSurface ball(const Eigen::Vector3d& center, double radius) {
  constexpr int rings = 24, around = 48;
  SoftSurface surface;
  surface.vertices.resize(3, (rings + 1) * around);
  for (int j = 0; j <= rings; ++j)
    for (int i = 0; i < around; ++i) {
      const double polar = std::numbers::pi * j / rings, turn = 2 * std::numbers::pi * i / around;
      surface.vertices.col(j * around + i) =
          center +
          radius * Eigen::Vector3d(std::sin(polar) * std::sin(turn), std::cos(polar), std::sin(polar) * std::cos(turn));
    }
  for (int j = 0; j < rings; ++j)
    for (int i = 0; i < around; ++i) {
      const int a = j * around + i, b = j * around + (i + 1) % around;
      surface.triangles.push_back({a, a + around, b});
      surface.triangles.push_back({b, a + around, b + around});
    }
  return surface;
}

/// The pixel (x, y from the upper left corner) that a point is seen in.
inline Eigen::Vector2d projected(const Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d back = (camera.eye - camera.target).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(back).normalized(), up = back.cross(right);
  const Eigen::Vector3d q = point - camera.eye;
  const double slope = std::tan(camera.field_of_view * std::numbers::pi / 360), depth = -q.dot(back);
  return {0.5 * width + 0.5 * height * q.dot(right) / (slope * depth),
          0.5 * height - 0.5 * height * q.dot(up) / (slope * depth)};
}

inline double luminance(const std::array<int, 3>& p) { return 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]; }

/// Mean over the three channels and all pixels of |a - b|, 0 to 255.
inline double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  return sum / static_cast<double>(a.rgb.size());
}

/// The pixels in which two pictures differ clearly.
struct Region {
  int count = 0;
  Eigen::Vector2d center{0, 0};
  Eigen::Vector2d low{1e9, 1e9}, high{-1e9, -1e9};
  Eigen::Vector3d mean_color{0, 0, 0};  // of the first picture, 0 to 255
  std::vector<char> mask;

  Region(const Image& with, const Image& without, int threshold = 8)
      : mask(static_cast<std::size_t>(with.width) * with.height, 0) {
    for (int y = 0; y < with.height; ++y)
      for (int x = 0; x < with.width; ++x) {
        const auto p = with.pixel(x, y), q = without.pixel(x, y);
        if (std::max({std::abs(p[0] - q[0]), std::abs(p[1] - q[1]), std::abs(p[2] - q[2])}) <= threshold) continue;
        const Eigen::Vector2d middle(x + 0.5, y + 0.5);
        ++count;
        center += middle;
        low = low.cwiseMin(middle);
        high = high.cwiseMax(middle);
        mean_color += Eigen::Vector3d(p[0], p[1], p[2]);
        mask[static_cast<std::size_t>(y) * with.width + x] = 1;
      }
    center /= std::max(1, count);
    mean_color /= std::max(1, count);
  }
};

inline Frame empty_like(const Frame& frame) {
  Frame empty = frame;
  empty.surfaces.clear();
  empty.bodies.clear();
  empty.markers.clear();
  return empty;
}

}  // namespace penalty::render::test
