#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// What the denoiser knows of a scan. It travels with the clouds cut from the scan, so that the
/// stages behind in the same process need not read and lay out again what was laid out once.
struct ScanLayout {
  sensor_msgs::PointCloud2ConstPtr message;  ///< the scan as it came
  Scan scan{ScanView()};                     ///< its points, in the sensor frame
  std::vector<std::size_t> points_by_ring;   ///< for SensorModel::observe()
};

using ScanLayoutConstPtr = std::shared_ptr<const ScanLayout>;

/// Layouts in the memory of those that nobody holds any more. Not for several threads at once; the
/// layouts may be let go on any thread.
class LayoutPool {
 public:
  /// A layout of a scan.
  /// \return null where the fields of the message are not read where they lie, and where too many
  ///         scans are under way: who comes behind then reads the messages.
  std::shared_ptr<ScanLayout> take(const sensor_msgs::PointCloud2ConstPtr& message,
                                   const CloudView& cloud);

 private:
  std::vector<std::shared_ptr<ScanLayout>> layouts_;
};

}  // namespace smoke_ground_reconstruction
