#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "lanes.hpp"

namespace smoke_ground_reconstruction {

// Which of eight lanes are wanted, one bit each; a part of functions that work on eight lanes.

/// Tables by the bits.
struct BitTables {
  std::array<std::array<std::int32_t, kLanes>, 256> lanes{};
  std::array<std::uint8_t, 256> counts{};

  constexpr BitTables() {
    for (std::size_t bits = 0; bits < counts.size(); ++bits) {
      for (std::int32_t lane = 0; lane < 8; ++lane) {
        if ((bits >> lane & 1U) != 0) lanes[bits][counts[bits]++] = lane;
      }
    }
  }
};
inline constexpr BitTables kBitTables;

/// The lanes whose bits are set, in order, and whatever behind them.
SMOKE_GROUND_PART Ints lanesOfBits(std::uint32_t bits) {
  Ints lanes;
  std::memcpy(&lanes, &kBitTables.lanes[bits], sizeof(lanes));
  return lanes;
}

SMOKE_GROUND_PART std::size_t countOfBits(std::uint32_t bits) { return kBitTables.counts[bits]; }

/// Appends the numbers of lanes that some bits tell, the first of which is number `first`; returns
/// the list's end. Writes eight.
SMOKE_GROUND_PART std::uint32_t* putPlaces(std::uint32_t bits, std::size_t first,
                                           std::uint32_t* end) {
  const Ints places = lanesOfBits(bits) + static_cast<std::int32_t>(first);
  std::memcpy(end, &places, sizeof(places));
  return end + countOfBits(bits);
}

/// Values of lanes, in the order of their numbers.
SMOKE_GROUND_PART Floats picked(const Floats& from, const Ints& lanes) {
#if defined(__clang__)
  Floats to;
  for (std::uint32_t k = 0; k < kLanes; ++k) to[k] = from[lanes[k]];
  return to;
#else
  return __builtin_shuffle(from, lanes);
#endif
}

}  // namespace smoke_ground_reconstruction
