#include "render/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "render/ticks.h"

namespace penalty::render {
namespace {

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();

  void add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  /// A constant curve still needs an axis with two ends.
  void widen() {
    if (low < high) return;
    const double by = low == 0 ? 1 : 0.1 * std::abs(low);
    low -= by;
    high += by;
  }
};

std::string number(double v) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.2f", v);
  return buffer.data();
}

std::string hex(const Color& color) {
  std::array<char, 8> buffer{};
  const auto byte = [](float c) { return static_cast<int>(std::lround(255 * std::clamp(c, 0.f, 1.f))); };
  std::snprintf(buffer.data(), buffer.size(), "#%02x%02x%02x", byte(color[0]), byte(color[1]), byte(color[2]));
  return buffer.data();
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      default:
        result += c;
    }
  return result;
}

std::string text(double x, double y, const char* anchor, const std::string& content, const char* more = "") {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" +
         escaped(content) + "</text>\n";
}

std::string line(double x0, double y0, double x1, double y1, const char* color) {
  return "<line x1=\"" + number(x0) + "\" y1=\"" + number(y0) + "\" x2=\"" + number(x1) + "\" y2=\"" + number(y1) +
         "\" stroke=\"" + color + "\"/>\n";
}

}  // namespace

std::string svg(const Plot& plot) {
  if (plot.width < 160 || plot.height < 120) throw std::invalid_argument("plot: smaller than 160 x 120");
  Extent x, y;
  for (const Series& series : plot.series) {
    if (series.x.size() != series.y.size())
      throw std::invalid_argument("plot: series '" + series.name + "' has " + std::to_string(series.x.size()) +
                                  " x and " + std::to_string(series.y.size()) + " y");
    for (std::size_t i = 0; i < series.x.size(); ++i)
      if (std::isfinite(series.x[i]) && std::isfinite(series.y[i])) {
        x.add(series.x[i]);
        y.add(series.y[i]);
      }
  }
  if (!(x.low <= x.high)) throw std::invalid_argument("plot: no finite point in any series");
  x.widen();
  y.widen();
  // The y axis ends at ticks, so that no curve touches the frame.
  const double step = nice_step((y.high - y.low) / 6);
  y.low = step * std::floor(y.low / step + 1e-9);
  y.high = step * std::ceil(y.high / step - 1e-9);

  const double left = 70, right = plot.width - 20.0, top = plot.title.empty() ? 36 : 58, bottom = plot.height - 52.0;
  const auto px = [&](double v) { return left + (right - left) * (v - x.low) / (x.high - x.low); };
  const auto py = [&](double v) { return bottom - (bottom - top) * (v - y.low) / (y.high - y.low); };

  const std::string w = std::to_string(plot.width), h = std::to_string(plot.height);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h +
                    "\" viewBox=\"0 0 " + w + " " + h +
                    "\" font-family=\"DejaVu Sans, Verdana, sans-serif\" font-size=\"12\" fill=\"#21292f\">\n"
                    "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
  if (!plot.title.empty()) out += text(left, 24, "start", plot.title, " font-weight=\"bold\" font-size=\"15\"");
  for (const double tick : linear_ticks(y.low, y.high, 8)) {
    out += line(left, py(tick), right, py(tick), tick == 0 ? "#9aa3ab" : "#dfe3e7");
    out += text(left - 8, py(tick) + 4, "end", tick_label(tick));
  }
  for (const double tick : linear_ticks(x.low, x.high, 9)) {
    out += line(px(tick), bottom, px(tick), bottom + 5, "#60686f");
    out += text(px(tick), bottom + 19, "middle", tick_label(tick));
  }
  out += line(left, top, left, bottom, "#60686f") + line(left, bottom, right, bottom, "#60686f");
  out += text(0.5 * (left + right), plot.height - 12.0, "middle", plot.x_label);
  const double middle = 0.5 * (top + bottom);
  out += text(18, middle, "middle", plot.y_label, (" transform=\"rotate(-90 18 " + number(middle) + ")\"").c_str());

  double legend = right;
  for (auto series = plot.series.rbegin(); series != plot.series.rend(); ++series) {
    if (series->name.empty()) continue;
    out += "<g fill=\"" + hex(series->color) + "\">" + text(legend, top - 12, "end", series->name) + "</g>\n";
    legend -= 16 + 7.2 * static_cast<double>(series->name.size());
  }
  for (const Series& series : plot.series) {
    std::string points;
    const auto flush = [&] {
      if (!points.empty())
        out += "<polyline fill=\"none\" stroke=\"" + hex(series.color) +
               "\" stroke-width=\"1.8\" stroke-linejoin=\"round\" points=\"" + points + "\"/>\n";
      points.clear();
    };
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (std::isfinite(series.x[i]) && std::isfinite(series.y[i]))
        points.append(points.empty() ? "" : " ").append(number(px(series.x[i])) + "," + number(py(series.y[i])));
      else
        flush();
    }
    flush();
  }
  return out + "</svg>\n";
}

void write_svg(const std::filesystem::path& path, const Plot& plot) {
  const std::string content = svg(plot);
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.flush();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace penalty::render
