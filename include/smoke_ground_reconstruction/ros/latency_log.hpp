#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <smoke_ground_reconstruction/Timing.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace smoke_ground_reconstruction {

/// What became of scans on their way through the chain, and what the process took meanwhile, as
/// JSON. Any thread may call any method. Times are nanosecondsOf() the monotonic clock.
class LatencyLog {
 public:
  /// The scan of that seq goes out.
  void sent(const sensor_msgs::PointCloud2& scan, std::uint64_t time);
  /// The floor of the scan of that seq is there.
  void arrived(const sensor_msgs::PointCloud2& floor, std::uint64_t time);
  bool hasArrived(std::uint32_t seq) const;
  /// A nodelet has done its part of the scan.
  void worked(const std::string& stage, const Timing& timing);
  /// The same scan took a Pipeline that long in this process, up to the floor [ms].
  void compared(std::uint32_t seq, double milliseconds);
  /// Notes the memory and the processor's time that the process has taken.
  void lookAtProcess();

  std::string json() const;

 private:
  struct Scan {
    std::uint64_t sent = 0, arrived = 0;
    std::uint64_t buffer = 0, floor_buffer = 0;  // where the data lies
    std::size_t floors = 0;
    double pipeline_ms = 0.0;
  };
  struct Look {
    std::uint64_t time;
    double resident_mb;
    double cpu_s;
  };

  std::string scansAsJson() const;
  std::string stagesAsJson() const;
  std::string processAsJson() const;

  mutable std::mutex mutex_;
  std::map<std::uint32_t, Scan> scans_;
  std::map<std::string, std::vector<Timing>> stages_;
  std::vector<Look> looks_;
};

}  // namespace smoke_ground_reconstruction
