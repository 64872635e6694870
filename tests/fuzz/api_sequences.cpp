// Random sequences of calls, legal and not, in both worlds: see Sequence.
//
//   api_sequences [--seed N] [--count N] [--seconds S] [--log]
//
// Runs --count of them (one, unless told), and begins none after --seconds, if these are given. Each has a seed of its
// own, from --seed on. A failure prints its seed; `--seed N --log` repeats it in this process and prints every call. The
// status is 0 if nothing was found, 1 if something was, 2 for arguments that make no sense.
#include "fuzz/sequence.h"

#include <iostream>

#include "fuzz/arguments.h"
#include "fuzz/isolation.h"

int main(int argc, char** argv) {
  using namespace penalty::testing;
  const auto arguments = read_arguments(argc, argv, {{"--seed", 1}, {"--count", 1}, {"--seconds", 0}, {"--log", 0}},
                                        "usage: api_sequences [--seed N] [--count N] [--seconds S] [--log]");
  if (!arguments) return 2;
  const bool log = arguments->at("--log") != 0;
  const IsolationResult result = run_isolated({.first = static_cast<std::uint64_t>(arguments->at("--seed")),
                                               .count = static_cast<std::uint64_t>(arguments->at("--count")),
                                               .seconds = arguments->at("--seconds"),
                                               .own_process = !log,
                                               .name = "seed"},
                                              [log](std::uint64_t number) { Sequence(number, log).run(); });
  std::cout << "api_sequences: " << result.done << " sequences, " << result.failed << " failed\n";
  return result.failed == 0 ? 0 : 1;
}
