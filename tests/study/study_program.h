// penalty-study as a user runs it.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>

#include "demos/program.h"

namespace penalty::test {

inline Outcome run_study(const std::vector<std::string>& arguments) { return run_program(PENALTY_STUDY, arguments); }

/// Standard output of a run that must succeed.
inline std::string output_of(const std::vector<std::string>& arguments) {
  const Outcome outcome = run_study(arguments);
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  return outcome.output;
}

inline void expect_error(const Outcome& outcome, int status, const std::string& mentions) {
  EXPECT_EQ(outcome.status, status) << outcome.errors;
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
  EXPECT_TRUE(outcome.errors.starts_with("penalty-study: ")) << outcome.errors;
  EXPECT_NE(outcome.errors.find(mentions), std::string::npos) << "\"" << mentions << "\" is not in: " << outcome.errors;
  EXPECT_EQ(outcome.output, "");
}

}  // namespace penalty::test
