#include "study/run_suite.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include "study/run_case.h"

namespace penalty::study {

void run_suite(const std::vector<StudyCase>& cases, const StudyMeshes& meshes, int jobs,
               const std::function<void(const StudyResult&)>& hand_over) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t k; (k = next++) < cases.size();) try {
        const StudyResult result = run_case(cases[k], meshes.at(cases[k].mesh));
        const std::lock_guard lock(mutex);
        if (!failure) hand_over(result);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = cases.size();
      }
  };
  {
    std::vector<std::jthread> threads;
    threads.reserve(static_cast<std::size_t>(jobs));
    for (int job = 0; job < jobs; ++job) threads.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace penalty::study
