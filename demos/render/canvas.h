// Flat drawing over a picture: rectangles, lines, texts, gathered as triangles.
#pragma once
#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "render/color.h"
#include "render/font.h"

namespace penalty::render {

using Paint = Eigen::Vector4f;  // sRGB and opacity

inline Paint opaque(const Color& color) { return {color.x(), color.y(), color.z(), 1}; }

/// Corner positions in pixels from the upper left corner.
struct CanvasVertex {
  float point[2];
  float texture_point[2];
  float paint[4];
  float brush;  // 0 plain, 1 letter, 2 line
};

enum class Align { left, center, right };

/// Works in units that are one pixel at 720 lines. Below, they shrink less than the picture does, so that texts stay
/// readable: at 640 x 360 a unit is 0.7 pixels and the canvas 914 x 514 units.
class Canvas {
 public:
  Canvas(const FontAtlas& fonts, int pixel_width, int pixel_height);

  static float scale_for(int pixel_width, int pixel_height);  // pixels a unit
  static constexpr float text_size = 16, title_size = 25;     // line heights in units

  float width() const { return width_; }
  float height() const { return height_; }

  void rectangle(float x, float y, float w, float h, const Paint& paint);
  /// Colours run from bottom to top.
  void vertical_ramp(float x, float y, float w, float h, ColorMap map);
  void line(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float thickness, const Paint& paint);
  void curve(const std::vector<Eigen::Vector2f>& points, float thickness, const Paint& paint);
  /// (x, y): on the base line.
  void text(float x, float y, std::string_view utf8, const Paint& paint, Align align = Align::left,
            Face face = Face::text);
  float text_width(std::string_view utf8, Face face = Face::text) const;

  const std::vector<CanvasVertex>& vertices() const { return vertices_; }

 private:
  struct Corner {
    Eigen::Vector2f point, texture_point;
    Paint paint;
  };
  void quad(const Corner& a, const Corner& b, const Corner& c, const Corner& d, float brush);

  const FontAtlas& fonts_;
  float scale_, width_, height_;
  std::vector<CanvasVertex> vertices_;
};

}  // namespace penalty::render
