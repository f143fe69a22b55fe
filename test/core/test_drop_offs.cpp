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
  /// Ten returns of a wall at a range, 0.15 m high the highest, and nothing below the floor.
  void addFoot(std::size_t column, double planar) {
    feet.distance.resize(kColumns, 0.0);
    feet.distance[column] = planar;
    for (int k = 0; k < 10; ++k) {
      feet.column.push_back(static_cast<std::uint16_t>(column));
      feet.height.push_back(0.15F - 0.005F * static_cast<float>(k));
    }
  }
  DropOffs find(const std::vector<std::array<double, 2>>& walls = {{1.0, 0.0}}) const {
    DropOffs drops;
    DropOffFinder().find(returns, kSensorHeight, middles(), walls, feet, DropTolerances(), &drops);
    return drops;
  }

  WallFeet feet;
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

TEST(DropOffs, NeedTwoWitnessesWhereThereAreTwo) {
  Scene scene;
  scene.addFloor(10, 1.8);
  scene.addCrossing(10, 2.0);
  EXPECT_NEAR(scene.find().begin[10], 1.78, 1e-6);  // no other return tells of a drop
  for (const double planar : {2.0, 2.2}) scene.addCrossing(500, planar);
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

TEST(DropOffs, EndAtAnEdgeThatSingleReturnsShowFarApart) {
  Scene scene;
  const auto middle = middles();
  for (const std::size_t c : {810UL, 850UL, 80UL}) {
    scene.addCrossing(c, 3.0 / middle[c].cosine);
    scene.addFloor(c, 2.0 / middle[c].cosine);
  }
  scene.addFloor(20, 2.9 / middle[20].cosine);
  const DropOffs drops = scene.find();
  EXPECT_NEAR(drops.begin[40] * middle[40].cosine, 2.9, 0.01);
  EXPECT_GT(drops.floor_to[40], 0.0);
}

TEST(DropOffs, AreInDoubtPastTheEndOfAnEdgeThatMayRunEitherWay) {
  Scene scene;
  const auto middle = middles();
  for (std::size_t c = 82; c < 92; ++c) {  // 33 deg and on: x = 3.2, or y = 2.08, is an edge
    for (const double x : {3.2, 3.4}) scene.addCrossing(c, x / middle[c].cosine);
    scene.addFloor(c, 1.5 / middle[c].cosine);
  }
  EXPECT_EQ(scene.find({{1.0, 0.0}, {0.0, 1.0}}).is_doubted[40], 0);
  for (std::size_t c = 47; c <= 50; ++c) scene.addFloor(c, 3.3 / middle[c].cosine);
  const DropOffs drops = scene.find({{1.0, 0.0}, {0.0, 1.0}});
  EXPECT_EQ(drops.is_doubted[60], 0);  // both are drawn on
  EXPECT_EQ(drops.is_doubted[40], 1);  // y = 2.08 alone
  EXPECT_EQ(drops.is_doubted[10], 0);  // columns run along it
}

TEST(DropOffs, SpreadSidewaysNoFartherThanToAWallOfWhichNothingIsBelowTheFloor) {
  Scene scene;
  for (int k = 0; k < 3; ++k) scene.addCrossing(10, 2.0);
  scene.addFloor(10, 1.8);
  for (std::size_t c = 20; c < 40; ++c) scene.addFoot(c, 4.0);
  const DropOffs drops = scene.find({});
  EXPECT_LT(drops.begin[15], 2.0);
  // A drop from 1.8 m to the wall at 4 m would show the wall down to 0.7 (4 - 1.8) / 1.8 = 0.86 m.
  EXPECT_EQ(drops.begin[30], kInfinity);
  EXPECT_EQ(drops.begin[60], kInfinity);
  EXPECT_LT(drops.begin[890], 2.0);  // the other side is not sealed
}

TEST(DropOffs, GoOnBehindFloorThatIsNearerThanTheyAreSeen) {
  Scene scene;
  scene.addFloor(10, 1.8);
  scene.addCrossing(10, 4.0);  // nothing else tells of a drop
  for (std::size_t c = 16; c < 40; ++c) scene.addFloor(c, c < 30 ? 3.0 : 4.4);
  scene.feet.distance.assign(kColumns, 6.0);
  const DropOffs drops = scene.find({});
  EXPECT_NEAR(drops.begin[20], 2.98, 1e-6);  // 2 cm before the farthest floor
  EXPECT_EQ(drops.begin[35], kInfinity);     // floor 0.3 m beyond the crossing ends it
  scene.feet.distance.assign(kColumns, 3.4);
  EXPECT_EQ(scene.find({}).begin[20], kInfinity);  // a wall 0.4 m behind the floor does, too
}

TEST(FloorSealer, SaysHowNearADropWouldHaveToBegin) {
  Scene scene;
  scene.addFoot(100, 4.0);
  std::vector<std::uint8_t> is_open(kColumns, 0);
  std::vector<double> sealed;
  FloorSealer sealer;
  sealer.find(scene.feet, is_open, kSensorHeight, &sealed);
  // The beam to 0.15 m below the wall's foot at 4 m crosses the floor at 4 * 0.7 / 0.85 m.
  EXPECT_NEAR(sealed[100], 4.0 * 0.7 / 0.85, 1e-6);
  EXPECT_EQ(sealed[101], 0.0);  // no wall known
  is_open[102] = 1;
  sealer.find(scene.feet, is_open, kSensorHeight, &sealed);
  EXPECT_EQ(sealed[100], 0.0);
}

TEST(FloorSealer, NeedsTenReturns) {
  Scene scene;
  scene.addFoot(100, 4.0);
  scene.feet.column.pop_back();
  scene.feet.height.pop_back();
  std::vector<double> sealed;
  FloorSealer().find(scene.feet, std::vector<std::uint8_t>(kColumns, 0), kSensorHeight, &sealed);
  EXPECT_EQ(sealed[100], 0.0);
}

TEST(FloorSealer, KeepsTwelveColumnsSideBySideRoundTheCircle) {
  std::vector<double> sealed(kColumns, 0.0), steady;
  for (std::size_t k = 0; k < 12; ++k) sealed[(894 + k) % kColumns] = 3.0;
  for (std::size_t k = 0; k < 11; ++k) sealed[100 + k] = 2.0;
  FloorSealer::keepSteady(sealed, &steady);
  EXPECT_EQ(steady[894], 3.0);
  EXPECT_EQ(steady[5], 3.0);
  EXPECT_EQ(steady[6], 0.0);
  EXPECT_EQ(steady[105], 0.0);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
