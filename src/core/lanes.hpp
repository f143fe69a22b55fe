#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

// Eight numbers worked on together, in vectors of the compiler: AVX's, or two of SSE's or NEON's.
// Inside functions of SMOKE_GROUND_MULTIVERSION alone, and in parts of them.

constexpr std::uint32_t kLanes = 8;
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Ints =
    std::int32_t __attribute__((vector_size(4 * kLanes)));  ///< -1 where a comparison holds
using Shorts = std::int16_t __attribute__((vector_size(2 * kLanes)));
using Bytes = std::int8_t __attribute__((vector_size(kLanes)));

/// Sixteen short numbers.
constexpr std::uint32_t kManyLanes = 16;
using ManyShorts = std::int16_t __attribute__((vector_size(2 * kManyLanes)));

/// Four numbers of double precision: AVX's, or two of SSE's or NEON's.
using FourDoubles = double __attribute__((vector_size(32)));

/// What SSE and NEON work on at once; of any processor.
using FourFloats = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));
constexpr std::size_t kFour = 4;

#if defined(__clang__)
#define SMOKE_GROUND_SHUFFLED(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#else
#define SMOKE_GROUND_SHUFFLED(a, b, i, j, k, l) __builtin_shuffle(a, b, FourInts{i, j, k, l})
#endif

/// Rows to columns.
inline std::array<FourFloats, 4> transposed(const FourFloats& a, const FourFloats& b,
                                            const FourFloats& c, const FourFloats& d) {
  const FourFloats ab_low = SMOKE_GROUND_SHUFFLED(a, b, 0, 4, 1, 5);
  const FourFloats ab_high = SMOKE_GROUND_SHUFFLED(a, b, 2, 6, 3, 7);
  const FourFloats cd_low = SMOKE_GROUND_SHUFFLED(c, d, 0, 4, 1, 5);
  const FourFloats cd_high = SMOKE_GROUND_SHUFFLED(c, d, 2, 6, 3, 7);
  return {SMOKE_GROUND_SHUFFLED(ab_low, cd_low, 0, 1, 4, 5),
          SMOKE_GROUND_SHUFFLED(ab_low, cd_low, 2, 3, 6, 7),
          SMOKE_GROUND_SHUFFLED(ab_high, cd_high, 0, 1, 4, 5),
          SMOKE_GROUND_SHUFFLED(ab_high, cd_high, 2, 3, 6, 7)};
}

SMOKE_GROUND_PART Floats loadLanes(const float* from) {
  Floats lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

SMOKE_GROUND_PART FourDoubles loadFour(const double* from) {
  FourDoubles four;
  std::memcpy(&four, from, sizeof(four));
  return four;
}

SMOKE_GROUND_PART bool isNone(const FourInts& lanes) {
  std::array<std::uint64_t, 2> bits;
  std::memcpy(bits.data(), &lanes, sizeof(bits));
  return (bits[0] | bits[1]) == 0;
}

SMOKE_GROUND_PART bool isNone(const Ints& lanes) {
  std::array<FourInts, 2> halves;
  std::memcpy(halves.data(), &lanes, sizeof(halves));
  return isNone(halves[0] | halves[1]);
}

/// In two steps, for which processors have instructions.
SMOKE_GROUND_PART Bytes bytesOf(const Ints& lanes) {
  return __builtin_convertvector(__builtin_convertvector(lanes, Shorts), Bytes);
}

/// Of four or eight.
template <typename Lanes>
SMOKE_GROUND_PART Lanes magnitudeOf(const Lanes& lanes) {
  decltype(lanes != lanes) bits;  // as many integers
  std::memcpy(&bits, &lanes, sizeof(bits));
  bits &= 0x7FFFFFFF;
  Lanes magnitude;
  std::memcpy(&magnitude, &bits, sizeof(magnitude));
  return magnitude;
}

/// The least of two; the second where one is no number.
SMOKE_GROUND_PART Floats least(const Floats& a, const Floats& b) { return a < b ? a : b; }

/// Numbers that are not negative with the signs of others.
SMOKE_GROUND_PART Floats withSignOf(const Floats& others, const Floats& lanes) {
  Ints signs, bits;
  std::memcpy(&signs, &others, sizeof(signs));
  std::memcpy(&bits, &lanes, sizeof(bits));
  bits |= signs & std::numeric_limits<std::int32_t>::min();
  Floats with_signs;
  std::memcpy(&with_signs, &bits, sizeof(bits));
  return with_signs;
}

SMOKE_GROUND_PART Floats rootOf(const Floats& lanes) {
  std::array<float, kLanes> values;
  std::memcpy(values.data(), &lanes, sizeof(lanes));
  for (float& value : values) value = std::sqrt(value);
  return loadLanes(values.data());
}

}  // namespace smoke_ground_reconstruction
