#include "smoke_ground_reconstruction/ros/scan_layout.hpp"

#include <atomic>

#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {
namespace {

// More scans under way than this come of who falls behind: he may read messages.
constexpr std::size_t kMost = 8;

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

}  // namespace smoke_ground_reconstruction
