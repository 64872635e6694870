// penalty-demo as a user runs it.
#pragma once
#include "program.h"

namespace penalty::test {

inline Outcome run_demo(const std::vector<std::string>& arguments, const std::string& environment = "") {
  return run_program(PENALTY_DEMO, arguments, environment);
}

}  // namespace penalty::test
