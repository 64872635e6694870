// What is compiled for newer processors than the oldest of their kind, too.
#pragma once

// Before a function that GCC is to compile twice, of which the loader picks: fused multiply-add and three-operand
// instructions are worth a fifth of the time. Elsewhere there is only the plain one.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define PENALTY_TARGET_CLONES [[gnu::target_clones("arch=x86-64-v3", "default")]]
#else
#define PENALTY_TARGET_CLONES
#endif

// Around functions for processors with AVX2, which whoever calls them has asked for: see rows::are_supported.
#if defined(__x86_64__) && defined(__GNUC__)
#define PENALTY_HAS_AVX2
#ifdef __clang__
#define PENALTY_BEGIN_AVX2 _Pragma("clang attribute push(__attribute__((target(\"avx2,fma\"))), apply_to = function)")
#define PENALTY_END_AVX2 _Pragma("clang attribute pop")
#else
#define PENALTY_BEGIN_AVX2 _Pragma("GCC push_options") _Pragma("GCC target(\"avx2,fma\")")
#define PENALTY_END_AVX2 _Pragma("GCC pop_options")
#endif
#endif
