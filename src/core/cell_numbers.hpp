#pragma once

#include <cstddef>
#include <cstdint>

namespace smoke_ground_reconstruction {

/// Numbers of the cells that coordinates lie in, floor(value / size), decided in doubles; cells a
/// million away from the middle stand for all beyond them, and for no number.
/// \param size  edge of a cell, > 0, in the unit of the coordinates.
void cellNumbers(const float* values, std::size_t count, double size, std::int32_t* numbers);

}  // namespace smoke_ground_reconstruction
