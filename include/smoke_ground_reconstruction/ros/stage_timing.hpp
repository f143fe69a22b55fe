#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <smoke_ground_reconstruction/Timing.h>
#include <std_msgs/Header.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "smoke_ground_reconstruction/visibility.hpp"

namespace smoke_ground_reconstruction {

/// Where the data of a cloud lies in memory.
std::uint64_t addressOf(const sensor_msgs::PointCloud2& cloud);

/// Nanoseconds of the machine's monotonic clock.
std::uint64_t nanosecondsOf(std::chrono::steady_clock::time_point time);

/// Writes msg/Timing.msg while a scan is worked on.
class StageTiming {
 public:
  explicit StageTiming(const std_msgs::Header& header);

  /// Notes where the data of a received cloud lies.
  void received(std::uint64_t address);
  /// Notes where the data of a cloud lies that is handed over now; 0: nobody listens, so it was not
  /// made.
  void handsOver(std::uint64_t address);
  /// Ends a stage that began where the one before ended.
  void finish(const std::string& stage, std::size_t points_in, std::size_t points_out);

  /// Notes how far the sensor sees.
  void told(const Visibility& visibility);

  /// Sum over the stages.
  double milliseconds() const;
  /// The stamp's message; not to be changed once it is published.
  TimingConstPtr message() const { return message_; }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point begin_ = Clock::now();
  TimingPtr message_;
};

}  // namespace smoke_ground_reconstruction
