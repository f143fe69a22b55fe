#pragma once

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace smoke_ground_reconstruction {

/// Texts by name.
using Findings = std::vector<std::pair<std::string, std::string>>;

/// What a nodelet tells /diagnostics of itself: input rate, points in and kept, last processing
/// time, last drop, and what the last scan showed. Any thread may call any method.
class StageHealth {
 public:
  /// What ~input is called outside.
  void setInput(const std::string& topic);
  void setListening(bool listening);
  /// A message came in on ~input.
  void inputArrived();
  void scanDone(std::size_t points_in, std::size_t points_kept, double milliseconds);
  void scanDropped(const std::string& reason);
  /// What the last scan showed, and what is to be warned of; empty where nothing is.
  void tell(Findings findings, const std::string& warning);

  /// Fills in the state since the last report. Levels: OK idle (nobody listens) or running; WARN
  /// where input fails to come, all of it was dropped, none found its partners, or as told.
  void report(diagnostic_updater::DiagnosticStatusWrapper& status);

  /// What fails to come, where it listens and for long no scan went through or was dropped; else
  /// empty.
  std::string standstill() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Counts {
    std::size_t arrived = 0, done = 0, dropped = 0;
  };

  void summarize(diagnostic_updater::DiagnosticStatusWrapper& status) const;
  std::string whatFailsToCome(bool comes_in) const;

  mutable std::mutex mutex_;
  std::string input_ = "~input";
  bool is_listening_ = false;
  Clock::time_point last_arrival_;
  Clock::time_point last_news_;  // a scan done or dropped, or the first listener
  Clock::time_point since_ = Clock::now();
  Counts recent_;  // since the last report
  Counts total_;
  std::size_t points_in_ = 0;
  std::size_t points_kept_ = 0;
  double milliseconds_ = 0.0;
  std::string last_drop_ = "none";
  Findings findings_;
  std::string warning_;
};

}  // namespace smoke_ground_reconstruction
