#include "smoke_ground_reconstruction/ros/surface_conversions.hpp"

#include <sensor_msgs/PointField.h>

#include <Eigen/Geometry>
#include <array>
#include <boost/make_shared.hpp>
#include <cstring>
#include <limits>
#include <vector>

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointField;

// A point of ~ground_surface; the offsets are those of its fields.
constexpr std::size_t kX = 0, kY = 4, kZ = 8, kIntensity = 12, kRing = 16, kProvenance = 18,
                      kConfidence = 20, kSigma = 24, kPointStep = 28;

PointField makeField(const char* name, std::size_t offset, std::uint8_t datatype) {
  PointField field;
  field.name = name;
  field.offset = static_cast<std::uint32_t>(offset);
  field.datatype = datatype;
  field.count = 1;
  return field;
}

template <typename Value>
void writeField(std::vector<std::uint8_t>& data, std::size_t offset,
                const std::vector<Value>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::memcpy(&data[i * kPointStep + offset], &values[i], sizeof(Value));
  }
}

geometry_msgs::Point32 toPoint(const std::array<float, 3>& xyz) {
  geometry_msgs::Point32 point;
  point.x = xyz[0];
  point.y = xyz[1];
  point.z = xyz[2];
  return point;
}

// Pose of the grid's corner in the sensor frame: a point of the floor, axes of the level frame.
geometry_msgs::Pose cornerPose(const OccupancyGrid& grid, const Mounting& mounting) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d R_sensor_level =
      Eigen::Map<const RowMajor>(mounting.rotation.data()).transpose();
  const Eigen::Vector3d corner =
      R_sensor_level * Eigen::Vector3d(static_cast<double>(grid.first_column) * grid.resolution,
                                       static_cast<double>(grid.first_row) * grid.resolution,
                                       -mounting.sensor_height);
  const Eigen::Quaterniond q(R_sensor_level);
  geometry_msgs::Pose pose;
  pose.position.x = corner.x();
  pose.position.y = corner.y();
  pose.position.z = corner.z();
  pose.orientation.x = q.x();
  pose.orientation.y = q.y();
  pose.orientation.z = q.z();
  pose.orientation.w = q.w();
  return pose;
}

}  // namespace

sensor_msgs::PointCloud2Ptr toSurfaceMsg(const std_msgs::Header& header,
                                         const FloorSurface& surface) {
  auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
  cloud->header = header;
  cloud->fields = {makeField("x", kX, PointField::FLOAT32),
                   makeField("y", kY, PointField::FLOAT32),
                   makeField("z", kZ, PointField::FLOAT32),
                   makeField("intensity", kIntensity, PointField::FLOAT32),
                   makeField("ring", kRing, PointField::UINT16),
                   makeField("provenance", kProvenance, PointField::UINT8),
                   makeField("confidence", kConfidence, PointField::FLOAT32),
                   makeField("sigma", kSigma, PointField::FLOAT32)};
  cloud->point_step = kPointStep;
  cloud->height = 1;
  cloud->width = static_cast<std::uint32_t>(surface.size());
  cloud->row_step = cloud->width * cloud->point_step;
  cloud->is_dense = true;
  cloud->data.resize(cloud->row_step);
  writeField(cloud->data, kX, surface.x);
  writeField(cloud->data, kY, surface.y);
  writeField(cloud->data, kZ, surface.z);
  writeField(cloud->data, kIntensity, surface.intensity);
  writeField(cloud->data, kRing, surface.ring);
  writeField(cloud->data, kProvenance, surface.provenance);
  writeField(cloud->data, kConfidence, surface.confidence);
  if (surface.sigma.empty()) {
    const float none = std::numeric_limits<float>::quiet_NaN();
    writeField(cloud->data, kSigma, std::vector<float>(surface.size(), none));
  } else {
    writeField(cloud->data, kSigma, surface.sigma);
  }
  return cloud;
}

nav_msgs::OccupancyGridPtr toOccupancyMsg(const std_msgs::Header& header, const OccupancyGrid& grid,
                                          const Mounting& mounting) {
  auto message = boost::make_shared<nav_msgs::OccupancyGrid>();
  message->header = header;
  message->info.map_load_time = header.stamp;
  message->info.resolution = static_cast<float>(grid.resolution);
  message->info.width = static_cast<std::uint32_t>(grid.width);
  message->info.height = static_cast<std::uint32_t>(grid.height);
  message->info.origin = cornerPose(grid, mounting);
  message->data = grid.cells;
  return message;
}

FloorBoundaryPtr toBoundaryMsg(const std_msgs::Header& header, const FloorOutline& outline) {
  auto message = boost::make_shared<FloorBoundary>();
  message->header = header;
  for (const auto& vertex : outline.vertices) message->points.push_back(toPoint(vertex));
  for (const BoundaryKind kind : outline.kinds) {
    message->kinds.push_back(static_cast<std::uint8_t>(kind));
  }
  return message;
}

geometry_msgs::PolygonStampedPtr toPolygonMsg(const std_msgs::Header& header,
                                              const FloorOutline& outline) {
  auto message = boost::make_shared<geometry_msgs::PolygonStamped>();
  message->header = header;
  for (const auto& vertex : outline.vertices) message->polygon.points.push_back(toPoint(vertex));
  return message;
}

}  // namespace smoke_ground_reconstruction
