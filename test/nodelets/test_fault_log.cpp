#include <gtest/gtest.h>

#include <string>

#include "smoke_ground_reconstruction/ros/fault_log.hpp"

namespace smoke_ground_reconstruction {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const FaultLog::Clock::time_point kBegin;

TEST(FaultLog, TellsOnceOfAFaultThatEachScanHas) {
  FaultLog log;
  EXPECT_TRUE(log.isNews("no field 'x'", kBegin));
  for (int scan = 1; scan < 10000; ++scan) {
    EXPECT_FALSE(log.isNews("no field 'x'", kBegin + milliseconds(100) * scan));
  }
}

TEST(FaultLog, TellsAgainOfAFaultThatWasAway) {
  FaultLog log;
  EXPECT_TRUE(log.isNews("no transform", kBegin));
  EXPECT_FALSE(log.isNews("no transform", kBegin + FaultLog::kAway));
  EXPECT_TRUE(log.isNews("no transform", kBegin + 2 * FaultLog::kAway + milliseconds(1)));
}

TEST(FaultLog, TakesFaultsForOneThatDifferInNumbersAlone) {
  FaultLog log;
  EXPECT_TRUE(log.isNews("0.70 m given, measured 0.81 m", kBegin));
  EXPECT_FALSE(log.isNews("0.70 m given, measured 1.04 m", kBegin));
  EXPECT_TRUE(log.isNews("0.70 ft given, measured 0.81 ft", kBegin));
}

TEST(FaultLog, ForgetsRatherThanGrows) {
  FaultLog log;
  for (std::size_t length = 1; length < 1000; ++length) {
    EXPECT_TRUE(log.isNews(std::string(length, 'x'), kBegin + seconds(1)));
  }
}

}  // namespace
}  // namespace smoke_ground_reconstruction
