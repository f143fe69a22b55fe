#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/neighbor_counter.hpp"

namespace smoke_ground_reconstruction {

/// Exact neighbour counts without a tree. A radius proportional to range is a fixed angle: whatever
/// lies within k * r of a point at range r lies within asin(k) of its direction. Points are
/// bucketed by (range, elevation, azimuth); a query looks through the buckets that its ball can
/// touch, nearest first, and decides by squaredDistance(). Exact for any radius: a query whose
/// window passes a pole, or whose radius reaches the sensor, takes all azimuths or all directions.
///
/// Nothing but sums, products and square roots: elevation is bucketed by its sine, azimuth by a
/// stand-in that grows as it does, range by its binary exponent.
class WindowCounter : public NeighborCounter {
 public:
  /// \param radius_per_range  the k that sizes the buckets; queries of any other radius stay exact.
  WindowCounter(const Scan& scan, double radius_per_range);

  /// \param index  of a valid point.
  std::size_t count(std::size_t index, double squared_radius, std::size_t limit) const override;
  bool isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                 std::size_t at_most) const override;

 private:
  struct Place;
  struct Window;

  std::vector<std::uint32_t> bucketOfEachPoint() const;
  void fillBuckets(const std::vector<std::uint32_t>& bucket_of);
  int rowOf(double sine) const;
  int columnOf(double turn) const;
  const std::uint32_t* rowBegin(int shell, int row) const;

  Place placeOf(std::size_t index) const;
  Window windowOf(std::size_t index, double squared_radius) const;
  void limitRows(const Place& place, double reach, Window* window) const;
  void limitColumns(const Place& place, double reach, Window* window) const;

  std::size_t candidatesIn(const Window& window) const;
  std::size_t countInWindow(const Window& window, std::size_t limit) const;
  std::size_t countInShell(int shell, const Window& window, std::size_t enough) const;
  std::size_t countInRow(int shell, int row, const Window& window, std::size_t enough) const;
  std::size_t countInRun(std::size_t begin, std::size_t end, const Window& window,
                         std::size_t enough) const;

  const Scan& scan_;
  int rows_ = 0;
  int columns_ = 0;
  std::vector<std::uint32_t> bucket_begin_;  // shell by shell, row by row
  std::vector<float> x_, y_, z_;             // bucket by bucket
};

}  // namespace smoke_ground_reconstruction
