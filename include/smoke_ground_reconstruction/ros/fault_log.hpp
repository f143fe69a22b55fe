#pragma once

#include <chrono>
#include <map>
#include <string>

namespace smoke_ground_reconstruction {

/// Tells of a fault when it begins, and not with each scan that has it. Not for several threads at
/// once.
class FaultLog {
 public:
  using Clock = std::chrono::steady_clock;

  /// How long a fault must be away to be news again.
  static constexpr std::chrono::seconds kAway{60};

  /// Is there to be told of a fault now?
  /// \param text  of the fault; faults whose texts differ in digits alone are one.
  bool isNews(const std::string& text, Clock::time_point now = Clock::now());

 private:
  std::map<std::string, Clock::time_point> seen_;  // at last, by text without digits
};

}  // namespace smoke_ground_reconstruction
