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
  bool isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                 std::size_t at_most) const override;

 private:
  struct Window;

  std::vector<double> rangesAndDirections();
  void fillBuckets(const std::vector<double>& ranges);
  void sortBucketsByRange(const std::vector<double>& ranges,
                          std::vector<std::uint32_t>* points) const;
  void copySorted(const std::vector<double>& ranges, const std::vector<std::uint32_t>& points);
  int rowOf(double elevation) const;
  int columnOf(double azimuth) const;

  Window windowOf(std::size_t index, double squared_radius) const;
  std::size_t candidatesIn(const Window& window) const;
  std::size_t countInWindow(const Window& window, std::size_t limit) const;
  std::size_t countInRow(int row, const Window& window, std::size_t enough) const;
  std::size_t countInBucket(int row, int column, const Window& window, std::size_t enough) const;

  const Scan& scan_;
  int rows_ = 0;
  int columns_ = 0;
  std::vector<double> elevation_, azimuth_;  // by point index [rad], azimuth in [0, 2 pi)
  std::vector<std::uint32_t> bucket_begin_;
  std::vector<float> x_, y_, z_;  // by bucket, by range inside a bucket
  std::vector<double> range_;
};

}  // namespace smoke_ground_reconstruction
