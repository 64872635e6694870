#include "fuzz/isolation.h"

#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <stdexcept>

namespace penalty::testing {
namespace {

using Clock = std::chrono::steady_clock;

/// What a child tells its parent, in memory of both.
struct Progress {
  std::uint64_t next, failed;
  bool in_trial;
};

void limit_cpu(double seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>((seconds - static_cast<double>(timer.it_value.tv_sec)) * 1e6);
  setitimer(ITIMER_PROF, &timer, nullptr);  // its signal ends the process
}

void report(const IsolationOptions& options, std::uint64_t number, const std::string& what) {
  std::cerr << options.name << ' ' << number << ": " << what << '\n';
}

std::string death(int status) {
  if (!WIFSIGNALED(status)) return "ended the process with status " + std::to_string(WEXITSTATUS(status));
  if (WTERMSIG(status) == SIGPROF) return "took too long";
  return std::string("ended by a signal: ") + strsignal(WTERMSIG(status));
}

/// Takes trials until they are done or time is up.
void take_trials(const IsolationOptions& options, const std::function<void(std::uint64_t)>& trial, Progress& progress,
                 Clock::time_point deadline) {
  while (progress.next < options.first + options.count && Clock::now() < deadline) {
    progress.in_trial = true;
    if (options.own_process) limit_cpu(options.cpu_seconds);
    try {
      trial(progress.next);
    } catch (const std::exception& error) {
      ++progress.failed;
      report(options, progress.next, error.what());
    }
    progress.in_trial = false;
    ++progress.next;
  }
  limit_cpu(0);
}

}  // namespace

IsolationResult run_isolated(const IsolationOptions& options, const std::function<void(std::uint64_t)>& trial) {
  void* shared = mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw std::bad_alloc();
  auto& progress = *new (shared) Progress{options.first, 0, false};
  const auto deadline =
      options.seconds > 0
          ? Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds))
          : Clock::time_point::max();
  while (progress.next < options.first + options.count && Clock::now() < deadline) {
    if (!options.own_process) {
      take_trials(options, trial, progress, deadline);
      break;
    }
    const std::uint64_t begun = progress.next;
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("fork failed");
    if (child == 0) {
      take_trials(options, trial, progress, deadline);
      std::exit(0);  // past the leak checker
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (progress.in_trial) {
      report(options, progress.next, death(status));
      ++progress.failed;
      ++progress.next;
      progress.in_trial = false;
    } else if (status != 0) {
      report(options, begun,
             "or one of those up to " + std::to_string(progress.next - 1) + " leaked: " + death(status));
      ++progress.failed;
    }
  }
  const IsolationResult result{progress.next - options.first, progress.failed};
  munmap(shared, sizeof(Progress));
  return result;
}

}  // namespace penalty::testing
