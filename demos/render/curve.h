// Named curves: shared by the inset of a picture and by the SVG plots.
#pragma once
#include <string>
#include <vector>

#include "render/color.h"

namespace penalty::render {

struct Series {
  std::string name{};
  Color color = palette(0);
  std::vector<double> x{}, y{};  // of one length; a non-finite point interrupts the curve
};

}  // namespace penalty::render
