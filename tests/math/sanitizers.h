// PENALTY_TEST_SANITIZED: the program is built with a sanitizer that brings an allocator of its own.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PENALTY_TEST_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PENALTY_TEST_SANITIZED
#endif
#endif
