#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"

namespace smoke_ground_reconstruction {
namespace {

using Labels = std::vector<Label>;
using Params = ChannelSegmentationParams;

constexpr Label kKept = Label::kKept;
constexpr Label kGround = Label::kGround;
constexpr Label kWall = Label::kWall;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const SensorModel& eightBeams() {  // ring 0 the lowest
  static const auto sensor = SensorModel::fromElevations(evenElevations(8, -70.0, 70.0));
  return sensor;
}

Labels classify(const Cloud& cloud, const Params& params = Params(),
                const SensorModel& sensor = eightBeams()) {
  const Labels labels(cloud.size(), kKept);
  return ChannelSegmentation(params).classify(Scan(cloud.view()), labels, sensor);
}

/// Label of the lower of two points of one column at (planar range, height).
Label lowerOf(double r1, double z1, double r2, double z2, const Params& params = Params()) {
  Cloud cloud;
  cloud.add(r1, 0, z1, 0);
  cloud.add(r2, 0, z2, 1);
  return classify(cloud, params)[0];
}

double tangent(double angle_deg) { return std::tan(angle_deg * M_PI / 180.0); }

TEST(ChannelSegmentation, OfNothingSaysNothing) { EXPECT_TRUE(classify(Cloud()).empty()); }

TEST(ChannelSegmentation, LeavesTheOnlyPointUndecided) {
  Cloud cloud;
  cloud.add(2, 0, -0.7, 0);
  EXPECT_EQ(classify(cloud), Labels{kKept});
}

TEST(ChannelSegmentation, NeverPairsARingWithItself) {
  Cloud cloud;
  for (int i = 0; i < 5; ++i) cloud.add(2.0 + 0.1 * i, 0, -0.7, 3);
  EXPECT_EQ(classify(cloud), Labels(5, kKept));
}

TEST(ChannelSegmentation, LabelsTheFirstPointOfAGroundPair) {  // Algorithm 4 line 12: p_i
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(2.1, 0, -0.7, 1);
  EXPECT_EQ(classify(cloud), (Labels{kGround, kKept}));
}

TEST(ChannelSegmentation, LabelsTheSecondPointOnRequest) {
  Params params;
  params.label_point = LabelPoint::kSecond;
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(2.1, 0, -0.7, 1);
  EXPECT_EQ(classify(cloud, params), (Labels{kKept, kGround}));
}

TEST(ChannelSegmentation, AcceptsFloorsInclinedUpToThreeDegrees) {
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(lowerOf(2.0, -0.7, 2.5, -0.7 + sign * 0.5 * tangent(2.99)), kGround);
    EXPECT_EQ(lowerOf(2.0, -0.7, 2.5, -0.7 + sign * 0.5 * tangent(3.01)), kKept);
  }
}

TEST(ChannelSegmentation, LimitsTheHeightStepOfGround) {
  Params params;
  params.max_ground_step_height = 0.0625;
  EXPECT_EQ(lowerOf(2.0, -0.75, 6.0, -0.6875, params), kGround);  // just 0.0625: allowed
  EXPECT_EQ(lowerOf(2.0, -0.75, 6.0, -0.6874, params), kKept);
  EXPECT_EQ(lowerOf(2.0, -0.6874, 6.0, -0.75, params), kKept);
}

TEST(ChannelSegmentation, HasTheThesisHeightStepOfFiveCentimetres) {
  EXPECT_EQ(lowerOf(2.0, -0.7, 6.0, -0.651), kGround);
  EXPECT_EQ(lowerOf(2.0, -0.7, 6.0, -0.649), kKept);
}

TEST(ChannelSegmentation, HeightStepZeroMeansUnlimitedGround) {
  Params params;
  params.max_ground_step_height = 0.0;
  EXPECT_EQ(lowerOf(2.0, -0.7, 12.0, -0.3, params), kGround);  // 2.3 deg
}

TEST(ChannelSegmentation, AsksAtLeastThreeCentimetresMoreRange) {  // the thesis's feature
  EXPECT_EQ(lowerOf(2.0, 0.0, 2.029, 0.0), kKept);
  EXPECT_EQ(lowerOf(2.0, 0.0, 2.031, 0.0), kGround);
}

TEST(ChannelSegmentation, AcceptsARangeStepOfJustTheMinimum) {
  Params params;
  params.min_range_step = 0.03125;
  EXPECT_EQ(lowerOf(2.0, 0.0, 2.03125, 0.0, params), kGround);
}

TEST(ChannelSegmentation, TakesTheRangeStepInThreeDimensions) {
  // Planar 40 mm, but seen steeply from above only 2 mm more range.
  EXPECT_EQ(lowerOf(0.1, -2.0, 0.14, -2.0), kKept);
}

TEST(ChannelSegmentation, AsksForAnyGrowthInTheOriginalForm) {  // Chu et al.
  Params params;
  params.ground_range_step = RangeStepRule::kIncreasing;
  EXPECT_EQ(lowerOf(2.0, 0.0, 2.001, 0.0, params), kGround);
  // A rise of 2.9 deg under the sensor: planar range grows, range shrinks.
  EXPECT_EQ(lowerOf(0.10, -4.0, 0.11, -3.9995, params), kKept);
}

TEST(ChannelSegmentation, AsksForNoGrowthWithoutTheRule) {
  Params params;
  params.ground_range_step = RangeStepRule::kAny;
  EXPECT_EQ(lowerOf(0.10, -4.0, 0.11, -3.9995, params), kGround);
}

TEST(ChannelSegmentation, DoesNotTakeAStepTowardsTheSensorForGround) {
  Params params;
  params.ground_range_step = RangeStepRule::kAny;
  EXPECT_EQ(lowerOf(2.1, -0.7, 2.0, -0.7, params), kKept);  // 180 deg
  EXPECT_EQ(lowerOf(2.1, 1.3, 2.0, 1.3, params), kKept);    // the ceiling
}

TEST(ChannelSegmentation, MarginIsOffForGroundByDefault) {
  EXPECT_EQ(lowerOf(2.0, 0.0, 4.0, 0.0), kGround);
}

TEST(ChannelSegmentation, MarginLimitsGroundOnRequest) {
  Params params;
  params.ground_relative_margin = true;  // 15 % of the first point's range
  EXPECT_EQ(lowerOf(2.0, 0.0, 2.29, 0.0, params), kGround);
  EXPECT_EQ(lowerOf(2.0, 0.0, 2.31, 0.0, params), kKept);
}

TEST(ChannelSegmentation, AcceptsAVerticalWallBelowAndAboveTheSensor) {
  EXPECT_EQ(lowerOf(3.0, -0.7, 3.0, -0.6), kWall);  // range shrinks: no range step for walls
  EXPECT_EQ(lowerOf(3.0, 0.6, 3.0, 0.7), kWall);
}

TEST(ChannelSegmentation, AcceptsWallsFrom60To120Degrees) {
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0 + 0.1 / tangent(60.1), 0.1), kWall);
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0 + 0.1 / tangent(59.9), 0.1), kKept);
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0 - 0.1 / tangent(60.1), 0.1), kWall);  // 119.9 deg
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0 - 0.1 / tangent(59.9), 0.1), kKept);  // 120.1 deg
}

