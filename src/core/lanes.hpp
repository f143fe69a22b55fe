#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

// Eight numbers worked on together, in vectors of the compiler: AVX's, or two of SSE's or NEON's.
// Inside functions of SMOKE_GROUND_MULTIVERSION alone, and in parts of them.

constexpr std::uint32_t kLanes = 8;
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Ints =
    std::int32_t __attribute__((vector_size(4 * kLanes)));  ///< -1 where a comparison holds
using Bytes = std::int8_t __attribute__((vector_size(kLanes)));

SMOKE_GROUND_PART Floats loadLanes(const float* from) {
  Floats lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

SMOKE_GROUND_PART Floats magnitudeOf(const Floats& lanes) {
  Ints bits;
  std::memcpy(&bits, &lanes, sizeof(bits));
  bits &= 0x7FFFFFFF;
  Floats magnitude;
  std::memcpy(&magnitude, &bits, sizeof(magnitude));
  return magnitude;
}

SMOKE_GROUND_PART Floats rootOf(const Floats& lanes) {
  std::array<float, kLanes> values;
  std::memcpy(values.data(), &lanes, sizeof(lanes));
  for (float& value : values) value = std::sqrt(value);
  return loadLanes(values.data());
}

}  // namespace smoke_ground_reconstruction
