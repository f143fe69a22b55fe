#pragma once

#include <cstdint>

namespace smoke_ground_reconstruction {

/// What a return of a scan may be, by its height for the most part; several at once.
struct ReturnKind {
  enum Bit : std::uint8_t {
    kLow = 1,     ///< on the floor
    kSoft = 2,    ///< of smoke near the sensor
    kAtWall = 4,  ///< the foot of a wall
    kDeep = 8,    ///< below the floor
    kNear = 16,   ///< about the floor's height
    kMayBeWall = 32,
    kAtCeiling = 64
  };
};

}  // namespace smoke_ground_reconstruction
