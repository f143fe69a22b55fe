#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr float kTiny = 1e-44F;  // a denormal

TEST(SquaredDistance, IsThatOfTheBoxDiagonal) {
  EXPECT_EQ(squaredDistance(1.0F, 2.0F, 3.0F, 3.0F, 5.0F, 9.0F), 4.0 + 9.0 + 36.0);
}

TEST(SquaredDistance, IsTakenInDoublePrecision) {
  // 1 + 2^-23 is the float after 1; the square of the difference, 2^-46, is no float32 sum's noise.
  const float next = std::nextafter(1.0F, 2.0F);
  EXPECT_EQ(squaredDistance(1000.0F, 1.0F, 0.0F, 0.0F, next, 0.0F), 1e6 + std::ldexp(1.0, -46));
}

TEST(SquaredDistance, IsTheSameBothWaysAround) {
  EXPECT_EQ(squaredDistance(0.1F, -0.7F, 3.3F, 9.1F, 0.2F, -1.7F),
            squaredDistance(9.1F, 0.2F, -1.7F, 0.1F, -0.7F, 3.3F));
}

TEST(SquaredDistance, StaysFiniteForTheLargestFloats) {
  const float huge = std::numeric_limits<float>::max();
  EXPECT_TRUE(std::isfinite(squaredDistance(huge, huge, huge, -huge, -huge, -huge)));
}

TEST(SquaredDistance, TellsDenormalsApart) {
  EXPECT_GT(squaredDistance(kTiny, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F), 0.0);
}

TEST(PlanarRange, LeavesHeightOut) { EXPECT_EQ(planarRange(3.0F, -4.0F), 5.0); }

TEST(Range, IsTheThreeDimensionalOne) { EXPECT_EQ(range(2.0F, -3.0F, 6.0F), 7.0); }

TEST(Direction, LiesExactlyOnTheAxes) {
  const Direction quarters[] = {Direction::fromDegrees(0.0), Direction::fromDegrees(90.0),
                                Direction::fromDegrees(180.0), Direction::fromDegrees(-90.0)};
  const double expected[][2] = {{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}};
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(quarters[i].cosine, expected[i][0]);
    EXPECT_EQ(quarters[i].sine, expected[i][1]);
  }
}

TEST(Direction, IsRoundedToSinglePrecision) {
  const Direction sixty = Direction::fromDegrees(60.0);
  EXPECT_EQ(sixty.cosine, 0.5);
  EXPECT_EQ(sixty.sine, static_cast<double>(0.8660254F));
}

TEST(IsAtOrAfter, HoldsOnTheEdgeAndCounterClockwiseOfIt) {
  const Direction edge = Direction::fromDegrees(90.0);
  EXPECT_TRUE(isAtOrAfter(edge, 0.0, 1.0));
  EXPECT_TRUE(isAtOrAfter(edge, -0.001, 1.0));
  EXPECT_FALSE(isAtOrAfter(edge, 0.001, 1.0));
}

TEST(AngleWindow, HoldsBothEnds) {
  const AngleWindow quadrant = AngleWindow::fromDegrees(0.0, 90.0);
  EXPECT_TRUE(quadrant.contains(1.0, 0.0));
  EXPECT_TRUE(quadrant.contains(0.0, 1.0));
  EXPECT_TRUE(quadrant.contains(1.0, 1.0));
}

TEST(AngleWindow, ExcludesWhatLiesOutsideEitherEnd) {
  const AngleWindow wall = AngleWindow::fromDegrees(60.0, 120.0);
  EXPECT_TRUE(wall.contains(0.0, 1.0));
  EXPECT_FALSE(wall.contains(0.6, 1.0));   // 59.04 deg
  EXPECT_FALSE(wall.contains(-0.6, 1.0));  // 120.96 deg
  EXPECT_FALSE(wall.contains(0.0, -1.0));  // a wall is not seen from its top to its foot
}

TEST(AngleWindow, IsSharpToThousandthsOfADegree) {
  const AngleWindow ground = AngleWindow::fromDegrees(-3.0, 3.0);
  const double inside = std::tan(2.999 * M_PI / 180.0);
  const double outside = std::tan(3.001 * M_PI / 180.0);
  for (const double step : {1e-6, 1.0, 1e6}) {
    EXPECT_TRUE(ground.contains(step, step * inside));
    EXPECT_TRUE(ground.contains(step, -step * inside));
    EXPECT_FALSE(ground.contains(step, step * outside));
    EXPECT_FALSE(ground.contains(step, -step * outside));
  }
}

TEST(AngleWindow, HasNoPlaceForAVectorWithoutDirection) {
  EXPECT_FALSE(AngleWindow::fromDegrees(-90.0, 80.0).contains(0.0, 0.0));
}

TEST(AngleWindow, AsWideAsNothingIsOneDirectionNotItsOpposite) {
  const AngleWindow level = AngleWindow::fromDegrees(0.0, 0.0);
  EXPECT_TRUE(level.contains(1.0, 0.0));
  EXPECT_FALSE(level.contains(-1.0, 0.0));
  EXPECT_FALSE(level.contains(1.0, 1e-9));
}

TEST(AngleWindow, NearlyHalfATurnWideStillExcludesTheOtherHalf) {
  const AngleWindow right = AngleWindow::fromDegrees(-89.0, 89.0);
  EXPECT_TRUE(right.contains(1.0, 50.0));
  EXPECT_FALSE(right.contains(-1.0, 0.0));
  EXPECT_FALSE(right.contains(-0.01, 1.0));
}

}  // namespace
}  // namespace smoke_ground_reconstruction
