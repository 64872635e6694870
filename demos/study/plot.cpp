#include "study/plot.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "main/usage_error.h"
#include "render/canvas.h"
#include "render/rasterize.h"
#include "render/renderer.h"
#include "study/suites.h"

namespace penalty::study {
namespace {

using render::Align;
using render::Canvas;
using render::Paint;

const Paint ink{0.13f, 0.16f, 0.20f, 1}, faint_ink{0.13f, 0.16f, 0.20f, 0.62f}, grid{0.13f, 0.16f, 0.20f, 0.14f};
constexpr int picture_width = 1600, usual_height = 900, most_height = 20000;  // [pixels]
constexpr float margin = 36, head = 112, row_height = 27, heading_height = 44, foot = 64;
constexpr float counts_width = 210;  // the column of numbers on the right

/// What the picture says in one row: all starts of a run, a material and a mesh.
struct PlotRow {
  std::string suite, run, material, mesh;
  int runs = 0, recovered = 0;              // from random starts
  int exact_runs = 0, exact_recovered = 0;  // from those that no seed decides
};

std::vector<PlotRow> plot_rows(const std::vector<TableRow>& rows) {
  std::vector<PlotRow> result;
  for (const TableRow& row : rows) {
    const StudyCase& c = row.which;
    const std::string mesh = c.mesh + " (" + std::to_string(row.tetrahedra) + ")";
    const bool same = !result.empty() && result.back().suite == c.suite && result.back().run == c.run() &&
                      result.back().material == c.material && result.back().mesh == mesh;
    if (!same) result.push_back({c.suite, c.run(), c.material, mesh});
    const bool random = is_random(c.start);
    (random ? result.back().runs : result.back().exact_runs) += row.runs;
    (random ? result.back().recovered : result.back().exact_recovered) += row.recovered;
  }
  return result;
}

std::size_t num_suites(const std::vector<PlotRow>& rows) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) count += k == 0 || rows[k].suite != rows[k - 1].suite;
  return count;
}

struct Columns {
  float material, mesh, run, left, right, counts;  // left to right: the axis

  Columns(const Canvas& canvas, const std::vector<PlotRow>& rows) {
    float widest_material = 0, widest_mesh = 0, widest_run = 0;
    for (const PlotRow& row : rows) {
      widest_material = std::max(widest_material, canvas.text_width(row.material));
      widest_mesh = std::max(widest_mesh, canvas.text_width(row.mesh));
      widest_run = std::max(widest_run, canvas.text_width(row.run));
    }
    material = margin;
    mesh = material + widest_material + 24;
    run = mesh + widest_mesh + 24;
    left = run + widest_run + 36;
    counts = canvas.width() - margin - counts_width;
    right = counts - 36;
  }
  float at(Real share) const { return left + static_cast<float>(share) * (right - left); }
};

void draw_axis(Canvas& canvas, const Columns& columns, float top, float bottom) {
  for (int tenth = 0; tenth <= 10; tenth += 2) {
    const float x = columns.at(tenth / 10.0);
    canvas.line({x, top}, {x, bottom}, tenth == 0 ? 1.5f : 1.f, tenth == 0 ? faint_ink : grid);
    canvas.text(x, bottom + 22, std::to_string(10 * tenth), faint_ink, Align::center);
  }
  canvas.text((columns.left + columns.right) / 2, bottom + 46, "recovered [%]", ink, Align::center);
}

/// The rate as a dot on a bar that is its interval.
void draw_rate(Canvas& canvas, const Columns& columns, float y, const PlotRow& row, const Paint& color) {
  const Interval rate = wilson_interval(row.recovered, row.runs);
  const float low = columns.at(rate.low), high = columns.at(rate.high);
  canvas.line({low, y}, {high, y}, 2.5f, color);
  for (const float x : {low, high}) canvas.line({x, y - 5}, {x, y + 5}, 2.5f, color);
  // A line as long as it is thick, with soft sides: a square dot.
  const float dot = columns.at(static_cast<Real>(row.recovered) / row.runs);
  canvas.line({dot - 5, y}, {dot + 5, y}, 10, color);
}

void draw_row(Canvas& canvas, const Columns& columns, float y, const PlotRow& row) {
  const float base = y + 5.5f;
  canvas.text(columns.material, base, row.material, ink);
  canvas.text(columns.mesh, base, row.mesh, ink);
  canvas.text(columns.run, base, row.run, faint_ink);
  const int color = row.run.starts_with("static") ? 0 : row.run.starts_with("classic") ? 3 : 1;
  if (row.runs > 0) draw_rate(canvas, columns, y, row, render::opaque(render::palette(color)));
  const auto share = [](int recovered, int runs) {
    return runs > 0 ? std::to_string(recovered) + "/" + std::to_string(runs) : std::string("\u2013");
  };
  canvas.text(columns.counts + 0.45f * counts_width, base, share(row.recovered, row.runs), ink, Align::right);
  canvas.text(columns.counts + counts_width, base, share(row.exact_recovered, row.exact_runs), ink, Align::right);
}

void draw(Canvas& canvas, const std::vector<PlotRow>& rows) {
  const Columns columns(canvas, rows);
  canvas.text(margin, 48, "Recovery from hard starts", ink, Align::left, render::Face::title);
  canvas.text(margin, 76, "Bars: 95 % interval (Wilson) of the rate from random starts, each with its own seed",
              faint_ink);
  canvas.text(columns.counts + 0.45f * counts_width, head - 6, "random", faint_ink, Align::right);
  canvas.text(columns.counts + counts_width, head - 6, "exact", faint_ink, Align::right);
  float y = head;
  for (std::size_t k = 0; k < rows.size();) {
    canvas.text(margin, y + 30, "Suite " + rows[k].suite, ink, Align::left, render::Face::title);
    y += heading_height;
    for (const std::string suite = rows[k].suite; k < rows.size() && rows[k].suite == suite; ++k, y += row_height)
      draw_row(canvas, columns, y + row_height / 2, rows[k]);
  }
  draw_axis(canvas, columns, head + 6, y + 6);
}

}  // namespace

void write_rate_plot(const std::filesystem::path& path, const std::vector<TableRow>& table) {
  if (path.extension() != ".png") throw std::invalid_argument(path.string() + " does not end in .png");
  const std::vector<PlotRow> rows = plot_rows(table);
  if (rows.empty()) throw demo::UsageError("no results to draw");
  const float units = head + heading_height * static_cast<float>(num_suites(rows)) +
                      row_height * static_cast<float>(rows.size()) + foot;
  // A canvas shrinks with a low picture: one of the usual height or more does not, and what is too much of it is cut
  // off.
  const float scale = Canvas::scale_for(picture_width, usual_height), lines = std::ceil(units * scale);
  if (lines > most_height) throw std::invalid_argument("too many rows to draw: " + std::to_string(rows.size()));
  const int height = static_cast<int>(lines);
  render::Image image(picture_width, std::max(usual_height, height));
  std::fill(image.rgb.begin(), image.rgb.end(), std::uint8_t{255});
  const render::FontAtlas fonts(render::RendererOptions{}.font_directory, Canvas::text_size * scale,
                                Canvas::title_size * scale);
  Canvas canvas(fonts, image.width, image.height);
  draw(canvas, rows);
  render::rasterize(canvas, fonts, image);
  image.height = height;
  image.rgb.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(height));
  render::write_png(path, image);
}

}  // namespace penalty::study
