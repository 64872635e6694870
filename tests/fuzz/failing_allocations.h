// Lets the n-th allocation of a program fail. Include it in one source file of the program: it replaces operator new
// there, and, without an address sanitizer, the malloc that Eigen calls. What libraries allocate that are linked
// dynamically, Bullet among them, never fails: they do not know what to do then.
#pragma once
#include <cstdlib>
#include <new>

#include "math/sanitizers.h"

namespace penalty::testing {

class FailingAllocations {
 public:
  /// From now on allocation number `n`, counted from 0, fails, once; -1: none does.
  static void fail(long n) {
    countdown_ = n;
    counted_ = 0;
    counts_ = true;
  }
  /// Ends it; returns how many allocations there were.
  static long stop() {
    counts_ = false;
    return counted_;
  }
  /// Blocks of operator new that are not deleted.
  static long live() { return live_; }

  static bool fails() {
    if (!counts_) return false;
    ++counted_;
    return countdown_-- == 0;
  }
  static void count_live(long change) { live_ += change; }

 private:
  static inline long countdown_ = -1, counted_ = 0, live_ = 0;
  static inline bool counts_ = false;
};

}  // namespace penalty::testing

#if defined(__GLIBC__) && !defined(PENALTY_TEST_SANITIZED)
extern "C" {
void* __libc_malloc(std::size_t size);                 // NOLINT: glibc's name
void* __libc_realloc(void* memory, std::size_t size);  // NOLINT
extern const char __executable_start, etext;           // NOLINT: the linker's names

inline bool penalty_is_ours(const void* caller) { return caller >= &__executable_start && caller < &etext; }

void* malloc(std::size_t size) noexcept {
  if (penalty_is_ours(__builtin_return_address(0)) && penalty::testing::FailingAllocations::fails()) return nullptr;
  return __libc_malloc(size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  if (penalty_is_ours(__builtin_return_address(0)) && penalty::testing::FailingAllocations::fails()) return nullptr;
  return __libc_realloc(memory, size);
}
}
inline void* penalty_plain_malloc(std::size_t size) { return __libc_malloc(size); }
#else
inline void* penalty_plain_malloc(std::size_t size) { return std::malloc(size); }
#endif

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  if (penalty::testing::FailingAllocations::fails()) return nullptr;
  void* memory = penalty_plain_malloc(size == 0 ? 1 : size);
  if (memory) penalty::testing::FailingAllocations::count_live(1);
  return memory;
}
void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete(void* memory) noexcept {
  if (memory) penalty::testing::FailingAllocations::count_live(-1);
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
void operator delete[](void* memory) noexcept { operator delete(memory); }
void operator delete[](void* memory, std::size_t) noexcept { operator delete(memory); }
