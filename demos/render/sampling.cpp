#include "render/sampling.h"

#include <cmath>
#include <numbers>
#include <numeric>

namespace penalty::render {
namespace {

constexpr double golden_angle = 2.399963229728653;  // pi (3 - sqrt 5)

double radical_inverse(int i, int base) {
  double result = 0, digit = 1.0 / base;
  for (; i > 0; i /= base, digit /= base) result += digit * (i % base);
  return result;
}

/// A stride without a common divisor, near the given share of n: k -> k * stride mod n visits all, far apart.
int stride_of(int n, double share) {
  int stride = std::max(1, static_cast<int>(std::lround(share * n)));
  while (std::gcd(stride, n) != 1) ++stride;
  return stride;
}

}  // namespace

std::vector<Sample> sample_set(int count) {
  if (count == 1) return {{{0, 0}, {0, 0}, {0, 1, 0}, {0, 0}}};
  // Each of the three covers its own domain evenly (Hammersley points, two golden spirals); different orders keep
  // them from going hand in hand.
  const int disc_stride = stride_of(count, 0.618), sky_stride = stride_of(count, 0.382);
  std::vector<Sample> samples;
  for (int k = 0; k < count; ++k) {
    Sample s;
    const double x = (k + 0.5) / count, y = radical_inverse(k, 2) + 0.5 / count;
    s.pixel = Eigen::Vector2d(x - 0.5, y - 0.5).cast<float>();
    const int d = (k * disc_stride) % count;
    const double radius = std::sqrt((d + 0.5) / count), turn = golden_angle * d;
    s.disc = Eigen::Vector2d(radius * std::cos(turn), radius * std::sin(turn)).cast<float>();
    const int h = (k * sky_stride) % count;
    // Not quite down to the horizon: light that grazes shows the bias of the shadow map.
    const double height = 0.03 + 0.97 * (h + 0.5) / count, flat = std::sqrt(1 - height * height);
    s.sky = Eigen::Vector3d(flat * std::cos(golden_angle * h), height, flat * std::sin(golden_angle * h)).cast<float>();
    s.noise = Eigen::Vector2d(radical_inverse(k, 3), radical_inverse(k, 5)).cast<float>();
    samples.push_back(s);
  }
  return samples;
}

}  // namespace penalty::render
