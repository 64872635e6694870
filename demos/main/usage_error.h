// How a program says that it cannot do what it was told.
#pragma once
#include <stdexcept>
#include <string>

namespace penalty::demo {

/// What the user asked for cannot be had: status 2. what() is one line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// `what` without line breaks, so that an error stays one line.
std::string one_line(std::string what);

}  // namespace penalty::demo
