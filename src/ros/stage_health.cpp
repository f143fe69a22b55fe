#include "smoke_ground_reconstruction/ros/stage_health.hpp"

#include <diagnostic_msgs/DiagnosticStatus.h>

namespace smoke_ground_reconstruction {
namespace {

constexpr std::chrono::seconds kLong(5);  // without a scan, at which something is amiss

}  // namespace

void StageHealth::setInput(const std::string& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  input_ = topic;
}

void StageHealth::setListening(bool listening) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_listening_ = listening;
  last_news_ = Clock::now();
}

void StageHealth::inputArrived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++recent_.arrived;
  ++total_.arrived;
  last_arrival_ = Clock::now();
}

void StageHealth::scanDone(std::size_t points_in, std::size_t points_kept, double milliseconds) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++recent_.done;
  ++total_.done;
  last_news_ = Clock::now();
  points_in_ = points_in;
  points_kept_ = points_kept;
  milliseconds_ = milliseconds;
}

void StageHealth::scanDropped(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++recent_.dropped;
  ++total_.dropped;
  last_news_ = Clock::now();
  last_drop_ = reason;
}

void StageHealth::tell(Findings findings, const std::string& warning) {
  const std::lock_guard<std::mutex> lock(mutex_);
  findings_ = std::move(findings);
  warning_ = warning;
}

void StageHealth::report(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - since_).count();
  summarize(status);
  status.add("input rate [Hz]", seconds > 0.0 ? static_cast<double>(recent_.arrived) / seconds : 0);
  status.add("points in", points_in_);
  status.add("points kept", points_kept_);
  status.add("last processing time [ms]", milliseconds_);
  status.add("scans done", total_.done);
  status.add("scans dropped", total_.dropped);
  status.add("last drop", last_drop_);
  for (const auto& finding : findings_) status.add(finding.first, finding.second);
  since_ = now;
  recent_ = Counts();
}

void StageHealth::summarize(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using diagnostic_msgs::DiagnosticStatus;
  if (!is_listening_) {
    status.summary(DiagnosticStatus::OK, "idle: nobody listens");
  } else if (recent_.dropped > 0) {
    status.summary(DiagnosticStatus::WARN, "dropped a scan: " + last_drop_);
  } else if (recent_.done > 0 && !warning_.empty()) {
    status.summary(DiagnosticStatus::WARN, warning_);
  } else if (recent_.done > 0) {
    status.summary(DiagnosticStatus::OK, "running");
  } else {
    status.summary(DiagnosticStatus::WARN, whatFailsToCome(recent_.arrived > 0));
  }
}

std::string StageHealth::standstill() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = Clock::now();
  if (!is_listening_ || now - last_news_ < kLong) return "";
  return whatFailsToCome(now - last_arrival_ < kLong);
}

std::string StageHealth::whatFailsToCome(bool comes_in) const {
  if (!comes_in) return "no cloud comes on " + input_;
  return "clouds come on " + input_ + ", but none of their stamps on both ~ground and ~walls";
}

}  // namespace smoke_ground_reconstruction
