#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "smoke_ground_reconstruction/drop_offs.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSensorHeight = 0.7;
constexpr std::size_t kColumns = 900;

std::vector<Direction> middles() {
  std::vector<Direction> middle;
  for (std::size_t c = 0; c < kColumns; ++c) {
    middle.push_back(Direction::fromDegrees(0.4 * (static_cast<double>(c) + 0.5)));
  }
  return middle;
}

struct Scene {
  DropOffReturns returns;

  void add(std::size_t column, double planar, double height) {
    returns.column.push_back(static_cast<std::uint16_t>(column));
    returns.planar.push_back(static_cast<float>(planar));
    returns.height.push_back(static_cast<float>(height));
    returns.is_floor.push_back(height == 0.0 ? 1 : 0);
  }
  void addFloor(std::size_t column, double planar) { add(column, planar, 0.0); }
  /// A beam that crosses the floor at r reaches as deep below it as the sensor is high at 2 r.
  void addCrossing(std::size_t column, double planar) { add(column, 2.0 * planar, -kSensorHeight); }
  DropOffs find(const std::vector<std::array<double, 2>>& walls = {{1.0, 0.0}}) const {
    DropOffs drops;
    DropOffFinder().find(returns, kSensorHeight, middles(), walls, &drops);
    return drops;
  }
};

TEST(DropOffs, OfNothingAreNone) {
  const DropOffs drops = Scene().find();
  ASSERT_EQ(drops.begin.size(), kColumns);
  for (std::size_t c = 0; c < kColumns; ++c) {
    EXPECT_EQ(drops.begin[c], kInfinity);
    EXPECT_EQ(drops.floor_to[c], 0.0);
  }
}

TEST(DropOffs, EndTheFloorBeforeTheBeamThatFellThrough) {
  Scene scene;
  scene.addFloor(10, 1.8);
  for (int k = 0; k < 3; ++k) scene.addCrossing(10, 2.0);
  const DropOffs drops = scene.find();
  EXPECT_NEAR(drops.begin[10], 1.78, 1e-6);  // 2 cm before the last measured floor
  EXPECT_TRUE(drops.hides(10, 1.9));
  EXPECT_FALSE(drops.hides(10, 1.7));
  EXPECT_FALSE(drops.hides(500, 1.9));
}

TEST(DropOffs, LetTheFloorGoOnWhereItIsMeasuredAgain) {
  Scene scene;
  scene.addFloor(10, 1.8);
  for (int k = 0; k < 3; ++k) scene.addCrossing(10, 2.0);
  for (int k = 0; k < 3; ++k) scene.addFloor(10, 2.9 + 0.1 * k);
  const DropOffs drops = scene.find();
  EXPECT_TRUE(drops.hides(10, 2.92));  // the first 3 cm may lie over the pit
  EXPECT_FALSE(drops.hides(10, 2.94));
}

TEST(DropOffs, NeedTwoWitnesses) {
  Scene scene;
  scene.addCrossing(10, 2.0);
  EXPECT_EQ(scene.find().begin[10], kInfinity);
}

/// A ledge at x = 3 seen in two sectors; floor up to 2.5 there, and up to 2.94 at 8 deg.
Scene ledge() {
  Scene scene;
  const auto middle = middles();
  const auto add = [&](std::size_t column) {
    scene.addCrossing(column, 3.06 / middle[column].cosine);
    scene.addCrossing(column, 3.4 / middle[column].cosine);
    scene.addFloor(column, 2.5 / middle[column].cosine);
  };
  for (std::size_t c = 85; c <= 100; ++c) {
    add(c);
    add(kColumns - c);
  }
  scene.addFloor(20, 2.94 / middle[20].cosine);
  return scene;
}

TEST(DropOffs, EndAtAStraightEdgeInColumnsThatShowNeitherSide) {
  const DropOffs drops = ledge().find();
  const auto middle = middles();
  for (const std::size_t c : {810UL, 860UL, 0UL, 50UL, 90UL}) {
    EXPECT_NEAR(drops.begin[c] * middle[c].cosine, 2.94, 4e-3) << "column " << c;
    EXPECT_EQ(drops.floor_to[c], drops.begin[c]);
  }
}

TEST(DropOffs, TellOfNoFloorAlongEdgesAskewToTheWalls) {
  const double half = std::sqrt(0.5);
  const DropOffs drops = ledge().find({{half, half}});
  for (const double floor_to : drops.floor_to) EXPECT_EQ(floor_to, 0.0);
  EXPECT_LT(drops.begin[90], kInfinity);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
