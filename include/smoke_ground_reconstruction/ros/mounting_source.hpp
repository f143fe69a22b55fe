#pragma once

#include <geometry_msgs/Transform.h>
#include <ros/node_handle.h>
#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <memory>
#include <string>

#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// Mounting of a level sensor whose robot drives towards an azimuth of the sensor frame.
/// \param forward_yaw_deg  azimuth of forward, counter-clockwise from the sensor's +x [deg].
Mounting levelMounting(double forward_yaw_deg, double sensor_height);

/// Mounting from T_base_sensor, base being level, +x forward.
/// \param base_height  of the base frame's origin above the floor [m].
/// \throws std::runtime_error where the sensor would not be above the floor.
Mounting mountingFrom(const geometry_msgs::Transform& T_base_sensor, double base_height);

/// How the sensor stands when a scan is taken: from tf where ~base_frame is set, else level.
///
/// Private parameters, read once: ~base_frame (level, +x forward; "" for none), ~base_height [m]
/// of its origin above the floor, ~tf_timeout [s], ~forward_yaw_deg (without base_frame alone).
class MountingSource {
 public:
  explicit MountingSource(const ros::NodeHandle& nh);

  /// \param sensor_height  height of the sensor where tf does not tell it [m].
  /// \throws std::runtime_error without a transform at the header's stamp; waits for it up to
  ///         ~tf_timeout of wall time, since a joint's transform may come after the scan.
  Mounting at(const std_msgs::Header& header, double sensor_height) const;

  /// What tells the sensor's height: "sensor_height", or tf and the frame.
  std::string heightIsFrom() const;

 private:
  void waitForTransform(const std_msgs::Header& header) const;

  std::string base_frame_;
  double base_height_;
  double tf_timeout_;
  double forward_yaw_deg_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;
};

}  // namespace smoke_ground_reconstruction
