#include <gtest/gtest.h>

#include "smoke_ground_reconstruction/ros/room_findings.hpp"

namespace smoke_ground_reconstruction {
namespace {

FloorModel floorAt(double height, FloorSource source = FloorSource::kMeasured) {
  FloorModel floor;
  floor.plane = {0.0, 0.0, -height};
  floor.source = source;
  return floor;
}

TEST(HeightWarning, NamesTheGivenAndTheMeasuredHeight) {
  EXPECT_EQ(heightWarning(floorAt(0.81), 0.70),
            "sensor_height is given as 0.70 m, measured 0.81 m");
  EXPECT_EQ(heightWarning(floorAt(0.72), 0.70), "");
}

TEST(HeightWarning, SaysWhereNoFloorIsSeen) {
  const auto warning = heightWarning(floorAt(0.70, FloorSource::kMounting), 0.70);
  EXPECT_NE(warning.find("not measured"), std::string::npos);
}

TEST(Findings, TellHowFarTheSensorSees) {
  const auto found = findingsOf(floorAt(0.81), {0.3, 0.03}, 0.70);
  ASSERT_EQ(found.size(), 6U);
  EXPECT_EQ(found[0].second, "0.700");
  EXPECT_EQ(found[1].second, "0.810");
  EXPECT_EQ(found[2].second, "this scan");
  EXPECT_EQ(found[3].second, "0.300");
  EXPECT_EQ(found[5].second, "10.0");  // ln(20) / 0.3
  EXPECT_EQ(findingsOf(floorAt(0.81), {}, 0.70)[5].second, "unknown");
}

}  // namespace
}  // namespace smoke_ground_reconstruction
