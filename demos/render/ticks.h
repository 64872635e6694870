// Ticks at 1, 2 and 5 times powers of ten.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace penalty::render {

/// The smallest of 1, 2, 5 x 10^k that is not below `at_least` (> 0).
double nice_step(double at_least);

/// Multiples of one step of 1, 2 or 5 x 10^k inside [low, high], at most `most` of them and, where that allows it, at
/// least two. Throws std::invalid_argument unless low < high, both finite, and most >= 2.
std::vector<double> linear_ticks(double low, double high, int most);

/// For a colour bar: both ends, and between them the rounder numbers, no two closer than `least_gap` on the scale that
/// `position` gives (0 to 1, rising). Multiples of one step if the scale is `linear`, else 0 and +-1, 2, 5 x 10^k.
/// Throws like linear_ticks.
std::vector<double> scale_ticks(double low, double high, double least_gap, bool linear,
                                const std::function<double(double)>& position);

/// Short: "0.05", "2500", "1e-7".
std::string tick_label(double value);

}  // namespace penalty::render
