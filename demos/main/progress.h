// How far a long piece of work is, on standard error.
#pragma once
#include <chrono>
#include <string>

namespace penalty::demo {

/// Says nothing about work that is done within two seconds. On a terminal a bar with the time left, redrawn in place;
/// elsewhere a plain line every ten seconds.
class Progress {
 public:
  Progress(std::string what, long total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance_to(long done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  long total_;
  bool terminal_, drawn_ = false;
  Clock::time_point start_, last_;
};

}  // namespace penalty::demo
