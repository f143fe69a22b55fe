#include "smoke_ground_reconstruction/ros/cut_cloud.hpp"

#include <boost/make_shared.hpp>

#include "smoke_ground_reconstruction/ros/stage_timing.hpp"

namespace smoke_ground_reconstruction {

void CutCloud::writePoints(std::uint8_t* to) const {
  const CloudView scan(*layout->message);
  smoke_ground_reconstruction::writePoints(scan, findings->labels, label, appended, to);
}

std::uint64_t addressOf(const CutCloud& cloud) {
  if (!cloud.layout) return addressOf(cloud.message);
  return reinterpret_cast<std::uintptr_t>(cloud.findings->labels.data());
}

CutCloudPtr CloudCutter::cut(const CloudView& cloud, const ScanLayoutConstPtr& layout,
                             const PointFindingsConstPtr& findings, Label label,
                             const std::vector<AppendedField>& appended) {
  const CutCloudPtr cut = layout ? boost::make_shared<CutCloud>() : pool_.take();
  if (!layout) {
    selectPoints(cloud, findings->labels, label, appended, &cut->message);
    return cut;
  }
  frameCut(cloud.message(), findings->labels, label, appended, &cut->message);
  cut->layout = layout;
  cut->findings = findings;
  cut->label = label;
  cut->appended = appended;
  return cut;
}

CutView::CutView(const CutCloud& cloud) {
  if (cloud.layout) {
    selection_.appendAll(cloud.layout->scan.view(), cloud.findings->labels, cloud.label);
    scan_ = selection_.view();
  } else {
    scan_ = message_.emplace(cloud.message).scan();
  }
}

}  // namespace smoke_ground_reconstruction

namespace ros {
namespace serialization {

using smoke_ground_reconstruction::CutCloud;

void Serializer<CutCloud>::write(OStream& stream, const CutCloud& cloud) {
  const sensor_msgs::PointCloud2& message = cloud.message;
  if (!cloud.layout) {
    stream.next(message);
    return;
  }
  stream.next(message.header);
  stream.next(message.height);
  stream.next(message.width);
  stream.next(message.fields);
  stream.next(message.is_bigendian);
  stream.next(message.point_step);
  stream.next(message.row_step);
  stream.next(message.row_step);  // as the number of bytes that follow
  cloud.writePoints(stream.advance(message.row_step));
  stream.next(message.is_dense);
}

void Serializer<CutCloud>::read(IStream& stream, CutCloud& cloud) { stream.next(cloud.message); }

std::uint32_t Serializer<CutCloud>::serializedLength(const CutCloud& cloud) {
  return serializationLength(cloud.message) + (cloud.layout ? cloud.message.row_step : 0);
}

}  // namespace serialization
}  // namespace ros
