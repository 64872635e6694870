// Colours, and the maps from numbers to colours.
#pragma once
#include <Eigen/Core>
#include <string_view>

namespace penalty::render {

using Color = Eigen::Vector3f;  // red, green, blue in sRGB, 0 to 1

/// Linear light of an sRGB colour, as the shaders reckon.
Color linear(const Color& srgb);

/// Distinct, quiet colours for rigid bodies and curves; any index is allowed.
Color palette(int index);

/// `turbo` for magnitudes seen from afar, `viridis` for print and colour-blind readers, `diverging` (blue, grey, red)
/// for signed values.
enum class ColorMap { turbo, viridis, diverging };

/// "turbo", "viridis" or "diverging"; throws std::invalid_argument for anything else.
ColorMap color_map_from_name(std::string_view name);

/// `position` is clamped to 0..1; NaN counts as 0. sRGB.
Color map_color(ColorMap map, double position);

/// Which value gets which place on a colour map.
struct ColorScale {
  ColorMap map = ColorMap::turbo;
  double low = 0, high = 1;  // values at the two ends
  bool square_root = false;  // spreads small values: place ~ sign(v) sqrt(|v|)

  /// 0 at `low`, 1 at `high`, clamped; 0 for NaN or an empty range.
  double position(double value) const;
};

}  // namespace penalty::render
