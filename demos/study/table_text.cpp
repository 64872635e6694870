#include <algorithm>
#include <array>
#include <cstdio>

#include "study/table.h"

namespace penalty::study {
namespace {

using Line = std::vector<std::string>;

std::string text(const char* format, Real value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

std::string text(const char* format, const std::optional<Real>& value) { return value ? text(format, *value) : "-"; }

std::string per_cent(Real share) { return text("%.1f", 100 * share); }

Line line_of(const TableRow& row, bool times) {
  const StudyCase& c = row.which;
  const bool is_static = c.is_static();
  const char* unit = is_static ? "%.4g it" : "%.2f s";
  Line line{c.run(),
            c.material,
            c.mesh + " (" + std::to_string(row.tetrahedra) + ")",
            c.start,
            std::to_string(row.recovered) + "/" + std::to_string(row.runs),
            per_cent(static_cast<Real>(row.recovered) / row.runs),
            per_cent(row.rate.low) + " to " + per_cent(row.rate.high),
            text(unit, row.median_to_recover),
            text(unit, row.largest_to_recover),
            text("%.1e", row.largest_error)};
  if (times) {
    line.push_back(text("%.3g s", row.median_cpu));
    line.push_back(text("%.3g s", row.largest_cpu));
  }
  return line;
}

constexpr std::size_t num_names = 4;  // columns of words, which stand on the left; numbers on the right

std::string aligned(const std::vector<Line>& lines) {
  std::vector<std::size_t> widths(lines.front().size());
  for (const Line& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) widths[k] = std::max(widths[k], line[k].size());
  std::string result;
  for (const Line& line : lines) {
    for (std::size_t k = 0; k < line.size(); ++k) {
      const std::string space(widths[k] - line[k].size(), ' ');
      if (k > 0) result += "  ";
      result += k < num_names ? line[k] + space : space + line[k];
    }
    result += '\n';
  }
  return result;
}

}  // namespace

std::string table_text(const std::vector<TableRow>& rows, bool times) {
  std::string result;
  for (std::size_t begin = 0, end; begin < rows.size(); begin = end) {
    const std::string& suite = rows[begin].which.suite;
    Line head{"method", "material",      "mesh (tets)", "start",   "recovered",
              "%",      "95 % interval", "median",      "largest", "error"};
    if (times) head.insert(head.end(), {"median CPU", "largest CPU"});
    std::vector<Line> lines{head};
    for (end = begin; end < rows.size() && rows[end].which.suite == suite; ++end)
      lines.push_back(line_of(rows[end], times));
    if (begin > 0) result += '\n';
    result += "suite " + suite + "\n" + aligned(lines);
  }
  return result;
}

}  // namespace penalty::study
