#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/scan_view.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

/// How the sensor is mounted: the rotation that levels the sensor frame (rows of R_level_sensor,
/// +x forward, +z up) and the height of its origin above the floor [m].
struct Mounting {
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double sensor_height = 0.70;

  bool isLevel() const { return rotation == std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}; }
  /// Sensor frame to level frame; float32 in and out, the sums in double in the written order.
  std::array<float, 3> toLevel(float x, float y, float z) const;
  /// Level frame to sensor frame.
  std::array<float, 3> toSensor(float x, float y, float z) const;
};

/// A scan laid out once for all stages: structure of arrays in input order, in the level frame.
/// index i is the i-th input point everywhere.
struct Scan {
  Recycled<float> x, y, z, intensity;
  Recycled<std::uint16_t> ring;
  Recycled<std::uint8_t> valid;  ///< 1 where isReturn() in the sensor frame

  /// Copies a view, rotating coordinates into the level frame.
  explicit Scan(const ScanView& view, const Mounting& mounting = Mounting());
  /// The same into the memory of this one.
  void assign(const ScanView& view, const Mounting& mounting = Mounting());

  std::size_t size() const { return x.size(); }
  std::array<float, 3> point(std::size_t i) const { return {x[i], y[i], z[i]}; }
  ScanView view() const;
};

/// Largest coordinate of a return [m]. No LiDAR ranges so far: it is garbage, of which squares in
/// single precision, grids and rotations would make infinities.
constexpr float kFarthestReturn = 1e6F;

/// Is this a return? Finite, no coordinate beyond kFarthestReturn, and not (0, 0, 0).
inline bool isReturn(float x, float y, float z) {
  // No branches: loops over points vectorize. False for NaN as well.
  const bool is_in_reach = (std::fabs(x) <= kFarthestReturn) & (std::fabs(y) <= kFarthestReturn) &
                           (std::fabs(z) <= kFarthestReturn);
  const bool is_origin = (x == 0.0F) & (y == 0.0F) & (z == 0.0F);
  return is_in_reach & !is_origin;
}

/// The points of some labels, column by column, each column from the lowest ring to the highest
/// (ring order of the SensorModel; ties by point index).
struct ScanColumns {
  Recycled<std::uint32_t> order;  ///< point indices
  Recycled<std::uint32_t>
      column_begin;              ///< column c is order[column_begin[c] .. column_begin[c+1])
  Recycled<std::uint16_t> rank;  ///< per entry of `order`: rank of the point's ring

  /// \param use  one flag per point of the scan: nonzero takes part. Points whose ring has no rank
  ///             do not.
  ScanColumns(const Scan& scan, const std::vector<std::uint8_t>& use, const AzimuthBins& columns,
              const SensorModel& sensor);

 private:
  void sortAtOnce(const std::vector<std::uint32_t>& bin,
                  const std::vector<std::uint16_t>& point_rank, std::size_t columns,
                  std::size_t ranks);
  void sortTwice(const std::vector<std::uint32_t>& bin,
                 const std::vector<std::uint16_t>& point_rank, std::size_t columns,
                 std::size_t ranks);
};

}  // namespace smoke_ground_reconstruction
