#include "render/ticks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace penalty::render {
namespace {

void require_range(double low, double high, const char* who) {
  if (!(std::isfinite(low) && std::isfinite(high) && low < high))
    throw std::invalid_argument(std::string(who) + ": low must lie below high, both finite");
}

}  // namespace

double nice_step(double at_least) {
  if (!(at_least > 0) || !std::isfinite(at_least)) throw std::invalid_argument("nice_step: must be positive");
  const double decade = std::pow(10.0, std::floor(std::log10(at_least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * decade >= at_least * (1 - 1e-9)) return factor * decade;
  return 10 * decade;
}

std::vector<double> linear_ticks(double low, double high, int most) {
  require_range(low, high, "linear_ticks");
  if (most < 2) throw std::invalid_argument("linear_ticks: most must be 2 or more");
  const double slack = 1e-9 * (high - low);
  for (double step = nice_step((high - low) / most);; step = nice_step(1.5 * step)) {
    std::vector<double> ticks;
    const double first = std::ceil((low - slack) / step);
    // Counted in whole steps, so that zero is zero and rounding does not add up.
    for (double k = first; k * step <= high + slack && static_cast<int>(ticks.size()) <= most; ++k)
      ticks.push_back(k == 0 ? 0 : k * step);
    if (static_cast<int>(ticks.size()) <= most) return ticks;
  }
}

std::vector<double> scale_ticks(double low, double high, double least_gap, bool linear,
                                const std::function<double(double)>& position) {
  require_range(low, high, "scale_ticks");
  if (!(least_gap > 0)) throw std::invalid_argument("scale_ticks: least_gap must be positive");
  std::vector<double> ticks{low, high};
  const auto offer = [&](double value) {
    if (!(value > low && value < high)) return;
    for (const double tick : ticks)
      if (std::abs(position(value) - position(tick)) < least_gap) return;
    ticks.push_back(value);
  };
  // The roundest come first: they are the ones to keep where it gets crowded.
  offer(0);
  if (linear) {
    for (const double tick : linear_ticks(low, high, std::max(2, static_cast<int>(0.75 / least_gap)))) offer(tick);
    std::sort(ticks.begin(), ticks.end());
    return ticks;
  }
  const double largest = std::max(std::abs(low), std::abs(high));
  const int top = static_cast<int>(std::floor(std::log10(largest)));
  for (const double factor : {1.0, 5.0, 2.0})
    for (int decade = top; decade > top - 6; --decade)
      for (const double sign : {1.0, -1.0}) offer(sign * factor * std::pow(10.0, decade));
  std::sort(ticks.begin(), ticks.end());
  return ticks;
}

std::string tick_label(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.4g", value == 0 ? 0.0 : value);
  std::string label = buffer.data();
  // printf writes 1e-07 and 1e+07; plots write 1e-7 and 1e7.
  if (const auto e = label.find('e'); e != std::string::npos) {
    const bool negative = label[e + 1] == '-';
    const auto digits = label.find_first_not_of('0', e + 2);
    label = label.substr(0, e + 1) + (negative ? "-" : "") + label.substr(digits);
  }
  return label;
}

}  // namespace penalty::render