TEST(ChannelSegmentation, DoesNotTakeAFallForAWall) {
  EXPECT_EQ(lowerOf(3.0, 0.1, 3.0, 0.0), kKept);
}

TEST(ChannelSegmentation, MarginLimitsWallsByDefault) {
  // Right before the sensor: range 1.12 m, then 0.71 m, that is 37 % less.
  EXPECT_EQ(lowerOf(0.5, -1.0, 0.5, -0.5), kKept);
  Params params;
  params.wall_relative_margin = false;
  EXPECT_EQ(lowerOf(0.5, -1.0, 0.5, -0.5, params), kWall);
}

TEST(ChannelSegmentation, AcceptsAChangeOfRangeOfJustTheMargin) {
  Params params;
  params.relative_distance_margin = 0.25;
  EXPECT_EQ(lowerOf(0.0, 1.0, 0.0, 1.25, params), kWall);
  EXPECT_EQ(lowerOf(0.0, 1.0, 0.0, 1.2501, params), kKept);
  EXPECT_EQ(lowerOf(0.0, -1.0, 0.0, -0.75, params), kWall);
}

TEST(ChannelSegmentation, LimitsTheHeightStepOfWallsOnRequest) {
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0, 0.9), kWall);
  Params params;
  params.max_wall_step_height = 0.5;
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0, 0.5, params), kWall);
  EXPECT_EQ(lowerOf(3.0, 0.0, 3.0, 0.51, params), kKept);
}

