// Numbers for people. Files for machines have all the digits.
#pragma once
#include <string>

namespace penalty::demo {

/// Four significant digits: "14.39", "0.00012", "3.2e-09", "nan".
std::string readable(double value);

}  // namespace penalty::demo
