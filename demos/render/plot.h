// A plot as an SVG file: axes, ticks, curves, legend.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "render/curve.h"

namespace penalty::render {

struct Plot {
  std::string title{}, x_label{}, y_label{};
  std::vector<Series> series{};
  int width = 640, height = 400;
};

/// Throws std::invalid_argument if there is no finite point to draw, or a series whose x and y differ in length.
std::string svg(const Plot& plot);

/// Throws like svg(), and std::runtime_error if the file cannot be written.
void write_svg(const std::filesystem::path& path, const Plot& plot);

}  // namespace penalty::render
