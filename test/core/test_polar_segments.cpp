#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/polar_segments.hpp"

namespace smoke_ground_reconstruction {
namespace {

using Params = PolarSegmentsParams;
using Segments = std::vector<PolarSegment>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kFloor = -0.7;

/// Eight beams, ring 0 the lowest.
SensorModel upwardBeams() {
  return SensorModel::fromElevations({-40, -30, -20, -10, 0, 10, 20, 30});
}
/// The same beams numbered from the top.
SensorModel downwardBeams() {
  return SensorModel::fromElevations({30, 20, 10, 0, -10, -20, -30, -40});
}

/// Planar distances, so that hand-worked radii are round numbers.
Params planarParams() {
  Params params;
  params.wall_distance = WallDistance::kPlanarRange;
  return params;
}

/// `points` points inside segment `s` (10 deg each) at one distance, height and ring.
void addTo(Cloud* cloud, int s, double planar_range, double z, int ring, int points = 10) {
  for (int i = 0; i < points; ++i) {
    cloud->addPolar(10.0 * s + 0.5 + 0.01 * i, planar_range, z, ring);
  }
}

Segments segmentsOf(const Cloud& ground, const Cloud& walls, const Params& params = planarParams(),
                    const SensorModel& sensor = upwardBeams()) {
  return PolarSegments(params).segments(Scan(ground.view()), Scan(walls.view()), sensor,
                                        Mounting());
}

FloorSurface reconstruct(const Cloud& ground, const Cloud& walls,
                         const Params& params = planarParams(),
                         const SensorModel& sensor = upwardBeams(),
                         const Mounting& mounting = Mounting()) {
  return PolarSegments(params).reconstruct(ground.view(), walls.view(), sensor, mounting);
}

/// adjusted_z of segment 5 among walls of segments 4 to 6, NaN: no wall. All 5 m away, on ring 4.
double adjustedZ(double before, double at, double after, const Params& params = planarParams()) {
  Cloud walls;
  const double z[] = {before, at, after};
  for (int i = 0; i < 3; ++i) {
    if (!std::isnan(z[i])) addTo(&walls, 4 + i, 5.0, z[i], 4);
  }
  return segmentsOf(Cloud(), walls, params)[5].adjusted_z;
}

double planarRangeOf(const FloorSurface& surface, std::size_t i) {
  return std::hypot(static_cast<double>(surface.x[i]), static_cast<double>(surface.y[i]));
}

double azimuthOf(const FloorSurface& surface, std::size_t i) {
  const double azimuth =
      std::atan2(static_cast<double>(surface.y[i]), static_cast<double>(surface.x[i]));
  return azimuth * 180.0 / M_PI;
}

// --- Step 1
// ---------------------------------------------------------------------------------------

TEST(PolarSegments, OfNothingHaveNoWallAndKeepTheirNothing) {
  const Segments segments = segmentsOf(Cloud(), Cloud());
  ASSERT_EQ(segments.size(), 36U);
  for (const PolarSegment& segment : segments) {
    EXPECT_FALSE(segment.has_wall);
    EXPECT_TRUE(segment.keeps_measured);
    EXPECT_EQ(segment.wall_points, 0U);
  }
}

TEST(PolarSegments, CountPointsPerSegmentFromPlusX) {
  Cloud ground;
  addTo(&ground, 0, 2.0, kFloor, 0, 3);
  addTo(&ground, 35, 2.0, kFloor, 0, 4);
  Cloud walls;
  addTo(&walls, 18, 3.0, kFloor, 4, 5);
  const Segments segments = segmentsOf(ground, walls);
  EXPECT_EQ(segments[0].ground_points, 3U);
  EXPECT_EQ(segments[35].ground_points, 4U);
  EXPECT_EQ(segments[18].wall_points, 5U);
}

TEST(PolarSegments, TakeTheirMinimaIndependently) {
  Cloud walls;
  addTo(&walls, 2, 3.0, -0.2, 5, 4);  // the nearest
  addTo(&walls, 2, 4.0, -0.7, 6, 3);  // the lowest
  addTo(&walls, 2, 5.0, -0.1, 4, 3);  // the lowest ring
  const PolarSegment segment = segmentsOf(Cloud(), walls)[2];
  EXPECT_TRUE(segment.has_wall);
  EXPECT_NEAR(segment.min_distance, 3.0, 1e-6);
  EXPECT_EQ(segment.lowest_z, -0.7F);
  EXPECT_EQ(segment.rings_below_wall, 4U);
}

TEST(PolarSegments, MeasureTheDistanceToTheWallInThreeDimensionsAsPrinted) {
  Cloud walls;
  addTo(&walls, 0, 3.0, -4.0, 4);
  EXPECT_NEAR(segmentsOf(Cloud(), walls, Params())[0].min_distance, 5.0, 1e-6);
  EXPECT_NEAR(segmentsOf(Cloud(), walls, planarParams())[0].min_distance, 3.0, 1e-6);
}

TEST(PolarSegments, NeedTenWallPoints) {
  Cloud walls;
  addTo(&walls, 0, 3.0, kFloor, 4, 9);
  addTo(&walls, 1, 3.0, kFloor, 4, 10);
  const Segments segments = segmentsOf(Cloud(), walls);
  EXPECT_FALSE(segments[0].has_wall);
  EXPECT_TRUE(segments[1].has_wall);
}

TEST(PolarSegments, CountTheRingsBelowTheWallWhateverTheirNumbers) {
  Cloud walls;
  addTo(&walls, 0, 3.0, kFloor, 5);
  EXPECT_EQ(segmentsOf(Cloud(), walls, planarParams(), upwardBeams())[0].rings_below_wall, 5U);
  EXPECT_EQ(segmentsOf(Cloud(), walls, planarParams(), downwardBeams())[0].rings_below_wall, 2U);
}

TEST(PolarSegments, IgnoreInvalidPointsAndUnknownRings) {
  Cloud ground;
  ground.add(kNan, 0, 0);
  ground.add(0, 0, 0);
  Cloud walls;
  addTo(&walls, 0, 3.0, kFloor, 99);  // no such beam
  walls.add(3, kNan, 0, 1);
  const Segments segments = segmentsOf(ground, walls);
  EXPECT_EQ(segments[0].ground_points, 0U);
  EXPECT_EQ(segments[0].wall_points, 0U);
}

TEST(PolarSegments, SplitTheCircleIntoTheAngleGiven) {
  Params params = planarParams();
  params.segment_angle_deg = 90.0;
  Cloud walls;
  walls.addPolar(89.99, 3.0, kFloor, 4);
  walls.addPolar(90.01, 3.0, kFloor, 4);
  const Segments segments = segmentsOf(Cloud(), walls, params);
  ASSERT_EQ(segments.size(), 4U);
  EXPECT_EQ(segments[0].wall_points, 1U);
  EXPECT_EQ(segments[1].wall_points, 1U);
}

// --- Step 2, Eq. 3.1
// ------------------------------------------------------------------------------

bool keepsMeasured(int ground_points, const Params& params) {
  Cloud ground;
  addTo(&ground, 3, 2.0, kFloor, 0, ground_points);
  Cloud walls;
  addTo(&walls, 3, 4.0, kFloor, 4);  // four rings below
  return segmentsOf(ground, walls, params)[3].keeps_measured;
}

TEST(ExpectedPoints, AskForStrictlyMoreThanTheGainsShare) {  // 4 * 10 / 0.4 * 0.15 = 15
  EXPECT_FALSE(keepsMeasured(15, planarParams()));
  EXPECT_TRUE(keepsMeasured(16, planarParams()));
}

TEST(ExpectedPoints, FollowTheHorizontalResolution) {  // 4 * 10 / 0.8 * 0.15 = 7.5
  Params params = planarParams();
  params.horizontal_resolution_deg = 0.8;
  EXPECT_FALSE(keepsMeasured(7, params));
  EXPECT_TRUE(keepsMeasured(8, params));
}

TEST(ExpectedPoints, FollowTheGain) {  // 4 * 25 * 0.5 = 50
  Params params = planarParams();
  params.reconstruction_gain = 0.5;
  EXPECT_FALSE(keepsMeasured(50, params));
  EXPECT_TRUE(keepsMeasured(51, params));
}

TEST(ExpectedPoints, GainZeroAsksForOnePoint) {
  Params params = planarParams();
  params.reconstruction_gain = 0.0;
  EXPECT_FALSE(keepsMeasured(0, params));
  EXPECT_TRUE(keepsMeasured(1, params));
}

TEST(ExpectedPoints, FollowTheSegmentsAngle) {  // 4 * 20 / 0.4 * 0.15 = 30
  Params params = planarParams();
  params.segment_angle_deg = 20.0;
  for (const int points : {30, 31}) {
    Cloud ground;
    addTo(&ground, 4, 2.0, kFloor, 0, points);
    Cloud walls;
    addTo(&walls, 4, 4.0, kFloor, 4);
    EXPECT_EQ(segmentsOf(ground, walls, params)[2].keeps_measured, points > 30);
  }
}

TEST(ExpectedPoints, AreNotAskedOfASegmentWithoutWall) {
  Cloud ground;
  addTo(&ground, 3, 2.0, kFloor, 0, 1);
  Cloud walls;
  addTo(&walls, 3, 4.0, kFloor, 4, 9);
  EXPECT_TRUE(segmentsOf(ground, walls)[3].keeps_measured);
}

// --- Step 3
// ---------------------------------------------------------------------------------------

TEST(AdjustedHeight, IsTheWallsLowestWithoutNeighbors) {
  EXPECT_EQ(adjustedZ(kNan, -0.6F, kNan), -0.6F);
}

TEST(AdjustedHeight, IsTheLowerNeighborsWhereThatIsMuchLower) {
  EXPECT_EQ(adjustedZ(-0.7F, -0.5F, -0.6F), -0.7F);
  EXPECT_EQ(adjustedZ(-0.6F, -0.5F, -0.7F), -0.7F);
}

TEST(AdjustedHeight, StaysWhereTheDifferenceIsJustTheThreshold) {
  Params params = planarParams();
  params.height_difference_threshold = 0.0625;
  EXPECT_EQ(adjustedZ(-0.6875, -0.625, -0.6875, params), -0.625);
  EXPECT_EQ(adjustedZ(-0.6876F, -0.625, -0.6875, params), -0.6876F);
}

TEST(AdjustedHeight, HasTheThesisThresholdOfFiveCentimetres) {
  EXPECT_EQ(adjustedZ(-0.649F, -0.6F, kNan), -0.6F);
  EXPECT_EQ(adjustedZ(-0.651F, -0.6F, kNan), -0.651F);
}

TEST(AdjustedHeight, StaysBelowHigherNeighbors) { EXPECT_EQ(adjustedZ(-0.3, -0.7F, -0.3), -0.7F); }

TEST(AdjustedHeight, IgnoresNeighborsWithoutWall) {
  Cloud walls;
  addTo(&walls, 4, 5.0, -0.9, 4, 9);  // a point short
  addTo(&walls, 5, 5.0, -0.6, 4);
  EXPECT_EQ(segmentsOf(Cloud(), walls)[5].adjusted_z, -0.6F);
}

TEST(AdjustedHeight, HeedsNeighborsThatKeepTheirMeasuredGround) {
  Cloud ground;
  addTo(&ground, 4, 2.0, kFloor, 0, 16);
  Cloud walls;
  addTo(&walls, 4, 5.0, kFloor, 4);
  addTo(&walls, 5, 5.0, -0.5, 4);
  const Segments segments = segmentsOf(ground, walls);
  ASSERT_TRUE(segments[4].keeps_measured);
  EXPECT_EQ(segments[5].adjusted_z, -0.7F);
}

TEST(AdjustedHeight, ComesFromUnadjustedValues) {  // a stair: no step runs through
  Cloud walls;
  addTo(&walls, 4, 5.0, -0.7, 4);
  addTo(&walls, 5, 5.0, -0.5, 4);
  addTo(&walls, 6, 5.0, -0.3, 4);
  const Segments segments = segmentsOf(Cloud(), walls);
  EXPECT_EQ(segments[5].adjusted_z, -0.7F);
  EXPECT_EQ(segments[6].adjusted_z, -0.5F);
}

TEST(AdjustedHeight, WrapsAroundTheCircle) {
  for (const int lower : {0, 35}) {
    Cloud walls;
    addTo(&walls, lower, 5.0, -0.7, 4);
    addTo(&walls, 35 - lower, 5.0, -0.5, 4);
    EXPECT_EQ(segmentsOf(Cloud(), walls)[static_cast<std::size_t>(35 - lower)].adjusted_z, -0.7F);
  }
}

TEST(AdjustedHeight, IsTheSensorsFloorBeyondFiveDegrees) {  // tan 5 deg * 5 m = 0.43744 m
  EXPECT_EQ(adjustedZ(kNan, -0.7 + 0.437, kNan), static_cast<float>(-0.7 + 0.437));
  EXPECT_EQ(adjustedZ(kNan, -0.7 + 0.438, kNan), -0.7);
  EXPECT_EQ(adjustedZ(kNan, -0.7 - 0.437, kNan), static_cast<float>(-0.7 - 0.437));
  EXPECT_EQ(adjustedZ(kNan, -0.7 - 0.438, kNan), -0.7);
}

TEST(AdjustedHeight, AsksTheNeighborBeforeTheSlope) {
  EXPECT_EQ(adjustedZ(-0.65F, 0.5, kNan), -0.65F);  // 0.5 alone would be too steep
}

TEST(AdjustedHeight, IsTheSensorsFloorWhereTheNeighborIsTooSteepAsWell) {
  EXPECT_EQ(adjustedZ(0.3, 0.5, kNan), -0.7);
}

TEST(AdjustedHeight, TakesTheSensorsFloorFromItsHeight) {
  Cloud walls;
  addTo(&walls, 5, 5.0, 0.5, 4);
  Mounting high;
  high.sensor_height = 1.25;
  const Scan nothing{ScanView()};
  const Segments segments =
      PolarSegments(planarParams()).segments(nothing, Scan(walls.view()), upwardBeams(), high);
  EXPECT_EQ(segments[5].adjusted_z, -1.25);
}

TEST(AdjustedHeight, SlopeZeroAllowsTheSensorsFloorAlone) {
  Params params = planarParams();
  params.max_elevation_angle_deg = 0.0;
  EXPECT_EQ(adjustedZ(kNan, -0.69, kNan, params), -0.7);
}

TEST(AdjustedHeight, IsLeftAloneWhereMeasuredGroundStays) {
  Cloud ground;
  addTo(&ground, 5, 2.0, kFloor, 0, 16);
  Cloud walls;
  addTo(&walls, 4, 5.0, -0.7, 4);
  addTo(&walls, 5, 5.0, 0.5, 4);
  EXPECT_EQ(segmentsOf(ground, walls)[5].adjusted_z, 0.5);
}

// --- Algorithm 3
// ----------------------------------------------------------------------------------

/// A wall in segment 9 (90 to 100 deg), 3 m away, foot at -0.61 m, on ring `ring`.
FloorSurface beforeAWall(int ring, const Params& params = planarParams()) {
  Cloud walls;
  addTo(&walls, 9, 3.0, -0.61, ring);
  return reconstruct(Cloud(), walls, params);
}

TEST(Reconstruction, DrawsARadiusForEachRingBelowTheWall) {
  const FloorSurface surface = beforeAWall(4);
  ASSERT_EQ(surface.size(), 1U + 3U * 26U);  // radius 0 is one point; 10 / 0.4 steps, both ends
  EXPECT_EQ(planarRangeOf(surface, 0), 0.0);
  for (std::size_t j = 1; j < 4; ++j) {
    for (std::size_t k = 0; k < 26; ++k) {
      EXPECT_NEAR(planarRangeOf(surface, 1 + 26 * (j - 1) + k), static_cast<double>(j), 1e-5);
    }
  }
}

TEST(Reconstruction, DrawsEachRadiusFromOneEndOfTheSegmentToTheOther) {
  const FloorSurface surface = beforeAWall(4);
  ASSERT_EQ(surface.size(), 79U);
  for (std::size_t k = 0; k < 26; ++k) {
    EXPECT_NEAR(azimuthOf(surface, 53 + k), 90.0 + 0.4 * static_cast<double>(k), 1e-5);
  }
}

TEST(Reconstruction, ReachesTheSegmentsEndWhereTheResolutionDoesNotDivideIt) {
  Params params = planarParams();
  params.horizontal_resolution_deg = 3.0;
  const FloorSurface surface = beforeAWall(2, params);
  ASSERT_EQ(surface.size(), 1U + 5U);
  const double azimuths[] = {90.0, 93.0, 96.0, 99.0, 100.0};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(azimuthOf(surface, 1 + k), azimuths[k], 1e-5);
}

TEST(Reconstruction, RisesLinearlyToTheWallsFoot) {  // from -0.70 to -0.61 in three steps
  const FloorSurface surface = beforeAWall(4);
  ASSERT_EQ(surface.size(), 79U);
  EXPECT_EQ(surface.z[0], -0.70F);
  EXPECT_NEAR(surface.z[1], -0.67, 1e-6);
  EXPECT_NEAR(surface.z[27], -0.64, 1e-6);
  EXPECT_NEAR(surface.z[53], -0.61, 1e-6);
}

TEST(Reconstruction, GivesPointsOfTheJthRadiusTheJthRing) {
  Cloud walls;
  addTo(&walls, 9, 3.0, kFloor, 4);  // of the downward beams: three rings below, 7, 6 and 5
  const FloorSurface surface = reconstruct(Cloud(), walls, planarParams(), downwardBeams());
  ASSERT_EQ(surface.size(), 1U + 2U * 26U);
  EXPECT_EQ(surface.ring[0], 7);
  EXPECT_EQ(surface.ring[1], 6);
  EXPECT_EQ(surface.ring[52], 5);
}

TEST(Reconstruction, MarksItsPointsAsReconstructed) {
  const FloorSurface surface = beforeAWall(3);
  ASSERT_EQ(surface.size(), 53U);
  for (std::size_t i = 0; i < surface.size(); ++i) {
    EXPECT_EQ(surface.intensity[i], 0.0F);
    EXPECT_EQ(surface.provenance[i], Provenance::kReconstructed);
  }
}

TEST(Reconstruction, OfOneRingIsThePointBelowTheSensor) {
  const FloorSurface surface = beforeAWall(1);
  ASSERT_EQ(surface.size(), 1U);
  EXPECT_EQ(surface.x[0], 0.0F);
  EXPECT_EQ(surface.y[0], 0.0F);
  EXPECT_EQ(surface.z[0], -0.7F);
}

TEST(Reconstruction, OfAWallOnTheLowestRingIsNothing) { EXPECT_EQ(beforeAWall(0).size(), 0U); }

TEST(Reconstruction, EndsAtTheThreeDimensionalDistanceAsPrinted) {
  Cloud walls;
  addTo(&walls, 9, 2.4, kFloor, 3);  // range 2.5 m
  const FloorSurface printed = reconstruct(Cloud(), walls, Params());
  const FloorSurface planar = reconstruct(Cloud(), walls, planarParams());
  ASSERT_EQ(printed.size(), 53U);
  EXPECT_NEAR(planarRangeOf(printed, 52), 2.5, 1e-5);
  EXPECT_NEAR(planarRangeOf(planar, 52), 2.4, 1e-5);
}

TEST(Reconstruction, IsTrustedAsFarAsTheWallWasSeen) {
  Cloud walls;
  for (int i = 0; i < 10; ++i) walls.addPolar(90.2 + 0.4 * i, 3.0, kFloor, 2);  // 10 of 25 steps
  const FloorSurface surface = reconstruct(Cloud(), walls);
  ASSERT_EQ(surface.size(), 27U);
  for (const float confidence : surface.confidence) EXPECT_EQ(confidence, 0.4F);
}

// --- merging
// --------------------------------------------------------------------------------------

TEST(Merging, KeepsMeasuredPointsAsTheyAre) {
  Cloud ground;
  ground.add(2.125, 0.25, -0.6875, 3, 42);
  const FloorSurface surface = reconstruct(ground, Cloud());
  ASSERT_EQ(surface.size(), 1U);
  EXPECT_EQ(surface.x[0], 2.125F);
  EXPECT_EQ(surface.y[0], 0.25F);
  EXPECT_EQ(surface.z[0], -0.6875F);
  EXPECT_EQ(surface.intensity[0], 42.0F);
  EXPECT_EQ(surface.ring[0], 3);
  EXPECT_EQ(surface.provenance[0], Provenance::kMeasured);
  EXPECT_EQ(surface.confidence[0], 1.0F);
}

TEST(Merging, DropsMeasuredPointsOfAReconstructedSegment) {
  Cloud ground;
  addTo(&ground, 9, 2.0, kFloor, 0, 15);  // one too few
  Cloud walls;
  addTo(&walls, 9, 3.0, kFloor, 4);
  const FloorSurface surface = reconstruct(ground, walls);
  EXPECT_EQ(surface.size(), 79U);
  EXPECT_EQ(std::count(surface.provenance.begin(), surface.provenance.end(), Provenance::kMeasured),
            0);
}

TEST(Merging, PutsMeasuredPointsFirstInInputOrder) {
  Cloud ground;
  addTo(&ground, 20, 1.5, kFloor, 0, 2);
  addTo(&ground, 3, 2.5, kFloor, 1, 2);
  Cloud walls;
  addTo(&walls, 9, 3.0, kFloor, 1);
  addTo(&walls, 1, 3.0, kFloor, 1);
  const FloorSurface surface = reconstruct(ground, walls);
  ASSERT_EQ(surface.size(), 6U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(surface.x[i], ground.x[i]);
  EXPECT_EQ(surface.provenance[3], Provenance::kMeasured);
  EXPECT_EQ(surface.provenance[4], Provenance::kReconstructed);
}

TEST(Merging, OfNothingIsNothing) {
  const FloorSurface surface = reconstruct(Cloud(), Cloud());
  EXPECT_EQ(surface.size(), 0U);
  EXPECT_TRUE(surface.boundary.vertices.empty());
  EXPECT_TRUE(surface.boundary.kinds.empty());
}

TEST(Merging, DoesNotHangOnTheOrderOfTheWallPoints) {
  Cloud walls;
  Uniform uniform(5);
  for (int i = 0; i < 900; ++i) {
    const double azimuth_deg = uniform(0.0, 360.0);
    const double r = uniform(2.0, 4.0);
    const double z = uniform(-0.75, 0.2);
    walls.addPolar(azimuth_deg, r, z, 3 + i % 5);
  }
  const FloorSurface plain = reconstruct(Cloud(), walls);
  const Cloud shuffled = walls.select(shuffledIndices(walls.size(), 6));
  const FloorSurface other = reconstruct(Cloud(), shuffled);
  EXPECT_EQ(plain.x, other.x);
  EXPECT_EQ(plain.y, other.y);
  EXPECT_EQ(plain.z, other.z);
  EXPECT_EQ(plain.confidence, other.confidence);
}

// --- a tilted sensor
// ------------------------------------------------------------------------------

Mounting pitchedDown(double pitch_deg) {
  const double c = std::cos(pitch_deg * M_PI / 180.0);
  const double s = std::sin(pitch_deg * M_PI / 180.0);
  Mounting mounting;
  mounting.rotation = {c, 0, s, 0, 1, 0, -s, 0, c};
  return mounting;
}

TEST(TiltedSensor, GetsTheLevelFloorInItsOwnFrame) {
  const Mounting mounting = pitchedDown(20.0);
  Cloud walls;
  for (int s = 0; s < 36; ++s) {
    for (int i = 0; i < 10; ++i) {
      const double azimuth = (10.0 * s + 0.5 + i * 0.9) * M_PI / 180.0;
      const auto p = mounting.toSensor(static_cast<float>(3.0 * std::cos(azimuth)),
                                       static_cast<float>(3.0 * std::sin(azimuth)), -0.7F);
      walls.add(p[0], p[1], p[2], 4);
    }
  }
  const FloorSurface surface = reconstruct(Cloud(), walls, planarParams(), upwardBeams(), mounting);
  ASSERT_EQ(surface.size(), 36U * 79U);
  const auto& plane = surface.floor_plane;
  EXPECT_NEAR(plane[0], std::tan(20.0 * M_PI / 180.0), 1e-12);  // nosed down: ahead it rises
  EXPECT_NEAR(plane[2], -0.7 / std::cos(20.0 * M_PI / 180.0), 1e-12);
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const auto level = mounting.toLevel(surface.x[i], surface.y[i], surface.z[i]);
    ASSERT_NEAR(level[2], -0.7, 1e-5);
    const double x = surface.x[i];
    const double y = surface.y[i];
    ASSERT_NEAR(surface.z[i], plane[0] * x + plane[1] * y + plane[2], 1e-5);
  }
}

TEST(LevelSensor, HasALevelFloorPlaneAtItsHeight) {
  Mounting mounting;
  mounting.sensor_height = 0.9;
  const auto surface = reconstruct(Cloud(), Cloud(), planarParams(), upwardBeams(), mounting);
  EXPECT_EQ(surface.floor_plane[2], -0.9);
  EXPECT_EQ(surface.floor_plane[0], 0.0);
  EXPECT_EQ(surface.floor_plane[1], 0.0);
}

// --- outline
// --------------------------------------------------------------------------------------

double signedArea(const FloorOutline& outline) {
  double doubled = 0.0;
  for (std::size_t i = 0; i < outline.vertices.size(); ++i) {
    const auto& a = outline.vertices[i];
    const auto& b = outline.vertices[(i + 1) % outline.vertices.size()];
    doubled += static_cast<double>(a[0]) * static_cast<double>(b[1]) -
               static_cast<double>(b[0]) * static_cast<double>(a[1]);
  }
  return doubled / 2.0;
}

TEST(Outline, RunsCounterClockwiseAlongTheWalls) {
  Cloud walls;
  for (int s = 0; s < 36; ++s) addTo(&walls, s, 3.0, kFloor, 4);
  const FloorOutline outline = reconstruct(Cloud(), walls).boundary;
  ASSERT_EQ(outline.vertices.size(), 72U);
  EXPECT_NEAR(signedArea(outline), 18.0 * 9.0 * std::sin(10.0 * M_PI / 180.0), 1e-4);
  for (const BoundaryKind kind : outline.kinds) EXPECT_EQ(kind, BoundaryKind::kWallSeen);
}

TEST(Outline, ReturnsToTheSensorsFootWhereNothingIsClaimed) {
  Cloud walls;
  addTo(&walls, 9, 3.0, kFloor, 4);
  const FloorOutline outline = reconstruct(Cloud(), walls).boundary;
  EXPECT_NEAR(signedArea(outline), 0.5 * 9.0 * std::sin(10.0 * M_PI / 180.0), 1e-5);
  ASSERT_EQ(outline.vertices.size(), outline.kinds.size());
  EXPECT_EQ(outline.kinds.front(), BoundaryKind::kLimitOfKnowledge);
  EXPECT_EQ(std::count(outline.kinds.begin(), outline.kinds.end(), BoundaryKind::kWallSeen), 2);
}

TEST(Outline, EndsMeasuredFloorWithoutWallAtTheLimitOfKnowledge) {
  Cloud ground;
  for (int s = 0; s < 36; ++s) addTo(&ground, s, 2.0, kFloor, 0, 1);
  const FloorOutline outline = reconstruct(ground, Cloud()).boundary;
  ASSERT_EQ(outline.vertices.size(), 72U);
  EXPECT_NEAR(signedArea(outline), 18.0 * 4.0 * std::sin(10.0 * M_PI / 180.0), 1e-4);
  for (const BoundaryKind kind : outline.kinds) EXPECT_EQ(kind, BoundaryKind::kLimitOfKnowledge);
}

TEST(Outline, EndsMeasuredFloorAtTheWallItComesNearTo) {
  for (const double reach : {2.79, 2.81}) {  // the wall stands at 3 m, contact is 0.2 m
    Cloud ground;
    addTo(&ground, 9, reach, kFloor, 0, 20);
    Cloud walls;
    addTo(&walls, 9, 3.0, kFloor, 4);
    const FloorOutline outline = reconstruct(ground, walls).boundary;
    const auto seen =
        std::count(outline.kinds.begin(), outline.kinds.end(), BoundaryKind::kWallSeen);
    EXPECT_EQ(seen, reach > 2.8 ? 2 : 0);
  }
}

TEST(Outline, DrawsNoWallAlongTheLineOfSight) {
  for (const double far : {3.19, 3.21}) {  // the next wall stands at 3 m; they touch within 0.2 m
    Cloud walls;
    addTo(&walls, 9, far, kFloor, 4);
    addTo(&walls, 10, 3.0, kFloor, 4);
    const FloorOutline outline = reconstruct(Cloud(), walls).boundary;
    const bool torn = far > 3.2;
    ASSERT_EQ(outline.vertices.size(), torn ? 7U : 6U);  // the foot before and after, two a wall
    if (!torn) continue;
    EXPECT_EQ(outline.vertices[2], outline.vertices[3]);
    EXPECT_EQ(outline.kinds[2], BoundaryKind::kWallSeen);
    EXPECT_EQ(outline.kinds[3], BoundaryKind::kLimitOfKnowledge);
    EXPECT_EQ(outline.kinds[4], BoundaryKind::kWallSeen);
  }
}

// --- parameters
// -----------------------------------------------------------------------------------

TEST(PolarSegmentsParams, AcceptsEveryLimit) {
  Params params;
  params.segment_angle_deg = 0.01;
  params.horizontal_resolution_deg = 0.01;
  params.reconstruction_gain = 0.0;
  params.min_wall_points = 1;
  params.height_difference_threshold = 0.0;
  params.max_elevation_angle_deg = 0.0;
  EXPECT_NO_THROW(params.validate());
}

TEST(PolarSegments, WorkWithTheFinestResolutions) {
  Cloud walls;
  addTo(&walls, 9, 3.0, kFloor, 2);
  for (const auto& [segment, resolution] :
       {std::pair<double, double>{0.015, 0.01}, {90.0, 0.01}, {0.01, 0.01}, {10.0, 10.0}}) {
    Params params = planarParams();
    params.segment_angle_deg = segment;
    params.horizontal_resolution_deg = resolution;
    params.min_wall_points = 1;
    EXPECT_GT(reconstruct(Cloud(), walls, params).size(), 1U) << segment << " " << resolution;
  }
}

void expectRefusal(const std::string& name, const std::function<void(Params*)>& spoil) {
  Params params;
  spoil(&params);
  try {
    const PolarSegments segments(params);
    ADD_FAILURE() << name << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).rfind(name + " must be ", 0), 0U) << error.what();
  }
}

TEST(PolarSegmentsParams, NamesTheParameterItRefuses) {
  using P = PolarSegmentsParams;
  expectRefusal("segment_angle_deg", [](P* p) { p->segment_angle_deg = 7.0; });
  expectRefusal("segment_angle_deg", [](P* p) { p->segment_angle_deg = kNan; });
  expectRefusal("horizontal_resolution_deg", [](P* p) { p->horizontal_resolution_deg = 0.009; });
  expectRefusal("horizontal_resolution_deg", [](P* p) { p->horizontal_resolution_deg = 10.1; });
  expectRefusal("reconstruction_gain", [](P* p) { p->reconstruction_gain = -0.1; });
  expectRefusal("min_wall_points", [](P* p) { p->min_wall_points = 0; });
  expectRefusal("height_difference_threshold",
                [](P* p) { p->height_difference_threshold = -0.01; });
  expectRefusal("max_elevation_angle_deg", [](P* p) { p->max_elevation_angle_deg = 90.0; });
  expectRefusal("max_elevation_angle_deg", [](P* p) { p->max_elevation_angle_deg = -1.0; });
}

}  // namespace
}  // namespace smoke_ground_reconstruction
