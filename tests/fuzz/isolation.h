// Trials in processes of their own: one that crashes or hangs is named, and the others go on.
#pragma once
#include <cstdint>
#include <functional>
#include <string>

namespace penalty::testing {

struct IsolationOptions {
  std::uint64_t first = 0, count = 1;
  double seconds = 0;          // no new trial after this; 0: no limit
  double cpu_seconds = 60;     // that a trial may take
  bool own_process = true;     // false: for a debugger
  std::string name = "trial";  // "seed": failures read "seed 7: ..."
};

struct IsolationResult {
  std::uint64_t done = 0, failed = 0;
};

/// Calls `trial` with the numbers first, first + 1, ... A trial fails if it throws, ends by a signal, exits or takes
/// too long; each failure is printed on standard error in one line. A child process takes trials one after another
/// until it dies, and what the leak checker says at its end counts as one more failure.
IsolationResult run_isolated(const IsolationOptions& options, const std::function<void(std::uint64_t)>& trial);

}  // namespace penalty::testing