TEST(ChannelSegmentation, TheRangeStepWouldDeleteTheFootOfAWall) {
  Params params;
  params.wall_range_step = RangeStepRule::kMinimum;
  EXPECT_EQ(lowerOf(3.0, -0.7, 3.0, -0.6, params), kKept);
  EXPECT_EQ(lowerOf(3.0, 0.6, 3.0, 0.9, params), kWall);
}

TEST(ChannelSegmentation, CallsAWallWhatFitsBothWindows) {
  Params params;
  params.min_wall_angle_deg = -10.0;
  EXPECT_EQ(lowerOf(2.0, -0.7, 2.1, -0.7, params), kWall);
}

TEST(ChannelSegmentation, AWallStaysAWallWhateverTheNextPairSays) {
  Params params;
  params.label_point = LabelPoint::kSecond;
  for (const bool wall_first : {true, false}) {
    Cloud cloud;  // two points of ring 0 share their partner in ring 1
    const double x[] = {2.0, 1.9};
    const double z[] = {-0.2, -0.1};
    const std::size_t order[] = {wall_first ? 0U : 1U, wall_first ? 1U : 0U};
    for (const std::size_t k : order) cloud.add(x[k], 0, z[k], 0);
    cloud.add(2.0, 0, -0.1, 1);
    EXPECT_EQ(classify(cloud, params)[2], kWall);
  }
}

TEST(ChannelSegmentation, PairsWithinAColumnOnly) {
  Cloud cloud;
  cloud.addPolar(0.39, 2.0, -0.7, 0);
  cloud.addPolar(0.41, 2.1, -0.7, 1);
  EXPECT_EQ(classify(cloud), Labels(2, kKept));
  Params params;
  params.column_width_deg = 1.0;
  EXPECT_EQ(classify(cloud, params), (Labels{kGround, kKept}));
}

TEST(ChannelSegmentation, EndsAColumnAtTheAzimuthWrap) {
  Cloud cloud;
  cloud.addPolar(359.99, 2.0, -0.7, 0);
  cloud.addPolar(0.01, 2.1, -0.7, 1);
  EXPECT_EQ(classify(cloud), Labels(2, kKept));
}

TEST(ChannelSegmentation, PairsBehindTheSensorToo) {
  Cloud cloud;
  cloud.addPolar(180.01, 2.0, -0.7, 0);
  cloud.addPolar(180.39, 2.1, -0.7, 1);
  EXPECT_EQ(classify(cloud), (Labels{kGround, kKept}));
}

TEST(ChannelSegmentation, SkipsRingsThatAreMissing) {
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(2.5, 0, -0.7, 5);
  EXPECT_EQ(classify(cloud), (Labels{kGround, kKept}));
}

TEST(ChannelSegmentation, PairsWithTheNearestPointOfTheNextRing) {
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(2.0, 0, -0.1, 1);  // 0.6 m above
  cloud.add(2.1, 0, -0.7, 1);  // 0.1 m on
  EXPECT_EQ(classify(cloud)[0], kGround);
}

TEST(ChannelSegmentation, PairsWithTheLowerIndexOfEquallyNearPoints) {
  for (const bool ground_first : {true, false}) {
    Cloud cloud;
    cloud.add(2.0, 0, 0.0, 0);
    if (ground_first) cloud.add(2.125, 0, 0.0, 1);
    cloud.add(2.0, 0, 0.125, 1);
    if (!ground_first) cloud.add(2.125, 0, 0.0, 1);
    EXPECT_EQ(classify(cloud)[0], ground_first ? kGround : kWall);
  }
}

