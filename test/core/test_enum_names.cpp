#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "smoke_ground_reconstruction/enum_names.hpp"

namespace smoke_ground_reconstruction {
namespace {

TEST(EnumNames, AreThoseOfCfgAndYaml) {
  EXPECT_EQ(enumName(ThetaUnit::kRadians), "radians");
  EXPECT_EQ(enumName(DenoiserEngine::kKdTree), "kdtree");
  EXPECT_EQ(enumName(RangeStepRule::kMinimum), "minimum");
  EXPECT_EQ(enumName(RangeStepRule::kIncreasing), "increasing");
  EXPECT_EQ(enumName(RangeStepRule::kAny), "any");
  EXPECT_EQ(enumName(LabelPoint::kSecond), "second");
  EXPECT_EQ(enumName(ClusterEngine::kGrid), "grid");
  EXPECT_EQ(enumName(WallDistance::kPlanarRange), "planar_range");
  EXPECT_EQ(enumName(ReconstructionMethod::kPolarSegments), "polar_segments");
  EXPECT_EQ(enumName(ReconstructionMethod::kRoomBoundary), "room_boundary");
}

TEST(ParseEnum, FindsTheValueOfAName) {
  EXPECT_EQ(parseEnum<ThetaUnit>("theta_unit", "degrees"), ThetaUnit::kDegrees);
  EXPECT_EQ(parseEnum<RangeStepRule>("rule", "any"), RangeStepRule::kAny);
}

TEST(ParseEnum, ListsTheNamesThereAre) {
  try {
    parseEnum<DenoiserEngine>("engine", "octree");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()), "engine must be one of window, kdtree, is octree");
  }
}

TEST(ParseEnum, DistinguishesCase) {
  EXPECT_THROW(parseEnum<DenoiserEngine>("engine", "Window"), std::invalid_argument);
  EXPECT_THROW(parseEnum<DenoiserEngine>("engine", ""), std::invalid_argument);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
