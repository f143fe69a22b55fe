#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/neighbor_counter.hpp"

namespace smoke_ground_reconstruction {

/// Exact neighbour counts without a tree. A radius proportional to range is a fixed angle: whatever
/// lies within k * r of a point at range r lies within asin(k) of its direction. Points are
/// bucketed by (elevation, azimuth) and sorted by range inside a bucket; a query visits the buckets
/// in its window, nearest first, and in each only the ranges [r - radius, r + radius]. Exact for
/// any radius: a query whose window passes a pole, or whose radius reaches the sensor, takes all
/// azimuths or all buckets.
class WindowCounter : public NeighborCounter {
 public:
  /// \param radius_per_range  the k that sizes the buckets; queries of any other radius stay exact.
  WindowCounter(const Scan& scan, double radius_per_range);

  std::size_t count(std::size_t index, double squared_radius, std::size_t limit) const override;

 private:
  struct Window;
  Window windowOf(std::size_t index, double radius) const;
  std::size_t countInRow(int row, const Window& window, std::size_t limit) const;
  std::size_t countInBucket(std::size_t bucket, const Window& window, std::size_t limit) const;

  const Scan& scan_;
  int rows_ = 0;
  int columns_ = 0;
  std::vector<std::uint32_t> bucket_begin_;
  // Points by bucket, by range inside a bucket.
  std::vector<std::uint32_t> index_;
  std::vector<float> x_, y_, z_, range_;
  std::vector<double> elevation_, azimuth_;  // by point index
};

}  // namespace smoke_ground_reconstruction