TEST(ChannelSegmentation, PairsWithThePointThatIsNearerByAHair) {
  const double farther = std::nextafter(0.125F, 1.0F);
  for (const bool is_wall_nearer : {true, false}) {
    Cloud cloud;
    cloud.add(2.0, 0, 0.0, 0);
    cloud.add(2.0, 0, is_wall_nearer ? 0.125 : farther, 1);
    cloud.add(is_wall_nearer ? 2.125 + 2.4e-7 : 2.125, 0, 0.0, 1);
    EXPECT_EQ(classify(cloud)[0], is_wall_nearer ? kWall : kGround);
  }
}

TEST(ChannelSegmentation, JudgesEveryPointOfARingInAColumn) {  // dual returns
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(1.0, 0, -0.35, 0);
  cloud.add(2.1, 0, -0.7, 1);
  EXPECT_EQ(classify(cloud), (Labels{kGround, kKept, kKept}));
}

TEST(ChannelSegmentation, LeavesPairsOfPointsInTheSamePlaceUndecided) {
  Params params;
  params.ground_range_step = RangeStepRule::kAny;
  EXPECT_EQ(lowerOf(2.0, -0.7, 2.0, -0.7, params), kKept);
}

TEST(ChannelSegmentation, FollowsTheElevationsNotTheRingNumbers) {
  const auto reversed = SensorModel::fromElevations({10.0, 0.0, -10.0});
  Cloud cloud;
  cloud.add(2.1, 0, -0.7, 0);
  cloud.add(2.0, 0, -0.7, 2);
  EXPECT_EQ(classify(cloud, Params(), reversed), (Labels{kKept, kGround}));
}

TEST(ChannelSegmentation, LooksAtKeptPointsOnly) {
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(2.05, 0, -0.2, 1);  // smoke
  cloud.add(2.1, 0, -0.7, 2);
  cloud.add(0, 0, 0, 3);
  const Labels labels = {kKept, Label::kNoise, kKept, Label::kInvalid};
  EXPECT_EQ(ChannelSegmentation(Params()).classify(Scan(cloud.view()), labels, eightBeams()),
            (Labels{kGround, Label::kNoise, kKept, Label::kInvalid}));
}

TEST(ChannelSegmentation, PassesOverInvalidPointsAndUnknownRings) {
  Cloud cloud;
  cloud.add(2.0, 0, -0.7, 0);
  cloud.add(kNan, 0, -0.7, 1);
  cloud.add(2.05, 0, -0.7, 200);
  cloud.add(2.1, 0, -0.7, 2);
  EXPECT_EQ(classify(cloud), (Labels{kGround, kKept, kKept, kKept}));
}

TEST(ChannelSegmentation, FindsTheFloorAndTheWallsOfABoxRoom) {
  BoxRoom room;
  room.elevations_deg = evenElevations(33, -50.0, 50.0);
  std::vector<Surface> surfaces;
  const Cloud cloud = room.scan(&surfaces);
  const auto sensor = SensorModel::fromElevations(room.elevations_deg);
  const Labels labels = classify(cloud, Params(), sensor);
  for (std::size_t i = 0; i + 1 < cloud.size(); ++i) {
    const bool same_surface = cloud.ring[i] < 32 && surfaces[i] == surfaces[i + 1];
    if (!same_surface) continue;  // edges between surfaces and the highest ring
    const Label truth = surfaces[i] == Surface::kFloor  ? kGround
                        : surfaces[i] == Surface::kWall ? kWall
                                                        : kKept;
    ASSERT_EQ(labels[i], truth) << "point " << i;
  }
}

/// A room, every n-th point of it once more and twice more, some of it smoke.
Cloud roomWithRepeats(std::size_t n) {
  BoxRoom room;
  room.elevations_deg = evenElevations(16, -50.0, 30.0);
  Cloud cloud = room.scan();
  for (std::size_t i = 0, size = cloud.size(); i < size; i += n) {
    for (const double times : {1.02, 1.2}) {
      if (times > 1.1 && i % 64 != 0) continue;
      cloud.add(times * cloud.x[i], times * cloud.y[i], times * cloud.z[i], cloud.ring[i]);
    }
  }
  return cloud;
}

