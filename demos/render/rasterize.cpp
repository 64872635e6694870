#include "render/rasterize.h"

#include <algorithm>
#include <cmath>

namespace penalty::render {
namespace {

using Point = Eigen::Vector2f;

Point point_of(const CanvasVertex& vertex) { return {vertex.point[0], vertex.point[1]}; }

float cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Whether a pixel centre exactly on the edge from `a` to `b` belongs to the triangle on its positive side: of two
/// triangles that share the edge, to one.
bool owns_edge(const Point& a, const Point& b) { return b.y() > a.y() || (b.y() == a.y() && b.x() < a.x()); }

/// Bilinear, as a texture is read; s and t from 0 to 1.
float letter_coverage(const FontAtlas& fonts, float s, float t) {
  const int side = fonts.side();
  const float x = s * static_cast<float>(side) - 0.5f, y = t * static_cast<float>(side) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y), u = x - x0, v = y - y0;
  const auto at = [&](int column, int row) {
    column = std::clamp(column, 0, side - 1);
    row = std::clamp(row, 0, side - 1);
    return static_cast<float>(
               fonts.coverage()[static_cast<std::size_t>(row) * static_cast<std::size_t>(side) + column]) /
           255;
  };
  const int i = static_cast<int>(x0), j = static_cast<int>(y0);
  return (1 - v) * ((1 - u) * at(i, j) + u * at(i + 1, j)) + v * ((1 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
}

void blend(Image& image, int x, int y, const Paint& paint, float opacity) {
  std::uint8_t* pixel = &image.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + x)];
  for (int k = 0; k < 3; ++k) {
    const float value = (1 - opacity) * pixel[k] + opacity * 255 * paint[k];
    pixel[k] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.f, 255.f)));
  }
}

void draw_triangle(const CanvasVertex* corners, const FontAtlas& fonts, Image& image) {
  const CanvasVertex* c[3] = {&corners[0], &corners[1], &corners[2]};
  float area = cross(point_of(*c[1]) - point_of(*c[0]), point_of(*c[2]) - point_of(*c[0]));
  if (area < 0) {
    std::swap(c[1], c[2]);
    area = -area;
  }
  if (!(area > 0)) return;
  const Point p[3] = {point_of(*c[0]), point_of(*c[1]), point_of(*c[2])};
  const Point low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
  const int x0 = std::max(0, static_cast<int>(std::floor(low.x()))),
            y0 = std::max(0, static_cast<int>(std::floor(low.y())));
  const int x1 = std::min(image.width - 1, static_cast<int>(std::ceil(high.x())));
  const int y1 = std::min(image.height - 1, static_cast<int>(std::ceil(high.y())));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Point q(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      float weights[3];
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        const Point &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
        weights[k] = cross(b - a, q - a) / area;
        inside = inside && (weights[k] > 0 || (weights[k] == 0 && owns_edge(a, b)));
      }
      if (!inside) continue;
      Point texture(0, 0);
      Paint paint = Paint::Zero();
      for (int k = 0; k < 3; ++k) {
        texture += weights[k] * Point(c[k]->texture_point[0], c[k]->texture_point[1]);
        paint += weights[k] * Eigen::Map<const Paint>(c[k]->paint);
      }
      float opacity = paint[3];
      if (c[0]->brush == 1) opacity *= letter_coverage(fonts, texture.x(), texture.y());
      if (c[0]->brush == 2) opacity *= std::clamp(texture.x() - std::abs(texture.y()) + 0.5f, 0.f, 1.f);
      blend(image, x, y, paint, opacity);
    }
}

}  // namespace

void rasterize(const Canvas& canvas, const FontAtlas& fonts, Image& image) {
  const std::vector<CanvasVertex>& vertices = canvas.vertices();
  for (std::size_t k = 0; k + 2 < vertices.size(); k += 3) draw_triangle(&vertices[k], fonts, image);
}

}  // namespace penalty::render
