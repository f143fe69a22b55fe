#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {
namespace {

using Rings = std::vector<std::uint16_t>;

constexpr double kDegree = M_PI / 180.0;

void addBeam(Cloud* cloud, double elevation_deg, int ring, int points = 5) {
  for (int i = 0; i < points; ++i) {
    cloud->addPolar(i * 7.0, 2.0 + i, (2.0 + i) * std::tan(elevation_deg * kDegree), ring);
  }
}

Rings orderAfter(const Cloud& cloud) {
  SensorModel sensor;
  sensor.observe(cloud.view());
  return sensor.ringsByElevation();
}

TEST(SensorModel, KnowsNoRingAtFirst) {
  const SensorModel sensor;
  EXPECT_TRUE(sensor.ringsByElevation().empty());
  EXPECT_EQ(sensor.rank(0), SensorModel::kNoRank);
  EXPECT_EQ(sensor.rank(0xFFFF), SensorModel::kNoRank);
}

TEST(SensorModel, LearnsNothingFromAnEmptyScan) { EXPECT_TRUE(orderAfter(Cloud()).empty()); }

TEST(SensorModel, LearnsARingFromOnePoint) {
  Cloud cloud;
  cloud.add(1, 0, -0.5, 3);
  SensorModel sensor;
  sensor.observe(cloud.view());
  EXPECT_EQ(sensor.ringsByElevation(), Rings{3});
  EXPECT_EQ(sensor.rank(3), 0);
  EXPECT_EQ(sensor.tangent(3), -0.5);
  EXPECT_EQ(sensor.rank(0), SensorModel::kNoRank);
}

TEST(SensorModel, OrdersBeamsWhoseNumbersRunUpward) {
  Cloud cloud;
  for (int ring = 0; ring < 4; ++ring) addBeam(&cloud, -20.0 + 10.0 * ring, ring);
  EXPECT_EQ(orderAfter(cloud), (Rings{0, 1, 2, 3}));
}

TEST(SensorModel, OrdersBeamsWhoseNumbersRunDownward) {
  Cloud cloud;
  for (int ring = 0; ring < 4; ++ring) addBeam(&cloud, 10.0 - 10.0 * ring, ring);
  EXPECT_EQ(orderAfter(cloud), (Rings{3, 2, 1, 0}));
}

TEST(SensorModel, OrdersInterleavedBeams) {  // as the last 32 rings of a QT128
  Cloud cloud;
  addBeam(&cloud, -10.0, 0);
  addBeam(&cloud, 10.0, 1);
  addBeam(&cloud, 20.0, 2);
  addBeam(&cloud, 5.0, 3);
  addBeam(&cloud, 15.0, 4);
  EXPECT_EQ(orderAfter(cloud), (Rings{0, 3, 1, 4, 2}));
}

TEST(SensorModel, OrdersEqualElevationsByRingNumber) {
  Cloud cloud;
  addBeam(&cloud, 0.0, 5);
  addBeam(&cloud, 0.0, 2);
  EXPECT_EQ(orderAfter(cloud), (Rings{2, 5}));
}

TEST(SensorModel, DoesNotHangOnTheOrderOfPoints) {
  BoxRoom room;
  room.elevations_deg = evenElevations(16, -30.0, 30.0);
  room.azimuths = 36;
  const Cloud cloud = room.scan();
  EXPECT_EQ(orderAfter(cloud), orderAfter(cloud.select(shuffledIndices(cloud.size(), 5))));
}

TEST(SensorModel, TakesTheLowerMedianOfARing) {
  Cloud cloud;
  for (const double z : {0.4, 0.1, 0.3, 0.2}) cloud.add(1, 0, z, 0);
  SensorModel sensor;
  sensor.observe(cloud.view());
  EXPECT_EQ(sensor.tangent(0), static_cast<double>(0.2F));
}

TEST(SensorModel, IgnoresNonFiniteZeroAndVerticalPoints) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Cloud cloud;
  cloud.add(kNan, 0, 1, 0);
  cloud.add(1, kInf, 1, 1);
  cloud.add(0, 0, 0, 2);
  cloud.add(0, 0, -1, 3);
  EXPECT_TRUE(orderAfter(cloud).empty());
}

TEST(SensorModel, IgnoresTheRingNumberThatMeansNoRank) {
  Cloud cloud;
  cloud.add(1, 0, 0, 0xFFFF);
  cloud.add(1, 0, 0, 0xFFFE);
  EXPECT_EQ(orderAfter(cloud), Rings{0xFFFE});
}

TEST(SensorModel, KeepsAClearScanAgainstASmokyOne) {
  Cloud clear;
  addBeam(&clear, -10.0, 0, 50);
  addBeam(&clear, 10.0, 1, 50);
  Cloud smoky;  // three stray returns turn the order around
  addBeam(&smoky, 30.0, 0, 3);
  addBeam(&smoky, 10.0, 1, 3);
  SensorModel sensor;
  sensor.observe(clear.view());
  sensor.observe(smoky.view());
  EXPECT_EQ(sensor.ringsByElevation(), (Rings{0, 1}));
}

