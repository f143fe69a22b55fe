#include "smoke_ground_reconstruction/ros/latency_log.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <iomanip>
#include <sstream>

#include "smoke_ground_reconstruction/ros/stage_timing.hpp"

namespace smoke_ground_reconstruction {
namespace {

template <typename Values, typename Write>
std::string listOf(const Values& values, const Write& write) {
  std::ostringstream out;
  out << std::setprecision(9) << '[';
  const char* separator = "";
  for (const auto& value : values) {
    out << separator;
    write(out, value);
    separator = ", ";
  }
  out << ']';
  return out.str();
}

double residentMegabytes() {
  std::ifstream file("/proc/self/statm");
  double pages = 0.0;
  double resident = 0.0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

double secondsOf(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double cpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return secondsOf(usage.ru_utime) + secondsOf(usage.ru_stime);
}

}  // namespace

void LatencyLog::sent(const sensor_msgs::PointCloud2& scan, std::uint64_t time) {
  const std::lock_guard<std::mutex> lock(mutex_);
  scans_[scan.header.seq].sent = time;
  scans_[scan.header.seq].buffer = addressOf(scan);
}

void LatencyLog::arrived(const sensor_msgs::PointCloud2& floor, std::uint64_t time) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = scans_.find(floor.header.seq);
  if (found == scans_.end()) return;  // sent by somebody else
  Scan& scan = found->second;
  if (++scan.floors > 1) return;
  scan.arrived = time;
  scan.floor_buffer = addressOf(floor);
}

bool LatencyLog::hasArrived(std::uint32_t seq) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = scans_.find(seq);
  return found != scans_.end() && found->second.floors > 0;
}

void LatencyLog::worked(const std::string& stage, const Timing& timing) {
  const std::lock_guard<std::mutex> lock(mutex_);
  stages_[stage].push_back(timing);
}

void LatencyLog::compared(std::uint32_t seq, double milliseconds) {
  const std::lock_guard<std::mutex> lock(mutex_);
  scans_[seq].pipeline_ms = milliseconds;
}

void LatencyLog::lookAtProcess() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = nanosecondsOf(std::chrono::steady_clock::now());
  looks_.push_back({now, residentMegabytes(), cpuSeconds()});
}

std::string LatencyLog::json() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return "{\"scans\": " + scansAsJson() + ", \"stages\": " + stagesAsJson() +
         ", \"process\": " + processAsJson() + "}";
}

std::string LatencyLog::scansAsJson() const {
  return listOf(scans_, [](std::ostream& out, const auto& entry) {
    const Scan& scan = entry.second;
    out << "{\"seq\": " << entry.first << ", \"sent\": " << scan.sent
        << ", \"arrived\": " << scan.arrived << ", \"buffer\": " << scan.buffer
        << ", \"floor_buffer\": " << scan.floor_buffer << ", \"floors\": " << scan.floors
        << ", \"pipeline_ms\": " << scan.pipeline_ms << '}';
  });
}

std::string LatencyLog::stagesAsJson() const {
  const auto number = [](std::ostream& out, const auto& value) { out << value; };
  const auto quoted = [](std::ostream& out, const auto& text) { out << '"' << text << '"'; };
  return listOf(stages_, [&](std::ostream& stages, const auto& entry) {
    stages << "{\"stage\": \"" << entry.first << "\", \"scans\": "
           << listOf(entry.second,
                     [&](std::ostream& out, const Timing& timing) {
                       out << "{\"seq\": " << timing.header.seq << ", \"begun\": " << timing.begun
                           << ", \"handed_over\": " << listOf(timing.handed_over, number)
                           << ", \"input_buffers\": " << listOf(timing.input_buffers, number)
                           << ", \"output_buffers\": " << listOf(timing.output_buffers, number)
                           << ", \"parts\": " << listOf(timing.stages, quoted)
                           << ", \"milliseconds\": " << listOf(timing.milliseconds, number) << '}';
                     })
           << '}';
  });
}

std::string LatencyLog::processAsJson() const {
  return listOf(looks_, [](std::ostream& out, const Look& look) {
    out << "{\"time\": " << look.time << ", \"resident_mb\": " << look.resident_mb
        << ", \"cpu_s\": " << look.cpu_s << '}';
  });
}

}  // namespace smoke_ground_reconstruction
