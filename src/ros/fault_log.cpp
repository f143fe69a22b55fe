#include "smoke_ground_reconstruction/ros/fault_log.hpp"

#include <cstddef>

namespace smoke_ground_reconstruction {
namespace {

constexpr std::size_t kMost = 32;  // faults that are remembered

std::string withoutDigits(const std::string& text) {
  std::string rest;
  for (const char c : text) {
    if (c < '0' || c > '9') rest += c;
  }
  return rest;
}

}  // namespace

bool FaultLog::isNews(const std::string& text, Clock::time_point now) {
  const std::string fault = withoutDigits(text);
  const auto found = seen_.find(fault);
  if (found == seen_.end()) {
    if (seen_.size() == kMost) seen_.clear();
    seen_[fault] = now;
    return true;
  }
  const bool was_away = now - found->second > kAway;
  found->second = now;
  return was_away;
}

}  // namespace smoke_ground_reconstruction
