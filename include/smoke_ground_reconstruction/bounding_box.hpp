#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

/// Where some points lie: each coordinate's least and greatest. What it says of their distances is
/// exact: differences, squares and sums of squaredDistance() grow with their operands, rounding
/// included.
struct BoundingBox {
  std::array<float, 3> low = {INFINITY, INFINITY, INFINITY};
  std::array<float, 3> high = {-INFINITY, -INFINITY, -INFINITY};

  void add(const std::array<float, 3>& point) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], point[axis]);
      high[axis] = std::max(high[axis], point[axis]);
    }
  }

  /// No point of this box and of another are nearer.
  double leastSquaredDistance(const BoundingBox& other) const {
    std::array<float, 3> from = {0.0F, 0.0F, 0.0F};
    std::array<float, 3> to = {0.0F, 0.0F, 0.0F};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (high[axis] < other.low[axis]) {
        from[axis] = high[axis];
        to[axis] = other.low[axis];
      } else if (other.high[axis] < low[axis]) {
        from[axis] = low[axis];
        to[axis] = other.high[axis];
      }
    }
    return squaredDistance(from[0], from[1], from[2], to[0], to[1], to[2]);
  }

  /// No point of this box is farther from another point.
  double greatestSquaredDistance(const std::array<float, 3>& point) const {
    const double dx = greatestDifference(0, point);
    const double dy = greatestDifference(1, point);
    const double dz = greatestDifference(2, point);
    return (dx * dx + dy * dy) + dz * dz;
  }

 private:
  double greatestDifference(std::size_t axis, const std::array<float, 3>& point) const {
    return std::max(static_cast<double>(high[axis]) - static_cast<double>(point[axis]),
                    static_cast<double>(point[axis]) - static_cast<double>(low[axis]));
  }
};

}  // namespace smoke_ground_reconstruction