TEST(ChannelSegmentation, TakesTheRasterOfAllPoints) {
  const auto sensor = SensorModel::fromElevations(evenElevations(16, -50.0, 30.0));
  for (const std::size_t n : {1U, 64U, 100000U}) {  // a second layer, extras, neither
    const Cloud cloud = roomWithRepeats(n);
    const Scan scan(cloud.view());
    Uniform uniform(static_cast<unsigned>(n));
    Labels labels;
    while (labels.size() < scan.size()) {
      labels.push_back(uniform(0.0, 1.0) < 0.3 ? Label::kNoise : kKept);
    }
    const ScanRaster raster(scan, Labels(scan.size(), kKept), AzimuthBins(0.4));
    ASSERT_FALSE(raster.is_crowded);
    Params params;
    for (const LabelPoint label_point : {LabelPoint::kFirst, LabelPoint::kSecond}) {
      params.label_point = label_point;
      const ChannelSegmentation segmentation(params);
      const Labels alone = segmentation.classify(scan, labels, sensor);
      std::optional<ScanRaster> lent(raster);
      EXPECT_EQ(segmentation.classify(scan, labels, sensor, &lent), alone) << "every " << n;
      EXPECT_GT(std::count(alone.begin(), alone.end(), kWall), 100);
    }
  }
}

TEST(ChannelSegmentation, LabelsAShuffledScanAlike) {
  BoxRoom room;
  room.elevations_deg = evenElevations(16, -50.0, 30.0);
  const Cloud cloud = room.scan();
  const auto sensor = SensorModel::fromElevations(room.elevations_deg);
  const auto order = shuffledIndices(cloud.size(), 2);
  const Labels plain = classify(cloud, Params(), sensor);
  const Labels shuffled = classify(cloud.select(order), Params(), sensor);
  for (std::size_t i = 0; i < order.size(); ++i) ASSERT_EQ(shuffled[i], plain[order[i]]);
}

TEST(ChannelSegmentationParams, AcceptsEveryLimit) {
  Params params;
  params.min_ground_angle_deg = -180.0;
  params.max_ground_angle_deg = -180.0;
  params.min_wall_angle_deg = 0.1;
  params.max_wall_angle_deg = 180.0;
  params.min_range_step = 0.0;
  params.column_width_deg = 90.0;
  EXPECT_NO_THROW(params.validate());
}

void expectRefusal(const std::string& name, const std::function<void(Params*)>& spoil) {
  Params params;
  spoil(&params);
  try {
    const ChannelSegmentation segmentation(params);
    ADD_FAILURE() << name << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).rfind(name + " must be ", 0), 0U) << error.what();
  }
}

TEST(ChannelSegmentationParams, NamesTheParameterItRefuses) {
  expectRefusal("column_width_deg", [](Params* p) { p->column_width_deg = 0.7; });
  expectRefusal("column_width_deg", [](Params* p) { p->column_width_deg = kNan; });
  expectRefusal("min_ground_angle_deg", [](Params* p) { p->min_ground_angle_deg = 3.1; });
  expectRefusal("min_ground_angle_deg", [](Params* p) { p->min_ground_angle_deg = -181.0; });
  expectRefusal("max_ground_angle_deg", [](Params* p) { p->max_ground_angle_deg = 177.0; });
  expectRefusal("min_wall_angle_deg", [](Params* p) { p->min_wall_angle_deg = kNan; });
  expectRefusal("max_wall_angle_deg", [](Params* p) { p->max_wall_angle_deg = 181.0; });
  expectRefusal("max_ground_step_height", [](Params* p) { p->max_ground_step_height = -0.01; });
  expectRefusal("max_wall_step_height", [](Params* p) { p->max_wall_step_height = -0.01; });
  expectRefusal("min_range_step", [](Params* p) { p->min_range_step = -0.01; });
  expectRefusal("relative_distance_margin", [](Params* p) { p->relative_distance_margin = 0.0; });
}

}  // namespace
}  // namespace smoke_ground_reconstruction
