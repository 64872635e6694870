#include "render/canvas.h"

#include <algorithm>
#include <cmath>

namespace penalty::render {

float Canvas::scale_for(int pixel_width, int pixel_height) {
  const float lines = std::min(static_cast<float>(pixel_height), static_cast<float>(pixel_width) * 9 / 16);
  if (lines >= 720) return lines / 720;
  if (lines >= 360) return 0.7f + 0.3f * (lines - 360) / 360;
  return 0.7f * lines / 360;
}

Canvas::Canvas(const FontAtlas& fonts, int pixel_width, int pixel_height)
    : fonts_(fonts),
      scale_(scale_for(pixel_width, pixel_height)),
      width_(static_cast<float>(pixel_width) / scale_),
      height_(static_cast<float>(pixel_height) / scale_) {}

void Canvas::quad(const Corner& a, const Corner& b, const Corner& c, const Corner& d, float brush) {
  for (const Corner* corner : {&a, &b, &c, &a, &c, &d}) {
    const Corner& q = *corner;
    vertices_.push_back({{q.point.x(), q.point.y()},
                         {q.texture_point.x(), q.texture_point.y()},
                         {q.paint[0], q.paint[1], q.paint[2], q.paint[3]},
                         brush});
  }
}

void Canvas::rectangle(float x, float y, float w, float h, const Paint& paint) {
  // On whole pixels: a rectangle has no soft edges.
  const float x0 = std::round(x * scale_), y0 = std::round(y * scale_);
  const float x1 = std::max(x0 + 1, std::round((x + w) * scale_)), y1 = std::max(y0 + 1, std::round((y + h) * scale_));
  quad({{x0, y0}, {0, 0}, paint}, {{x1, y0}, {0, 0}, paint}, {{x1, y1}, {0, 0}, paint}, {{x0, y1}, {0, 0}, paint}, 0);
}

void Canvas::vertical_ramp(float x, float y, float w, float h, ColorMap map) {
  constexpr int bands = 64;
  const float x0 = std::round(x * scale_), x1 = std::round((x + w) * scale_);
  const float y0 = std::round(y * scale_), y1 = std::round((y + h) * scale_);
  for (int i = 0; i < bands; ++i) {
    const float low = static_cast<float>(i) / bands, high = static_cast<float>(i + 1) / bands;
    const float bottom = y1 - (y1 - y0) * low, top = y1 - (y1 - y0) * high;
    const Paint from = opaque(map_color(map, low)), to = opaque(map_color(map, high));
    quad({{x0, top}, {0, 0}, to}, {{x1, top}, {0, 0}, to}, {{x1, bottom}, {0, 0}, from}, {{x0, bottom}, {0, 0}, from},
         0);
  }
}

void Canvas::line(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float thickness, const Paint& paint) {
  curve({from, to}, thickness, paint);
}

void Canvas::curve(const std::vector<Eigen::Vector2f>& points, float thickness, const Paint& paint) {
  // Points closer than a pixel have no direction worth following.
  std::vector<Eigen::Vector2f> path;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2f p = points[i] * scale_;
    if (!path.empty() && (p - path.back()).norm() < 1.2f) {
      if (i + 1 == points.size() && path.size() > 1) path.back() = p;
      continue;
    }
    path.push_back(p);
  }
  if (path.size() < 2) return;
  // One strip, whose parts share their corners: overlapping parts would show as beads along the soft edge.
  const float half = std::max(0.5f, 0.5f * thickness * scale_), reach = half + 1;
  const auto normal = [&](std::size_t i) {
    const Eigen::Vector2f d = (path[i + 1] - path[i]).normalized();
    return Eigen::Vector2f(-d.y(), d.x());
  };
  std::vector<Eigen::Vector2f> side(path.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Eigen::Vector2f before = normal(i > 0 ? i - 1 : 0), after = normal(i + 1 < path.size() ? i : i - 1);
    const Eigen::Vector2f sum = before + after;
    side[i] = sum.squaredNorm() > 0.5f ? Eigen::Vector2f(2 * sum / sum.squaredNorm()) : after;
  }
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    quad({path[i] - reach * side[i], {half, -reach}, paint}, {path[i + 1] - reach * side[i + 1], {half, -reach}, paint},
         {path[i + 1] + reach * side[i + 1], {half, reach}, paint}, {path[i] + reach * side[i], {half, reach}, paint},
         2);
}

float Canvas::text_width(std::string_view utf8, Face face) const {
  float width = 0;
  for (const char32_t sign : decoded(utf8)) width += fonts_.glyph(face, sign).advance;
  return width / scale_;
}

void Canvas::text(float x, float y, std::string_view utf8, const Paint& paint, Align align, Face face) {
  if (align != Align::left) x -= text_width(utf8, face) * (align == Align::center ? 0.5f : 1.f);
  float pen = std::round(x * scale_);
  const float base = std::round(y * scale_);
  for (const char32_t sign : decoded(utf8)) {
    const Glyph& g = fonts_.glyph(face, sign);
    quad({{pen + g.x0, base + g.y0}, {g.s0, g.t0}, paint}, {{pen + g.x1, base + g.y0}, {g.s1, g.t0}, paint},
         {{pen + g.x1, base + g.y1}, {g.s1, g.t1}, paint}, {{pen + g.x0, base + g.y1}, {g.s0, g.t1}, paint}, 1);
    pen += g.advance;
  }
}

}  // namespace penalty::render
