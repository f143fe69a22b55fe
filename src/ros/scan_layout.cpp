#include "smoke_ground_reconstruction/ros/scan_layout.hpp"

#include <atomic>
#include <boost/smart_ptr/shared_ptr.hpp>

#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {
namespace {

// More scans under way than this come of who falls behind: he may read messages.
constexpr std::size_t kMost = 8;

/// Deletes a message, and keeps a layout as long as anybody keeps the message. Pointers to a
/// message share it wherever they go in this process.
struct Carrier {
  ScanLayoutConstPtr layout;

  void operator()(const sensor_msgs::PointCloud2* message) const { delete message; }
};

sensor_msgs::PointCloud2Ptr makeCarrier() { return {new sensor_msgs::PointCloud2, Carrier()}; }

}  // namespace

std::shared_ptr<ScanLayout> LayoutPool::take(const sensor_msgs::PointCloud2ConstPtr& message,
                                             const CloudView& cloud) {
  if (!cloud.isReadInPlace()) return nullptr;
  std::shared_ptr<ScanLayout> taken;
  for (const auto& layout : layouts_) {
    if (layout.use_count() != 1) continue;
    std::atomic_thread_fence(std::memory_order_acquire);  // after the last look of another thread
    layout->message.reset();
    taken = layout;
  }
  if (!taken && layouts_.size() == kMost) return nullptr;
  if (!taken) layouts_.push_back(taken = std::make_shared<ScanLayout>());
  taken->message = message;
  taken->scan.assign(cloud.scan());
  countPointsByRing(taken->scan.view(), &taken->points_by_ring);
  return taken;
}

CarrierPool::CarrierPool() : pool_(makeCarrier) {}

sensor_msgs::PointCloud2Ptr CarrierPool::take(const ScanLayoutConstPtr& layout) {
  pool_.forEachIdle([](const sensor_msgs::PointCloud2Ptr& idle) {
    boost::get_deleter<Carrier>(idle)->layout.reset();  // which others may use
  });
  const auto message = pool_.take();
  boost::get_deleter<Carrier>(message)->layout = layout;
  return message;
}

ScanLayoutConstPtr layoutOf(const sensor_msgs::PointCloud2ConstPtr& message) {
  const auto* carrier = boost::get_deleter<Carrier>(message);
  return carrier == nullptr ? nullptr : carrier->layout;
}

}  // namespace smoke_ground_reconstruction
