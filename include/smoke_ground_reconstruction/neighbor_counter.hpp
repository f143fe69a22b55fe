#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// Counts points of a scan within a radius: the one question the denoiser asks. Engines differ in
/// how they propose candidates; all decide by squaredDistance() < radius^2.
class NeighborCounter {
 public:
  virtual ~NeighborCounter() = default;

  /// Number of valid points other than `index` whose squared distance to it is below
  /// `squared_radius` [m^2]. Counting stops at `limit`, which is then the answer.
  virtual std::size_t count(std::size_t index, double squared_radius, std::size_t limit) const = 0;

  /// more_than < count <= at_most? Engines override it where they know sooner than by counting on.
  virtual bool isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                         std::size_t at_most) const {
    const std::size_t limit = at_most + 1 == 0 ? more_than + 1 : at_most + 1;
    const std::size_t neighbors = count(index, squared_radius, limit);
    return neighbors > more_than && neighbors <= at_most;
  }
};

/// Makes a counter over all valid points of a scan. The scan must outlive it.
using NeighborCounterFactory = std::function<std::unique_ptr<NeighborCounter>(const Scan&)>;

}  // namespace smoke_ground_reconstruction
