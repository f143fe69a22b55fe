#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/PointField.h>

#include <boost/make_shared.hpp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace smoke_ground_reconstruction {

/// Points (i + 1, 2, 3) of ring i, packed to 18 bytes; coordinates of a datatype.
inline sensor_msgs::PointCloud2ConstPtr makeCloud(
    std::size_t size, std::uint8_t ring_type = sensor_msgs::PointField::UINT16) {
  const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
  const std::vector<const char*> names = {"x", "y", "z", "intensity", "ring"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    sensor_msgs::PointField field;
    field.name = names[i];
    field.offset = static_cast<std::uint32_t>(4 * i);
    field.datatype = i < 4 ? std::uint8_t{sensor_msgs::PointField::FLOAT32} : ring_type;
    field.count = 1;
    cloud->fields.push_back(field);
  }
  cloud->point_step = 18;
  cloud->width = static_cast<std::uint32_t>(size);
  cloud->height = 1;
  cloud->row_step = cloud->width * cloud->point_step;
  cloud->data.resize(cloud->row_step);
  for (std::size_t i = 0; i < size; ++i) {
    const float values[] = {static_cast<float>(i + 1), 2.0F, 3.0F, 4.0F};
    const auto ring = static_cast<std::uint16_t>(i);
    std::memcpy(&cloud->data[18 * i], values, sizeof(values));
    std::memcpy(&cloud->data[18 * i + 16], &ring, sizeof(ring));
  }
  return cloud;
}

}  // namespace smoke_ground_reconstruction
