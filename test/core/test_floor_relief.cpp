#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/floor_relief.hpp"

namespace smoke_ground_reconstruction {
namespace {

struct Returns {
  Points points;
  UprightReturns upright;
  std::vector<std::uint32_t> all;
};

void add(Returns* returns, double x, double y, double height) {
  returns->all.push_back(static_cast<std::uint32_t>(returns->all.size()));
  returns->points.push(static_cast<float>(x), static_cast<float>(y), 0.0F);
  returns->upright.height.push_back(static_cast<float>(height));
  returns->upright.planar.push_back(static_cast<float>(std::sqrt(x * x + y * y)));
}

void find(Returns* returns, FloorRelief* relief) {
  returns->upright.points = &returns->points;
  relief->find(returns->upright, returns->all);
}

/// Returns every 4 cm from x0 to x1 and from -1 to 1 m, as high as a function of x says.
template <typename Height>
void addFloor(Returns* returns, double x0, double x1, const Height& height) {
  for (double x = x0; x < x1; x += 0.04) {
    for (double y = -1.0; y < 1.0; y += 0.04) add(returns, x, y, height(x));
  }
}

double level(double) { return 0.0; }
double ramp(double x) { return std::max(0.0, (x - 1.0) / 8.0); }  // 1:8 from x = 1

TEST(FloorRelief, OfNothingIsFlat) {
  FloorRelief relief;
  Returns none;
  find(&none, &relief);
  EXPECT_TRUE(relief.isFlat());
  EXPECT_EQ(relief.at(1.0, 2.0), 0.0);
  EXPECT_EQ(relief.sigma(1.0, 2.0), 0.0);
}

TEST(FloorRelief, OfAFloorIsFlat) {
  Returns returns;
  addFloor(&returns, -3.0, 3.0, level);
  FloorRelief relief;
  find(&returns, &relief);
  EXPECT_TRUE(relief.isFlat());
  EXPECT_EQ(relief.at(2.0, 0.0), 0.0);
  EXPECT_FALSE(relief.carries(2.0, 0.0, 0.0));
}

TEST(FloorRelief, DrawsARampOnUntilAWallIsSeenBeneathIt) {
  Returns returns;
  addFloor(&returns, -3.0, 2.0, ramp);
  for (double y = -1.0; y < 1.0; y += 0.1) {
    for (double z = 0.3; z < 1.5; z += 0.05) add(&returns, 5.02, y, z);
  }
  FloorRelief relief;
  find(&returns, &relief);
  EXPECT_NEAR(relief.at(0.0, 0.0), 0.0, 4e-3);
  EXPECT_NEAR(relief.at(1.8, 0.5), 0.1, 4e-3);
  EXPECT_NEAR(relief.at(3.0, 0.0), 0.25, 4e-3);
  EXPECT_NEAR(relief.at(4.9, 0.5), 0.3, 4e-3);  // not 0.49: the wall goes down to 0.3
  EXPECT_TRUE(relief.carries(1.8, 0.0, 0.1));
  EXPECT_FALSE(relief.carries(1.8, 0.0, 0.2));
}

TEST(FloorRelief, FitsARampToScatteredReturnsAlongAWall) {
  Returns returns;
  addFloor(&returns, -3.0, 0.9, level);
  FloorRelief relief;
  find(&returns, &relief);
  ASSERT_TRUE(relief.addRamp({{0.14, 0.007, -0.15}, 0.3}));  // 1:7, 3 deg askew
  ASSERT_TRUE(relief.hasOneSlope());
  std::vector<ReliefPlace> floor;
  for (int k = 0; k < 11; ++k) floor.push_back({1.1 + 0.14 * k, 0.5, ramp(1.1 + 0.14 * k)});
  relief.fitRamp(floor, {}, {{0.0, 1.0}});
  EXPECT_DOUBLE_EQ(relief.facets()[1].a, 0.14);  // so few tell nothing
  for (int k = 0; k < 200; ++k) floor.push_back({1.1 + 0.007 * k, 0.2, ramp(1.1 + 0.007 * k)});
  relief.fitRamp(floor, {}, {{0.0, 1.0}});
  EXPECT_NEAR(relief.facets()[1].a, 0.125, 1e-4);
  EXPECT_EQ(relief.facets()[1].b, 0.0);
  EXPECT_NEAR(relief.creases()[0].rho, 1.0, 1e-3);
  EXPECT_NEAR(relief.at(3.0, 0.0), 0.25, 1e-3);
}

TEST(FloorRelief, LaysARampAtTheLowestFeetOfWalls) {
  Returns returns;
  addFloor(&returns, -3.0, 0.9, level);
  FloorRelief relief;
  find(&returns, &relief);
  ASSERT_TRUE(relief.addRamp({{0.125, 0.0, -0.12}, 0.3}));
  std::vector<ReliefPlace> feet;
  for (int k = 0; k < 40; ++k) {
    const double x = 1.2 + 0.04 * k;
    feet.push_back({x, 2.0, ramp(x)});
    feet.push_back({x, 2.0, ramp(x) + 0.02});
  }
  relief.fitRamp({}, feet, {});
  // What lies over it counts a twentieth of what lies below: 20 mm / 21.
  EXPECT_NEAR(relief.facets()[1].at(2.0, 0.0), 0.125 + 0.02 / 21.0, 1e-4);
}

TEST(FloorRelief, TakesAPlatformsHeightFromItsRiser) {
  Returns returns;
  addFloor(&returns, -2.0, 2.03, level);
  for (double y = -1.2; y < 1.2; y += 0.05) {
    for (double z = 0.0; z < 0.151; z += 0.025) add(&returns, 2.05, y, z);
  }
  FloorRelief relief;
  find(&returns, &relief);
  EXPECT_NEAR(relief.at(2.0, 0.0), 0.0, 1e-3);
  EXPECT_NEAR(relief.at(2.1, 0.0), 0.15, 1e-3);
  EXPECT_NEAR(relief.at(4.0, 3.0), 0.15, 1e-3);
  EXPECT_TRUE(relief.isRiser(2.05, 0.5, 0.1));
  EXPECT_FALSE(relief.isRiser(2.15, 0.5, 0.1));
  addFloor(&returns, 2.3, 3.0, level);  // a kerb, then
  find(&returns, &relief);
  EXPECT_TRUE(relief.isFlat());
}

TEST(FloorRelief, TakesAPlatformsHeightFromItsReturnsWhereTheyAreFew) {
  Returns returns;
  addFloor(&returns, -2.0, 2.03, level);
  for (double y = -1.2; y < 1.2; y += 0.05) {  // noise lifts the highest returns of a riser
    for (const double z : {0.0, 0.04, 0.08, 0.12, 0.165}) add(&returns, 2.05, y, z);
  }
  for (int k = 0; k < 7; ++k) add(&returns, 2.3, -0.9 + 0.3 * k, 0.15);
  for (double y = -1.0; y < 1.0; y += 0.1) {  // no floor: a wall's foot
    for (double z = 0.14; z < 0.7; z += 0.04) add(&returns, 4.5, y, z);
  }
  FloorRelief relief;
  find(&returns, &relief);
  EXPECT_NEAR(relief.at(3.0, 0.0), 0.165, 1e-6);  // seven may be anything
  add(&returns, 2.5, 0.1, 0.15);
  find(&returns, &relief);
  EXPECT_NEAR(relief.at(3.0, 0.0), 0.15, 1e-6);
}

TEST(FloorRelief, IsLessSureFartherFromMeasuredFloorAndOnSlopes) {
  Returns flat, sloped;
  addFloor(&flat, -3.0, 2.0, level);
  addFloor(&sloped, -3.0, 2.0, ramp);
  FloorRelief of_flat, of_sloped;
  find(&flat, &of_flat);
  find(&sloped, &of_sloped);
  EXPECT_EQ(of_sloped.sigma(1.0, 0.5), 0.0);
  EXPECT_LT(of_sloped.sigma(3.0, 0.0), of_sloped.sigma(5.0, 0.0));
  EXPECT_GT(of_sloped.sigma(5.0, 0.0), 5.0 * of_flat.sigma(5.0, 0.0));
  EXPECT_GT(of_flat.sigma(5.0, 0.0), 0.0);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
