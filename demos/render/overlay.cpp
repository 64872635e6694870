#include "render/overlay.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/ticks.h"

namespace penalty::render {
namespace {

const Paint ink{0.13f, 0.16f, 0.20f, 1}, faint_ink{0.13f, 0.16f, 0.20f, 0.76f}, card{1, 1, 1, 0.55f};
constexpr float margin = 36;

void draw_title(Canvas& canvas, const Overlay& overlay) {
  float y = 54;
  if (!overlay.title.empty()) canvas.text(margin, y, overlay.title, ink, Align::left, Face::title);
  if (!overlay.title.empty()) y += 26;
  // As many parts a line as fit.
  const float room = canvas.width() - 2 * margin;
  std::string line;
  const auto flush = [&] {
    if (line.empty()) return;
    canvas.text(margin + 1, y, line, faint_ink);
    y += 22;
    line.clear();
  };
  for (const std::string& part : overlay.subtitle) {
    const std::string longer = line.empty() ? part : line + "   \u00b7   " + part;
    if (!line.empty() && canvas.text_width(longer) > room) {
      flush();
      line = part;
    } else {
      line = longer;
    }
  }
  flush();
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  }
  return lines;
}

void draw_color_bar(Canvas& canvas, const ColorBar& bar, const ColorScale& colors) {
  if (!(bar.unit > 0) || !std::isfinite(bar.unit)) throw std::invalid_argument("colour bar: the unit must be positive");
  const float width = 18, height = std::min(300.f, 0.42f * canvas.height());
  const float x = canvas.width() - 56 - width, y = 0.5f * (canvas.height() - height);
  canvas.rectangle(x - 1, y - 1, width + 2, height + 2, {0.10f, 0.12f, 0.15f, 0.8f});
  canvas.vertical_ramp(x, y, width, height, colors.map);
  // Ticks of the labelled numbers, so that they are round in the unit shown.
  const auto place = [&](double value) { return colors.position(value * bar.unit); };
  for (const double tick :
       scale_ticks(colors.low / bar.unit, colors.high / bar.unit, 26.0 / height, !colors.square_root, place)) {
    const float at = y + height * (1 - static_cast<float>(place(tick)));
    canvas.line({x - 6, at}, {x, at}, 1.2f, ink);
    canvas.text(x - 11, at + 5, tick_label(tick), ink, Align::right);
  }
  const std::vector<std::string> lines = lines_of(bar.label);
  for (std::size_t i = 0; i < lines.size(); ++i)
    canvas.text(x + width, y - 20 - 20 * static_cast<float>(lines.size() - 1 - i), lines[i], ink, Align::right);
}

/// Rounded outwards to whole steps.
struct VerticalRange {
  double low = 0, high = 0, step = 1;

  explicit VerticalRange(const Inset& inset) : low(inset.y_low), high(inset.y_high) {
    if (!(low < high)) {
      low = high = 0;  // always shown: energies are judged by their distance to it
      for (const Series& series : inset.series)
        for (const double y : series.y)
          if (std::isfinite(y)) {
            low = std::min(low, y);
            high = std::max(high, y);
          }
      if (!(low < high)) high = 1;
    }
    step = nice_step((high - low) / 3.5);
    low = step * std::floor(low / step + 1e-6);
    high = step * std::ceil(high / step - 1e-6);
  }
};

void draw_inset(Canvas& canvas, const Inset& inset) {
  if (!(inset.x_low < inset.x_high)) throw std::invalid_argument("inset: x_low must lie below x_high");
  const VerticalRange range(inset);
  const std::vector<double> ticks = linear_ticks(range.low, range.high, 6);
  float label_width = 0;
  for (const double tick : ticks) label_width = std::max(label_width, canvas.text_width(tick_label(tick)));

  // The names share the title's line if they fit there, else they get their own.
  float names_width = 0;
  for (const Series& series : inset.series) names_width += canvas.text_width(series.name) + 20;
  const float gutter = std::max(28.f, label_width + 10);
  const float width = std::min(262.f, 0.205f * canvas.width());
  const float height = 100 * std::clamp(canvas.height() / 720, 0.72f, 1.f);
  const bool own_line = canvas.text_width(inset.title) + names_width > width + gutter;
  const float head = own_line ? 62 : 40, foot = 30;
  const float x = margin + gutter + 10, y = canvas.height() - 20 - foot - height;
  canvas.rectangle(margin, y - head, gutter + 10 + width + 18, head + height + foot, card);
  canvas.text(margin + 12, y - head + 24, inset.title, ink);
  float name_x = x + width;
  for (auto series = inset.series.rbegin(); series != inset.series.rend(); ++series) {
    canvas.text(name_x, y - 16, series->name, opaque(series->color), Align::right);
    name_x -= canvas.text_width(series->name) + 20;
  }

  const auto px = [&](double v) {
    return x + width * static_cast<float>((v - inset.x_low) / (inset.x_high - inset.x_low));
  };
  const auto py = [&](double v) {
    return y + height * static_cast<float>((range.high - v) / (range.high - range.low));
  };
  for (const double tick : ticks) {
    canvas.rectangle(x, py(tick) - 0.5f, width, 1, {0.10f, 0.12f, 0.15f, tick == 0 ? 0.34f : 0.18f});
    canvas.text(x - 6, py(tick) + 5, tick_label(tick), faint_ink, Align::right);
  }
  canvas.text(x, y + height + 20, tick_label(inset.x_low), faint_ink, Align::center);
  canvas.text(x + width, y + height + 20, tick_label(inset.x_high) + " " + inset.x_unit, faint_ink, Align::right);
  for (const Series& series : inset.series) {
    if (series.x.size() != series.y.size())
      throw std::invalid_argument("inset: series '" + series.name + "' has " + std::to_string(series.x.size()) +
                                  " x and " + std::to_string(series.y.size()) + " y");
    std::vector<Eigen::Vector2f> points;
    for (std::size_t i = 0; i <= series.x.size(); ++i) {
      const bool point = i < series.x.size() && std::isfinite(series.x[i]) && std::isfinite(series.y[i]);
      if (point) {
        // Kept on the card even where a caller's range is too small.
        points.push_back(
            {std::clamp(px(series.x[i]), x, x + width), std::clamp(py(series.y[i]), y - 6, y + height + 6)});
      } else {
        canvas.curve(points, 2.2f, opaque(series.color));
        points.clear();
      }
    }
  }
}

}  // namespace

void draw_overlay(Canvas& canvas, const Overlay& overlay, const ColorScale& colors) {
  draw_title(canvas, overlay);
  if (overlay.color_bar) draw_color_bar(canvas, *overlay.color_bar, colors);
  if (overlay.inset) draw_inset(canvas, *overlay.inset);
}

}  // namespace penalty::render
