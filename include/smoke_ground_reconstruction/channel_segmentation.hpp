#pragma once

#include <optional>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

/// What is asked of the change of range from one ring to the next.
enum class RangeStepRule {
  kMinimum,     ///< at least min_range_step: the thesis's feature against smoke
  kIncreasing,  ///< more than zero: the original method (Chu et al. 2017)
  kAny,         ///< no test
};

/// Which point of a passing pair gets the label.
enum class LabelPoint { kFirst, kSecond };

/// Parameters of the segmentation; names, units and defaults as in cfg/Segmenter.cfg.
struct ChannelSegmentationParams {
  double column_width_deg = 0.4;  ///< azimuth of a column [deg]; divides 360
  double min_ground_angle_deg = -3.0;
  double max_ground_angle_deg = 3.0;
  double max_ground_step_height = 0.05;  ///< |dz| of a ground pair [m]; 0: unlimited
  RangeStepRule ground_range_step = RangeStepRule::kMinimum;
  bool ground_relative_margin = false;  ///< apply relative_distance_margin to ground pairs
  double min_wall_angle_deg = 60.0;
  double max_wall_angle_deg = 120.0;
  double max_wall_step_height = 0.0;  ///< |dz| of a wall pair [m]; 0: unlimited
  RangeStepRule wall_range_step = RangeStepRule::kAny;
  bool wall_relative_margin = true;        ///< apply relative_distance_margin to wall pairs
  double min_range_step = 0.03;            ///< of RangeStepRule::kMinimum [m]
  double relative_distance_margin = 0.15;  ///< largest |r(i+1) - r(i)| / r(i) of a pair
  LabelPoint label_point = LabelPoint::kFirst;

  /// \throws std::invalid_argument naming the parameter, its value and what it may be.
  void validate() const;
};

/// Channel-based ground and wall segmentation. Thesis: Section 3.3, Algorithm 4.
///
/// "Channel" is the thesis's word for ring. In each azimuth column the points of a ring are paired
/// with the nearest point of the next higher ring that is present (ties: the lower index). A pair
/// is ground or wall by the angle of (dz, horizontal step), the step carrying the sign of the
/// change of planar range, and by the tests the parameters switch on. Reading: the printed arcsin(h
/// / d) cannot exceed 90 deg; with the signed step it is the same angle up to 90 deg and gives the
/// printed wall window 60..120 deg a meaning. Reading: a wall window and a ground window that both
/// hold label the point a wall: a missing floor is safer than a wrong one.
class ChannelSegmentation {
 public:
  /// \throws std::invalid_argument on bad parameters.
  explicit ChannelSegmentation(const ChannelSegmentationParams& params);

  /// One label per point: kInvalid and kNoise as they come in, kKept turned into kGround or kWall
  /// where a pair says so. O(n log n).
  /// \param labels  the denoiser's answer; only kKept points are looked at.
  /// \param raster  of all valid points of this scan, if there is one; it is changed.
  std::vector<Label> classify(const Scan& scan, const std::vector<Label>& labels,
                              const SensorModel& sensor,
                              std::optional<ScanRaster>* raster = nullptr) const;

 private:
  ChannelSegmentationParams params_;
  AzimuthBins columns_;
};

}  // namespace smoke_ground_reconstruction
