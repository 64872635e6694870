// When a body was recovered for good, and what that took.
#pragma once
#include <ctime>
#include <optional>

#include "study/study_case.h"

namespace penalty::study {

/// CPU time of the calling thread [s].
inline Real thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<Real>(now.tv_sec) + 1e-9 * static_cast<Real>(now.tv_nsec);
}

class RecoveryWatch {
 public:
  struct Moment {
    Real progress = 0;  // iterations or simulated time [s]
    Real cpu_seconds = 0;
  };

  /// In the order of `now`.
  void see(Real rest_error, const Moment& now) {
    if (!(rest_error < recovered_below))
      since_.reset();
    else if (!since_)
      since_ = now;
  }

  /// The first moment from which on every error was small; empty if the last one was not.
  const std::optional<Moment>& since() const { return since_; }

 private:
  std::optional<Moment> since_;
};

}  // namespace penalty::study