TEST(SensorModel, LetsAClearScanOverruleASmokyOne) {
  Cloud smoky;
  addBeam(&smoky, 30.0, 0, 3);
  addBeam(&smoky, 10.0, 1, 3);
  Cloud clear;
  addBeam(&clear, -10.0, 0, 50);
  addBeam(&clear, 10.0, 1, 50);
  SensorModel sensor;
  sensor.observe(smoky.view());
  EXPECT_EQ(sensor.ringsByElevation(), (Rings{1, 0}));
  sensor.observe(clear.view());
  EXPECT_EQ(sensor.ringsByElevation(), (Rings{0, 1}));
}

TEST(SensorModel, AddsRingsThatShowUpLater) {
  Cloud first;
  addBeam(&first, 0.0, 4);
  Cloud second;
  addBeam(&second, -5.0, 9);
  SensorModel sensor;
  sensor.observe(first.view());
  sensor.observe(second.view());
  EXPECT_EQ(sensor.ringsByElevation(), (Rings{9, 4}));
}

TEST(SensorModel, NeverOverrulesKnownBeams) {
  auto sensor = SensorModel::fromElevations({-10.0, 10.0});
  Cloud cloud;
  addBeam(&cloud, 40.0, 0, 1000);
  sensor.observe(cloud.view());
  EXPECT_EQ(sensor.ringsByElevation(), (Rings{0, 1}));
  EXPECT_NEAR(sensor.tangent(0), std::tan(-10.0 * kDegree), 1e-12);
}

TEST(SensorModel, RefusesBeamsThatAreNoElevations) {
  for (const double bad : {90.0, -90.0, 1000.0, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(SensorModel::fromElevations({0.0, bad}), std::invalid_argument) << bad;
  }
  EXPECT_THROW(SensorModel::fromElevations(std::vector<double>(70000, 0.0)), std::invalid_argument);
}

TEST(RingsFromElevation, OfNothingAreNone) {
  EXPECT_TRUE(ringsFromElevation(Cloud().view()).empty());
}

TEST(RingsFromElevation, OfOnePointIsRingZero) {
  Cloud cloud;
  cloud.add(1, 1, 1);
  EXPECT_EQ(ringsFromElevation(cloud.view()), Rings{0});
}

TEST(RingsFromElevation, CountBeamsFromTheLowest) {
  Cloud cloud;
  addBeam(&cloud, 5.0, 0, 2);
  addBeam(&cloud, -15.0, 0, 2);
  addBeam(&cloud, -5.0, 0, 2);
  EXPECT_EQ(ringsFromElevation(cloud.view()), (Rings{2, 2, 0, 0, 1, 1}));
}

TEST(RingsFromElevation, SplitOnlyAtGapsWiderThanAnyBeamsJitter) {
  Cloud cloud;
  addBeam(&cloud, 0.0, 0, 1);
  addBeam(&cloud, 0.14, 0, 1);  // 0.14 deg: the same beam
  addBeam(&cloud, 0.30, 0, 1);  // 0.16 deg on: the next
  EXPECT_EQ(ringsFromElevation(cloud.view()), (Rings{0, 0, 1}));
}

TEST(RingsFromElevation, GiveInvalidPointsRingZero) {
  Cloud cloud;
  addBeam(&cloud, 10.0, 0, 1);
  cloud.add(0, 0, 0);
  cloud.add(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  addBeam(&cloud, 20.0, 0, 1);
  EXPECT_EQ(ringsFromElevation(cloud.view()), (Rings{0, 0, 0, 1}));
}

TEST(RingsFromElevation, FindEveryBeamOfARoom) {
  BoxRoom room;
  room.elevations_deg = evenElevations(32, -50.0, 50.0);
  room.azimuths = 90;
  const Cloud cloud = room.scan();
  EXPECT_EQ(ringsFromElevation(cloud.view()), cloud.ring);
}

TEST(RingsFromElevation, CutHalfDegreesWhereBeamsRunTogether) {
  Cloud cloud;
  for (int i = 0; i <= 20; ++i) addBeam(&cloud, 0.1 * i + 0.001, 0, 1);  // 2 deg without a gap
  const Rings rings = ringsFromElevation(cloud.view());
  EXPECT_EQ(rings[0], 0);
  EXPECT_EQ(rings[4], 0);
  EXPECT_EQ(rings[6], 1);
  EXPECT_EQ(rings[11], 2);
  EXPECT_EQ(rings[19], 3);
}

TEST(RingsFromElevation, ReachFromPoleToPole) {
  Cloud cloud;
  cloud.add(0, 0, -1);
  cloud.add(0, 0, 1);
  EXPECT_EQ(ringsFromElevation(cloud.view()), (Rings{0, 1}));
}

}  // namespace
}  // namespace smoke_ground_reconstruction
