#pragma once

#include <ros/node_handle.h>

#include <map>
#include <string>
#include <vector>

#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

/// One SensorModel per frame_id: learned from its scans, or known where config/<sensor>.yaml is
/// loaded as the private parameter ~sensor_beams; that then holds for all frames.
class SensorModels {
 public:
  /// \throws std::invalid_argument where ~sensor_beams/rings is there and is no list of
  ///         [elevation_deg, azimuth_offset_deg] by ring number.
  explicit SensorModels(const ros::NodeHandle& nh);

  /// The model of a frame after it has seen the scan.
  const SensorModel& observe(const std::string& frame_id, const ScanView& scan);
  /// The same where the points of its rings were counted before.
  const SensorModel& observe(const std::string& frame_id, const ScanView& scan,
                             const std::vector<std::size_t>& points_by_ring);

 private:
  SensorModel& modelOf(const std::string& frame_id);

  SensorModel seed_;
  std::map<std::string, SensorModel> models_;
};

}  // namespace smoke_ground_reconstruction
