#include "smoke_ground_reconstruction/ros/mounting_source.hpp"

#include <ros/console.h>
#include <ros/time.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

Mounting levelMounting(double forward_yaw_deg, double sensor_height) {
  const Direction forward = Direction::fromDegrees(forward_yaw_deg);
  Mounting mounting;
  if (forward_yaw_deg != 0.0) {
    mounting.rotation = {
        forward.cosine, forward.sine, 0, -forward.sine, forward.cosine, 0, 0, 0, 1};
  }
  mounting.sensor_height = sensor_height;
  return mounting;
}

Mounting mountingFrom(const geometry_msgs::Transform& T_base_sensor, double base_height) {
  const auto& q = T_base_sensor.rotation;
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  Mounting mounting;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(mounting.rotation.data()) = rotation;
  mounting.sensor_height = T_base_sensor.translation.z + base_height;
  if (!(mounting.sensor_height > 0.0)) {
    throw std::runtime_error("tf puts the sensor " + std::to_string(mounting.sensor_height) +
                             " m above the floor; check base_frame and base_height");
  }
  return mounting;
}

MountingSource::MountingSource(const ros::NodeHandle& nh)
    : base_frame_(nh.param<std::string>("base_frame", "")),
      base_height_(nh.param("base_height", 0.0)),
      tf_timeout_(nh.param("tf_timeout", 0.1)),
      forward_yaw_deg_(nh.param("forward_yaw_deg", 0.0)) {
  if (base_frame_.empty()) return;
  listener_ = std::make_unique<tf2_ros::TransformListener>(buffer_);
  if (forward_yaw_deg_ != 0.0) {
    ROS_WARN("%s: forward_yaw_deg is ignored: base_frame '%s' tells forward",
             nh.getNamespace().c_str(), base_frame_.c_str());
  }
}

Mounting MountingSource::at(const std_msgs::Header& header, double sensor_height) const {
  if (base_frame_.empty()) return levelMounting(forward_yaw_deg_, sensor_height);
  waitForTransform(header);
  const auto transform = buffer_.lookupTransform(base_frame_, header.frame_id, header.stamp);
  return mountingFrom(transform.transform, base_height_);
}

std::string MountingSource::heightIsFrom() const {
  return base_frame_.empty() ? "sensor_height" : "tf from '" + base_frame_ + "'";
}

// On the wall clock: the buffer's own timeout runs on ROS time, which may stand still.
void MountingSource::waitForTransform(const std_msgs::Header& header) const {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(tf_timeout_);
  std::string reason;
  while (!buffer_.canTransform(base_frame_, header.frame_id, header.stamp, &reason)) {
    if (ros::WallTime::now() > deadline) {
      throw std::runtime_error("no transform from '" + header.frame_id + "' to '" + base_frame_ +
                               "' at the scan's stamp: " + reason);
    }
    reason.clear();  // canTransform() appends to it
    ros::WallDuration(0.002).sleep();
  }
}

}  // namespace smoke_ground_reconstruction
