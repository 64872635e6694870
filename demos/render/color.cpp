#include "render/color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace penalty::render {
namespace {

/// Coefficients of one polynomial a channel, lowest power first.
template <std::size_t Terms>
Color polynomial(const std::array<std::array<float, Terms>, 3>& coefficients, float x) {
  Color value;
  for (int channel = 0; channel < 3; ++channel) {
    float sum = 0;
    for (std::size_t i = Terms; i-- > 0;) sum = sum * x + coefficients[channel][i];
    value[channel] = sum;
  }
  return value.cwiseMax(0.f).cwiseMin(1.f);
}

// The polynomial that Turbo's authors publish (A. Mikhailov, R. Du, Google, Apache 2.0). Its lowest seventh is almost
// black, which would look like shadow on a lit body: we start at 0.07.
Color turbo(float x) {
  static constexpr std::array<std::array<float, 6>, 3> fit{{
      {0.13572138f, 4.61539260f, -42.66032258f, 132.13108234f, -152.94239396f, 59.28637943f},
      {0.09140261f, 2.19418839f, 4.84296658f, -14.18503333f, 4.27729857f, 2.82956604f},
      {0.10667330f, 12.64194608f, -60.58204836f, 110.36276771f, -89.90310912f, 27.34824973f},
  }};
  return polynomial(fit, 0.07f + 0.93f * x);
}

// Fit to viridis (S. van der Walt, N. Smith, CC0) by M. Zucker, CC0.
Color viridis(float x) {
  static constexpr std::array<std::array<float, 7>, 3> fit{{
      {0.27772733f, 0.10509304f, -0.33086183f, -4.63423050f, 6.22826994f, 4.77638500f, -5.43545586f},
      {0.00540734f, 1.40461353f, 0.21484756f, -5.79910097f, 14.17993337f, -13.74514538f, 4.64585261f},
      {0.33409981f, 1.38459016f, 0.09509516f, -19.33244096f, 56.69055260f, -65.35303263f, 26.31243525f},
  }};
  return polynomial(fit, x);
}

// Blue to red through grey, equal steps of lightness on both sides (K. Moreland, 2009).
Color diverging(float x) {
  static const std::array<Eigen::Vector3f, 9> stops{{{59, 76, 192},
                                                     {98, 130, 234},
                                                     {141, 176, 254},
                                                     {184, 208, 249},
                                                     {221, 221, 221},
                                                     {245, 196, 173},
                                                     {244, 154, 123},
                                                     {222, 96, 77},
                                                     {180, 4, 38}}};
  const float place = 8 * x;
  const int below = std::min(7, static_cast<int>(place));
  const float share = place - static_cast<float>(below);
  return ((1 - share) * stops[below] + share * stops[below + 1]) / 255.f;
}

}  // namespace

Color linear(const Color& srgb) {
  return srgb.unaryExpr([](float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); });
}

Color palette(int index) {
  static const std::array<Color, 8> colors{{{0.35f, 0.42f, 0.53f},
                                            {0.85f, 0.47f, 0.33f},
                                            {0.89f, 0.73f, 0.36f},
                                            {0.40f, 0.62f, 0.56f},
                                            {0.50f, 0.43f, 0.61f},
                                            {0.44f, 0.62f, 0.79f},
                                            {0.74f, 0.44f, 0.50f},
                                            {0.62f, 0.64f, 0.45f}}};
  const int count = static_cast<int>(colors.size());
  return colors[((index % count) + count) % count];
}

ColorMap color_map_from_name(std::string_view name) {
  if (name == "turbo") return ColorMap::turbo;
  if (name == "viridis") return ColorMap::viridis;
  if (name == "diverging") return ColorMap::diverging;
  throw std::invalid_argument("unknown colour map '" + std::string(name) + "': turbo, viridis or diverging");
}

Color map_color(ColorMap map, double position) {
  const float x = position > 0 ? static_cast<float>(std::min(position, 1.0)) : 0.f;  // NaN: 0
  switch (map) {
    case ColorMap::turbo:
      return turbo(x);
    case ColorMap::viridis:
      return viridis(x);
    case ColorMap::diverging:
      return diverging(x);
  }
  throw std::invalid_argument("unknown colour map");
}

double ColorScale::position(double value) const {
  const auto scaled = [this](double v) { return square_root ? std::copysign(std::sqrt(std::abs(v)), v) : v; };
  const double place = (scaled(value) - scaled(low)) / (scaled(high) - scaled(low));
  if (!(high > low) || std::isnan(place)) return 0;
  return std::clamp(place, 0.0, 1.0);
}

}  // namespace penalty::render
