#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <sensor_msgs/PointCloud2.h>

#include <boost/shared_ptr.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/point_selection.hpp"
#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/message_pool.hpp"
#include "smoke_ground_reconstruction/ros/scan_layout.hpp"

namespace smoke_ground_reconstruction {

/// What a stage found of the points of a scan.
struct PointFindings {
  std::vector<Label> labels;            ///< one per point
  std::vector<std::uint32_t> clusters;  ///< one per point; empty where nothing was clustered
};

using PointFindingsConstPtr = std::shared_ptr<const PointFindings>;

/// Points of one label, cut from a scan, on their way to other nodelets.
///
/// On a topic this is a sensor_msgs/PointCloud2. Its points are written when ROS asks for the
/// bytes, for listeners that are no subscribers of a CutCloud in the same process. Those get a
/// pointer to this, and find the scan as it was laid out, and what was found of its points.
struct CutCloud {
  sensor_msgs::PointCloud2 message;  ///< where there is a layout, all but its data
  ScanLayoutConstPtr layout;         ///< of the whole scan; null where the message is all there is
  PointFindingsConstPtr findings;    ///< with the layout
  Label label = Label::kInvalid;     ///< of the points, with the layout
  std::vector<AppendedField> appended;  ///< to the points, with the layout; values of `findings`

  /// Writes message.row_step bytes. For clouds with a layout.
  void writePoints(std::uint8_t* to) const;
};

using CutCloudPtr = boost::shared_ptr<CutCloud>;
using CutCloudConstPtr = boost::shared_ptr<const CutCloud>;

/// Where that lies which the points are read from.
std::uint64_t addressOf(const CutCloud& cloud);

/// Cuts clouds from scans. Not for several threads at once.
class CloudCutter {
 public:
  /// The points of one label.
  /// \param cloud  the scan.
  /// \param layout  of the scan; null: the points are written at once, in memory as of MessagePool.
  /// \param findings  one label per point of the cloud.
  /// \param appended  fields after the cloud's own; their values must be those of `findings`, or of
  ///                  `cloud` where there is no layout.
  /// \throws std::invalid_argument where the cloud has a field of an appended name already.
  CutCloudPtr cut(const CloudView& cloud, const ScanLayoutConstPtr& layout,
                  const PointFindingsConstPtr& findings, Label label,
                  const std::vector<AppendedField>& appended);

 private:
  MessagePool<CutCloud> pool_;  // of clouds without a layout
};

/// The points of a cut cloud, to be read. The cloud must outlive the view.
class CutView {
 public:
  /// \throws std::invalid_argument as CloudView does.
  explicit CutView(const CutCloud& cloud);
  CutView(const CutView&) = delete;
  CutView& operator=(const CutView&) = delete;

  /// The points in the order of the message.
  const ScanView& scan() const { return scan_; }

 private:
  std::optional<CloudView> message_;
  PointSelection selection_;
  ScanView scan_;
};

}  // namespace smoke_ground_reconstruction

namespace ros {
namespace message_traits {

/// A CutCloud is a PointCloud2 to everyone outside.
template <template <typename> class Trait>
struct CutCloudTrait {
  static const char* value() { return Trait<sensor_msgs::PointCloud2>::value(); }
  static const char* value(const smoke_ground_reconstruction::CutCloud&) { return value(); }
};

template <>
struct MD5Sum<smoke_ground_reconstruction::CutCloud> : CutCloudTrait<MD5Sum> {};
template <>
struct DataType<smoke_ground_reconstruction::CutCloud> : CutCloudTrait<DataType> {};
template <>
struct Definition<smoke_ground_reconstruction::CutCloud> : CutCloudTrait<Definition> {};
template <>
struct HasHeader<smoke_ground_reconstruction::CutCloud> : TrueType {};
template <>
struct TimeStamp<smoke_ground_reconstruction::CutCloud> {
  static ros::Time value(const smoke_ground_reconstruction::CutCloud& cloud) {
    return cloud.message.header.stamp;
  }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<smoke_ground_reconstruction::CutCloud> {
  static void write(OStream& stream, const smoke_ground_reconstruction::CutCloud& cloud);
  static void read(IStream& stream, smoke_ground_reconstruction::CutCloud& cloud);
  static std::uint32_t serializedLength(const smoke_ground_reconstruction::CutCloud& cloud);
};

}  // namespace serialization
}  // namespace ros
