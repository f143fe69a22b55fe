#include <gtest/gtest.h>

#include "smoke_ground_reconstruction/ros/room_findings.hpp"

namespace smoke_ground_reconstruction {
namespace {

const GivenHeight kGiven{0.70, "sensor_height"};

FloorModel floorAt(double height, FloorSource source = FloorSource::kMeasured) {
  FloorModel floor;
  floor.plane = {0.0, 0.0, -height};
  floor.source = source;
  return floor;
}

TEST(HeightWarning, NamesTheGivenAndTheMeasuredHeight) {
  EXPECT_EQ(heightWarning(floorAt(0.81), kGiven),
            "sensor_height puts the sensor 0.70 m above the floor, measured is 0.81 m");
  EXPECT_EQ(heightWarning(floorAt(0.72), kGiven), "");
}

TEST(HeightWarning, SaysWhereNoFloorIsSeen) {
  const auto warning = heightWarning(floorAt(0.70, FloorSource::kMounting), kGiven);
  EXPECT_NE(warning.find("not measured, sensor_height is believed"), std::string::npos);
}

TEST(Findings, NameWhatTellsTheHeightWhereNothingMeasuresIt) {
  const FloorModel floor = floorAt(0.70, FloorSource::kMounting);
  EXPECT_EQ(findingsOf(floor, {}, {0.70, "tf from 'base_link'"})[2].second, "tf from 'base_link'");
}

TEST(Findings, TellHowFarTheSensorSees) {
  const auto found = findingsOf(floorAt(0.81), {0.3, 0.03}, kGiven);
  ASSERT_EQ(found.size(), 6U);
  EXPECT_EQ(found[0].second, "0.700");
  EXPECT_EQ(found[1].second, "0.810");
  EXPECT_EQ(found[2].second, "this scan");
  EXPECT_EQ(found[3].second, "0.300");
  EXPECT_EQ(found[5].second, "10.0");  // ln(20) / 0.3
  EXPECT_EQ(findingsOf(floorAt(0.81), {}, kGiven)[5].second, "unknown");
}

}  // namespace
}  // namespace smoke_ground_reconstruction
