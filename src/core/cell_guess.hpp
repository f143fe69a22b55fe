#pragma once

#include "lanes.hpp"
#include "smoke_ground_reconstruction/floor_cells.hpp"

namespace smoke_ground_reconstruction {

/// Tells cells of a grid in single precision, where these are sure.
class CellGuess {
 public:
  static constexpr float kDoubt = 3e-4F;  ///< cells: twice what roundings add up to
  static constexpr std::int32_t kUnsure = CellGrid::kOutside;

  explicit CellGuess(const CellGrid& grid)
      : grid_(grid), per_unit_(static_cast<float>(1.0 / grid.size())) {}

  /// The cells of places, kUnsure outside and where an edge is no farther than `doubt` [cells].
  SMOKE_GROUND_PART Ints at(const Floats& x, const Floats& y, const Floats& doubt) const {
    const Floats u = placed(x), v = placed(y);
    const Ints column = __builtin_convertvector(u, Ints), row = __builtin_convertvector(v, Ints);
    const Ints is_sure = isClear(u - __builtin_convertvector(column, Floats), doubt) &
                         isClear(v - __builtin_convertvector(row, Floats), doubt);
    return is_sure ? column * static_cast<std::int32_t>(CellGrid::kAcross) + row : kUnsure + Ints{};
  }
  /// The cells of eight places, those that are unsure by the grid.
  SMOKE_GROUND_PART Ints ofEight(const float* x, const float* y) const {
    Ints cells = at(loadLanes(x), loadLanes(y), kDoubt + Floats{});
    if (isNone(cells == kUnsure)) return cells;
    for (std::uint32_t k = 0; k < kLanes; ++k) {
      cells[k] = static_cast<std::int32_t>(grid_.cellOf(x[k], y[k]));
    }
    return cells;
  }

 private:
  /// In cells from the grid's corner; what lies outside, on an edge of it.
  SMOKE_GROUND_PART Floats placed(const Floats& value) const {
    constexpr auto kEnd = static_cast<float>(CellGrid::kAcross);
    const Floats cells = value * per_unit_ + 0.5F * kEnd;
    const Floats above = cells > 0.0F ? cells : Floats{};
    return above < kEnd ? above : kEnd + Floats{};
  }
  SMOKE_GROUND_PART static Ints isClear(const Floats& part, const Floats& doubt) {
    return (part > doubt) & (part < 1.0F - doubt);
  }

  CellGrid grid_;
  float per_unit_;
};

}  // namespace smoke_ground_reconstruction
