#pragma once

/// Before a function with a hot loop: compiled for AVX2 as well, chosen at load time, where
/// compiler and system can do that. Neither version fuses multiplications and additions, so both
/// give the same numbers.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define SMOKE_GROUND_MULTIVERSION __attribute__((target_clones("avx2", "default")))
#else
#define SMOKE_GROUND_MULTIVERSION
#endif

/// Before a part of such a function: goes into each of its versions.
#if defined(__GNUC__)
#define SMOKE_GROUND_PART inline __attribute__((always_inline))
#else
#define SMOKE_GROUND_PART inline
#endif
