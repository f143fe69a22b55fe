#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// What makes a point one of a crowd: a number of neighbours above `more_than`, up to `at_most`,
/// nearer than `radius_per_range` times its range.
struct Crowd {
  double radius_per_range;
  std::size_t more_than;
  std::size_t at_most;
};

/// Counts points of a scan within a radius: the one question the denoiser asks. Engines differ in
/// how they propose candidates; all decide by squaredDistance() < radius^2.
class NeighborCounter {
 public:
  /// \param scan  must outlive the counter.
  explicit NeighborCounter(const Scan& scan) : scan_(scan) {}
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

  /// Those of some valid points, in their order, that are in no crowd. Engines override it where
  /// many points together are answered sooner than one by one.
  virtual void findOutsiders(const std::vector<std::uint32_t>& points, const Crowd& crowd,
                             std::vector<std::uint32_t>* outsiders) const;

 protected:
  /// Square [m^2] of a radius proportional to a point's range, in the one order of operations that
  /// all engines share.
  double squaredRadius(std::size_t index, double radius_per_range) const;

  const Scan& scan_;
};

/// Makes a counter over all valid points of a scan. The scan must outlive it.
using NeighborCounterFactory = std::function<std::unique_ptr<NeighborCounter>(const Scan&)>;

}  // namespace smoke_ground_reconstruction
