#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

/// How far away a wall is: 3-D range as Algorithm 3 prints it, or along the floor.
enum class WallDistance { kRange, kPlanarRange };

/// Parameters of the thesis's reconstruction; names, units and defaults as in
/// cfg/Reconstructor.cfg.
struct PolarSegmentsParams {
  double segment_angle_deg = 10.0;            ///< angle of a segment of the polar grid; divides 360
  double horizontal_resolution_deg = 0.4;     ///< azimuth step of the sensor
  double reconstruction_gain = 0.15;          ///< share of the expected ground points that suffices
  int min_wall_points = 10;                   ///< fewer: the segment has no wall
  double height_difference_threshold = 0.05;  ///< over the lower neighbour [m], Step 3
  double max_elevation_angle_deg = 5.0;       ///< of the floor's slope, Step 3
  WallDistance wall_distance = WallDistance::kRange;

  /// \throws std::invalid_argument naming the parameter, its value and what it may be.
  void validate() const;
};

/// What is known of one segment of the polar grid (Algorithm 5, Steps 1 to 3), in the level frame.
struct PolarSegment {
  std::size_t wall_points = 0;
  std::size_t ground_points = 0;
  float lowest_z = 0.0F;             ///< of the wall points [m]
  std::size_t rings_below_wall = 0;  ///< number of rings below the wall's lowest ring
  double min_distance = 0.0;         ///< to the wall [m]
  bool has_wall = false;
  bool keeps_measured = false;  ///< ground points stay; else the segment is reconstructed
  double adjusted_z = 0.0;      ///< floor height at the wall after Step 3 [m]
};

/// Wall-based reconstruction on a polar grid, the thesis's own method.
/// Thesis: Section 3.4, Eq. 3.1, Algorithms 3 and 5, Table A.1.
class PolarSegments {
 public:
  /// \throws std::invalid_argument on bad parameters.
  explicit PolarSegments(const PolarSegmentsParams& params);

  /// The floor from segmented points.
  /// \param ground, walls  in the sensor frame; walls are the clustered ones.
  /// \return measured points segment-wise first in input order, then reconstructed points by
  /// segment,
  ///         radius and azimuth. Confidence: 1 where measured; where reconstructed the share of the
  ///         segment's azimuth steps in which a wall point was seen (a support, not a probability).
  FloorSurface reconstruct(const ScanView& ground, const ScanView& walls, const SensorModel& sensor,
                           const Mounting& mounting) const;

  /// The polar grid behind it, for figures and tests.
  std::vector<PolarSegment> segments(const Scan& ground, const Scan& walls,
                                     const SensorModel& sensor, const Mounting& mounting) const;

 private:
  PolarSegmentsParams params_;
  AzimuthBins bins_;
};

}  // namespace smoke_ground_reconstruction
