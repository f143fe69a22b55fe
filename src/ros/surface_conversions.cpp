#include "smoke_ground_reconstruction/ros/surface_conversions.hpp"

#include <sensor_msgs/PointField.h>

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <utility>
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

std::vector<PointField> makeSurfaceFields() {
  return {makeField("x", kX, PointField::FLOAT32),
          makeField("y", kY, PointField::FLOAT32),
          makeField("z", kZ, PointField::FLOAT32),
          makeField("intensity", kIntensity, PointField::FLOAT32),
          makeField("ring", kRing, PointField::UINT16),
          makeField("provenance", kProvenance, PointField::UINT8),
          makeField("confidence", kConfidence, PointField::FLOAT32),
          makeField("sigma", kSigma, PointField::FLOAT32)};
}

template <typename Value>
void put(std::uint8_t* to, Value value) {
  std::memcpy(to, &value, sizeof(value));
}

// Point by point, for the message is read and written once. The pointers are taken out of the loop,
// since the compiler must take each written byte for a part of them.
void writePoints(const FloorSurface& surface, std::uint8_t* to) {
  const float *const x = surface.x.data(), *const y = surface.y.data(), *const z = surface.z.data(),
                     *const intensity = surface.intensity.data(),
                     *const sigma = surface.sigma.data(),
                     *const confidence = surface.confidence.data();
  const std::uint16_t* const ring = surface.ring.data();
  const Provenance* const provenance = surface.provenance.data();
  const bool has_sigma = !surface.sigma.empty();
  const std::size_t size = surface.size();
  for (std::size_t i = 0; i < size; ++i, to += kPointStep) {
    put(to + kX, x[i]);
    put(to + kY, y[i]);
    put(to + kZ, z[i]);
    put(to + kIntensity, intensity[i]);
    put(to + kRing, ring[i]);
    put(to + kProvenance, static_cast<std::uint16_t>(provenance[i]));  // and the gap behind it
    put(to + kConfidence, confidence[i]);
    put(to + kSigma, has_sigma ? sigma[i] : std::numeric_limits<float>::quiet_NaN());
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
                                         const FloorSurface& surface,
                                         const sensor_msgs::PointCloud2Ptr& cloud) {
  cloud->header = header;
  cloud->fields = makeSurfaceFields();
  cloud->is_bigendian = false;
  cloud->point_step = kPointStep;
  cloud->height = 1;
  cloud->width = static_cast<std::uint32_t>(surface.size());
  cloud->row_step = cloud->width * cloud->point_step;
  cloud->is_dense = true;
  cloud->data.resize(cloud->row_step);
  writePoints(surface, cloud->data.data());
  return cloud;
}

nav_msgs::OccupancyGridPtr toOccupancyMsg(const std_msgs::Header& header, OccupancyGrid grid,
                                          const Mounting& mounting) {
  auto message = boost::make_shared<nav_msgs::OccupancyGrid>();
  message->header = header;
  message->info.map_load_time = header.stamp;
  message->info.resolution = static_cast<float>(grid.resolution);
  message->info.width = static_cast<std::uint32_t>(grid.width);
  message->info.height = static_cast<std::uint32_t>(grid.height);
  message->info.origin = cornerPose(grid, mounting);
  message->data = std::move(grid.cells);
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
