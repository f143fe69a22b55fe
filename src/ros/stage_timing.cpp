#include "smoke_ground_reconstruction/ros/stage_timing.hpp"

#include <boost/make_shared.hpp>
#include <numeric>

namespace smoke_ground_reconstruction {

std::uint64_t addressOf(const sensor_msgs::PointCloud2& cloud) {
  return reinterpret_cast<std::uintptr_t>(cloud.data.data());
}

std::uint64_t nanosecondsOf(std::chrono::steady_clock::time_point time) {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count());
}

StageTiming::StageTiming(const std_msgs::Header& header) : message_(boost::make_shared<Timing>()) {
  message_->header = header;
  message_->begun = nanosecondsOf(begin_);
  told({});
}

void StageTiming::received(std::uint64_t address) { message_->input_buffers.push_back(address); }

void StageTiming::handsOver(std::uint64_t address) {
  message_->output_buffers.push_back(address);
  message_->handed_over.push_back(address != 0 ? nanosecondsOf(Clock::now()) : 0);
}

void StageTiming::finish(const std::string& stage, std::size_t points_in, std::size_t points_out) {
  const auto now = Clock::now();
  message_->stages.push_back(stage);
  message_->milliseconds.push_back(std::chrono::duration<double, std::milli>(now - begin_).count());
  message_->points_in.push_back(static_cast<std::uint32_t>(points_in));
  message_->points_out.push_back(static_cast<std::uint32_t>(points_out));
  begin_ = now;
}

void StageTiming::told(const Visibility& visibility) {
  message_->extinction = visibility.extinction;
  message_->extinction_sigma = visibility.sigma;
}

double StageTiming::milliseconds() const {
  return std::accumulate(message_->milliseconds.begin(), message_->milliseconds.end(), 0.0);
}

}  // namespace smoke_ground_reconstruction
