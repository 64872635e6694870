// What these tests look for.
#pragma once
#include <stdexcept>
#include <string>

namespace penalty::testing {

/// A promise of the library that was broken; what() says which.
class Finding : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline void require(bool kept, const std::string& broken) {
  if (!kept) throw Finding(broken);
}

}  // namespace penalty::testing
