#include "smoke_ground_reconstruction/ros/lazy_nodelet.hpp"

#include <algorithm>
#include <stdexcept>

#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"

namespace smoke_ground_reconstruction {
namespace {

std::uint32_t queueSizeFrom(const ros::NodeHandle& nh) {
  const int size = nh.param("queue_size", 1);
  if (size < 1) {  // 0 would mean without end
    throw std::invalid_argument(nh.resolveName("queue_size") + " must be at least 1, is " +
                                std::to_string(size));
  }
  return static_cast<std::uint32_t>(size);
}

}  // namespace

void LazyNodelet::onInit() {
  try {
    initialize();
  } catch (const std::exception& error) {  // the manager would say nothing of it
    NODELET_FATAL("%s: cannot start: %s", getName().c_str(), error.what());
    throw;
  }
}

void LazyNodelet::initialize() {
  ros::NodeHandle pnh = upkeepHandle();
  is_always_on_ = pnh.param("always_on", false);
  queue_size_ = queueSizeFrom(pnh);
  timing_pub_ = pnh.advertise<Timing>("timing", kOutputQueueSize);
  diagnostics_ = std::make_unique<diagnostic_updater::Updater>(upkeep_.handle(getNodeHandle()), pnh,
                                                               getName());
  diagnostics_->setHardwareID("none");
  diagnostics_->add("scans", [this](auto& status) { health_.report(status); });
  input_topic_ = pnh.resolveName("input");
  health_.setInput(input_topic_);
  setUp();
  // On the wall clock: it reports even while time stops.
  diagnostics_timer_ =
      pnh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { report(); });
  {
    const std::lock_guard<std::mutex> lock(connect_mutex_);  // a listener may be there at once
    advertiseOutputs();
  }
  updateListening();
  listeners_.start();
  upkeep_.start();
}

void LazyNodelet::report() {
  diagnostics_->force_update();
  const std::string fault = health_.standstill();
  if (!fault.empty()) warn(fault);
}

void LazyNodelet::endCallbacks() {
  listeners_.end();
  upkeep_.end();
  scans_.end();
}

ros::NodeHandle LazyNodelet::inputHandle() {
  ros::NodeHandle handle = getPrivateNodeHandle();
  handle.setCallbackQueue(&scans_);
  return handle;
}

void LazyNodelet::updateListening() {
  const std::lock_guard<std::mutex> lock(connect_mutex_);
  const bool is_heard =
      is_always_on_ || std::any_of(outputs_.begin(), outputs_.end(), [](const auto& output) {
        return output.getNumSubscribers() > 0;
      });
  if (is_heard == is_listening_) return;
  is_listening_ = is_heard;
  health_.setListening(is_heard);
  is_heard ? startListening() : stopListening();
}

void LazyNodelet::listenAnew() {
  const std::lock_guard<std::mutex> lock(connect_mutex_);
  if (!is_listening_) return;
  stopListening();
  startListening();
}

void LazyNodelet::handleScan(const std_msgs::Header& header,
                             const std::function<Kept(StageTiming&)>& work) {
  if (cameBefore(header)) return;
  try {
    StageTiming timing(header);
    const Kept kept = work(timing);
    health_.scanDone(kept.points_in, kept.points_kept, timing.milliseconds());
    scans_.afterwards([this, message = timing.message()] { timing_pub_.publish(message); });
  } catch (const std::exception& error) {
    health_.scanDropped(error.what());
    warn("dropped a scan of " + input_topic_ + " (frame '" + header.frame_id +
         "'): " + error.what() + "; /diagnostics counts further ones");
  }
}

bool LazyNodelet::cameBefore(const std_msgs::Header& header) {
  const Arrival arrival{&header, header.stamp, header.seq};
  const bool is_same = !header.stamp.isZero() && arrival.header == last_.header &&
                       arrival.stamp == last_.stamp && arrival.seq == last_.seq;
  last_ = arrival;
  return is_same;
}

void LazyNodelet::warn(const std::string& fault) {
  const std::lock_guard<std::mutex> lock(faults_mutex_);
  if (faults_.isNews(fault)) NODELET_WARN("%s: %s", getName().c_str(), fault.c_str());
}

void LazyNodelet::warnOfDerivedRings(const sensor_msgs::PointCloud2& cloud) {
  if (has_warned_of_rings_) return;
  has_warned_of_rings_ = true;
  warn("clouds of " + input_topic_ +
       " have no 'ring'; rings are derived from elevation; fields: " + describeFields(cloud));
}

}  // namespace smoke_ground_reconstruction
