#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {

/// A raster that the denoiser has made of a scan, and that one stage behind may change.
class RasterSlot {
 public:
  /// To be filled, while nobody else knows of the slot.
  std::optional<ScanRaster>* fill() {
    is_filled_ = true;
    return &raster_;
  }
  /// \return the raster, if there is one, to the first who asks; null to all others.
  std::optional<ScanRaster>* take() const {
    return is_filled_.exchange(false) ? &raster_ : nullptr;
  }

 private:
  mutable std::optional<ScanRaster> raster_;
  mutable std::atomic<bool> is_filled_{false};
};

/// What the denoiser knows of a scan. It travels with the clouds cut from the scan, so that the
/// stages behind in the same process need not read and lay out again what was laid out once.
struct ScanLayout {
  sensor_msgs::PointCloud2ConstPtr message;  ///< the scan as it came
  Scan scan{ScanView()};                     ///< its points, in the sensor frame
  std::vector<std::size_t> points_by_ring;   ///< for SensorModel::observe()
  RasterSlot raster;                         ///< of all valid points, in the sensor frame
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
