#include "main/progress.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace penalty::demo {

using Seconds = std::chrono::duration<double>;

Progress::Progress(std::string what, long total)
    : what_(std::move(what)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      last_(start_) {}

Progress::~Progress() {
  if (terminal_ && drawn_) std::fputs("\r\033[K", stderr);
}

void Progress::advance_to(long done) {
  const auto now = Clock::now();
  const double elapsed = Seconds(now - start_).count(), since = Seconds(now - last_).count();
  if (done <= 0 || since < (terminal_ ? 0.1 : 10)) return;
  const double share = static_cast<double>(done) / static_cast<double>(total_), left = elapsed / share - elapsed;
  if (elapsed + left < 2 || (elapsed < 0.5 && !drawn_)) return;
  last_ = now;
  const auto seconds_left = std::lround(left);
  char time[32];
  std::snprintf(time, sizeof time, "%ld:%02ld", seconds_left / 60, seconds_left % 60);
  if (terminal_) {
    constexpr int width = 32;
    std::string bar(width, '.');
    for (int i = 0; i < static_cast<int>(share * width); ++i) bar[i] = '#';
    std::fprintf(stderr, "\r\033[K%s [%s] %3.0f %%, %s left", what_.c_str(), bar.c_str(), 100 * share, time);
  } else {
    std::fprintf(stderr, "%s: %3.0f %%, %s left\n", what_.c_str(), 100 * share, time);
  }
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace penalty::demo
