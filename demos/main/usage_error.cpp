#include "main/usage_error.h"

namespace penalty::demo {

std::string one_line(std::string what) {
  while (!what.empty() && what.back() == '\n') what.pop_back();
  for (char& c : what)
    if (c == '\n' || c == '\r') c = ' ';
  return what;
}

}  // namespace penalty::demo
