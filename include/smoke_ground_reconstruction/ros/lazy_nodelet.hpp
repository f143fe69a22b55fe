#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <nodelet/nodelet.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "smoke_ground_reconstruction/ros/callback_thread.hpp"
#include "smoke_ground_reconstruction/ros/fault_log.hpp"
#include "smoke_ground_reconstruction/ros/scan_queue.hpp"
#include "smoke_ground_reconstruction/ros/stage_health.hpp"
#include "smoke_ground_reconstruction/ros/stage_timing.hpp"

namespace smoke_ground_reconstruction {

/// A nodelet that listens to its inputs only while somebody listens to one of its outputs, or
/// always where ~always_on is set. ~timing and /diagnostics are no outputs in this sense. Bad
/// input drops the scan, with a warning and a diagnostic, and never the nodelet. Scans are worked
/// on one at a time, on the threads of ScanQueue; two threads of its own serve all the rest, and
/// the manager's do nothing. A derived class calls endCallbacks() in its destructor, and takes no
/// handle but those below.
class LazyNodelet : public nodelet::Nodelet {
 public:
  void onInit() final;

 protected:
  /// Makes what the scans need. Runs once, before any output exists.
  virtual void setUp() = 0;
  /// Calls advertiseOutput() for each output.
  virtual void advertiseOutputs() = 0;
  /// Subscribes the inputs on inputHandle().
  virtual void startListening() = 0;
  virtual void stopListening() = 0;

  // The private handle, but that its callbacks come ...
  /// ... on the threads of the scans.
  ros::NodeHandle inputHandle();
  /// ... where listeners come and go, one after another.
  ros::NodeHandle listenerHandle() { return listeners_.handle(getPrivateNodeHandle()); }
  /// ... where nothing waits for a scan: parameters and diagnostics.
  ros::NodeHandle upkeepHandle() { return upkeep_.handle(getPrivateNodeHandle()); }

  /// Waits for all callbacks that are at work; no other is begun.
  void endCallbacks();

  template <typename Message>
  ros::Publisher advertiseOutput(const std::string& topic) {
    const auto on_connect = [this](const ros::SingleSubscriberPublisher&) { updateListening(); };
    outputs_.push_back(
        listenerHandle().advertise<Message>(topic, kOutputQueueSize, on_connect, on_connect));
    return outputs_.back();
  }

  /// Works on one scan: counts and times it, publishes ~timing, and turns an exception into a
  /// dropped scan. `work` ends with the publishing of its outputs and returns how many points of
  /// how many it kept.
  struct Kept {
    std::size_t points_in, points_kept;
  };
  void handleScan(const std_msgs::Header& header, const std::function<Kept(StageTiming&)>& work);

  /// Stops and starts listening, where it listens at all.
  void listenAnew();

  /// Warns of a fault, by the nodelet's name, where FaultLog has it for news.
  void warn(const std::string& fault);

  /// Warns once in the life of the nodelet that rings had to be derived.
  void warnOfDerivedRings(const sensor_msgs::PointCloud2& cloud);

  StageHealth& health() { return health_; }

  /// Scans that may wait, ~queue_size. 1 by default: a stage that falls behind works on the newest
  /// scan, not on one that grew old in a queue.
  std::uint32_t queueSize() const { return queue_size_; }

  static constexpr int kOutputQueueSize = 2;

 private:
  struct Arrival {
    const void* header = nullptr;  // where it lies, and nothing else is asked of it
    ros::Time stamp;
    std::uint32_t seq = 0;
  };

  void initialize();
  /// Was it this very message that came last? Where a driver in the same process advertises while
  /// we subscribe, roscpp may link the two twice, and hand each message over twice.
  bool cameBefore(const std_msgs::Header& header);
  void updateListening();
  void report();

  ScanQueue scans_;  // what callbacks come on is freed last
  CallbackThread listeners_, upkeep_;
  StageHealth health_;
  std::mutex faults_mutex_;
  FaultLog faults_;
  std::string input_topic_;  // what ~input is called outside
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;
  ros::WallTimer diagnostics_timer_;
  ros::Publisher timing_pub_;
  std::mutex connect_mutex_;
  std::vector<ros::Publisher> outputs_;
  std::uint32_t queue_size_ = 1;
  bool is_always_on_ = false;
  bool is_listening_ = false;
  bool has_warned_of_rings_ = false;
  Arrival last_;
};

/// Makes a message only where somebody takes it, and publishes it.
template <typename Make>
void publishIfHeard(const ros::Publisher& publisher, const Make& make) {
  if (publisher.getNumSubscribers() > 0) publisher.publish(make());
}

/// The same for a cloud, which the timing takes note of.
template <typename Make>
void publishIfHeard(const ros::Publisher& publisher, StageTiming& timing, const Make& make) {
  const decltype(make()) cloud = publisher.getNumSubscribers() > 0 ? make() : nullptr;
  timing.handsOver(cloud ? addressOf(*cloud) : 0);
  if (cloud) publisher.publish(cloud);
}

}  // namespace smoke_ground_reconstruction
