#pragma once

#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/column_ranges.hpp"

namespace smoke_ground_reconstruction {

/// Returns of walls right above the floor, and how far the walls are.
struct WallFeet {
  static constexpr double kLowest = 0.1;    ///< heights of a wall's foot [m]
  static constexpr double kHighest = 0.75;  ///< no higher than relief and level cells look
  static constexpr double kUpTo = 0.35;     ///< what stands so low down stands on a floor [m]
  static constexpr double kSteepest = 0.1;  ///< it is no higher than this, per metre of range
  static constexpr double kOffWall = 0.1;   ///< and no farther before or behind the wall [m]

  std::vector<std::uint16_t> column;
  std::vector<float> height;     ///< over the floor [m]
  std::vector<double> distance;  ///< planar range of the boundary per column; 0: not known [m]
};

/// Tells where no drop lies before a wall. A beam that falls into a drop before a wall meets the
/// wall below the floor: where a wall is seen row by row right above the floor and nothing of it
/// below, floor stopped these beams, seen or not. Keeps its buffers. Not in the thesis.
class FloorSealer {
 public:
  /// How far there is floor where no drop reaches the wall [m], else 0, by column.
  /// \param is_open  columns that see a drop; they tell nothing.
  void find(const WallFeet& feet, const std::vector<std::uint8_t>& is_open, double sensor_height,
            std::vector<double>* sealed);
  /// What is sealed in so many columns side by side that smoke cannot be why.
  static void keepSteady(const std::vector<double>& sealed, std::vector<double>* steady);

 private:
  ColumnRanges rows_;
  std::vector<double> around_;
};

}  // namespace smoke_ground_reconstruction
