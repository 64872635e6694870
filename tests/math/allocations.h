// Counts every allocation of a program. Include it in one source file of the program: it replaces malloc there.
#pragma once
#include <atomic>
#include <cstdlib>
#include <new>

#include "math/sanitizers.h"

static std::atomic<long> num_allocations{0};

#if defined(__GLIBC__) && !defined(PENALTY_TEST_SANITIZED)
// Eigen calls malloc itself, and operator new ends there too.
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT: glibc's name
extern "C" void* malloc(std::size_t size) noexcept {
  ++num_allocations;
  return __libc_malloc(size);
}
#else
void* operator new(std::size_t size) {
  ++num_allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++num_allocations;
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif
