#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/occupancy.hpp"

namespace smoke_ground_reconstruction {
namespace {

using Cells = std::vector<std::int8_t>;

constexpr std::int8_t kFloor = OccupancyGrid::kFloor;
constexpr std::int8_t kWall = OccupancyGrid::kWall;
constexpr std::int8_t kUnknown = OccupancyGrid::kUnknown;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

OccupancyGrid rasterized(const Cloud& floor, const Cloud& walls, double resolution = 0.5,
                         double max_range = 50.0, const Mounting& mounting = Mounting()) {
  FloorSurface surface;
  surface.x = floor.x;
  surface.y = floor.y;
  surface.z = floor.z;
  return rasterize(surface, walls.view(), mounting, resolution, max_range);
}

Cloud at(double x, double y) {
  Cloud cloud;
  cloud.add(x, y, -0.7);
  return cloud;
}

TEST(Rasterize, OfNothingHasNoCells) {
  const OccupancyGrid grid = rasterized(Cloud(), Cloud());
  EXPECT_EQ(grid.width, 0U);
  EXPECT_EQ(grid.height, 0U);
  EXPECT_TRUE(grid.cells.empty());
  EXPECT_EQ(grid.resolution, 0.5);
}

TEST(Rasterize, CoversTheOnlyPointWithOneCell) {
  const OccupancyGrid grid = rasterized(at(1.3, -0.2), Cloud());
  EXPECT_EQ(grid.first_column, 2);  // 1.0 to 1.5 m
  EXPECT_EQ(grid.first_row, -1);    // -0.5 to 0 m
  EXPECT_EQ(grid.width, 1U);
  EXPECT_EQ(grid.height, 1U);
  EXPECT_EQ(grid.cells, Cells{kFloor});
}

TEST(Rasterize, TakesTheLowerEdgeIntoACell) {
  const OccupancyGrid grid = rasterized(at(0.5, -0.5), Cloud());
  EXPECT_EQ(grid.first_column, 1);
  EXPECT_EQ(grid.first_row, -1);
}

TEST(Rasterize, TellsCellsOnAndBesideEdgesAsDoublesDo) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (int edge = -400; edge <= 400; ++edge) {
    const auto on = static_cast<float>(edge * 0.1);
    for (const float x : {std::nextafter(on, -kInfinity), on, std::nextafter(on, kInfinity)}) {
      const OccupancyGrid grid = rasterized(at(x, 0.05), Cloud(), 0.1);
      EXPECT_EQ(grid.first_column, std::floor(static_cast<double>(x) / 0.1)) << x;
    }
  }
}

TEST(Rasterize, TakesWallsByTheirLabels) {
  Cloud scan = at(0.1, 0.1);
  scan.add(0.6, 0.1, 0.0);
  scan.add(1.1, 0.1, 0.0);
  OccupancyGrid grid;
  rasterize(FloorSurface(), scan.view(), {Label::kGround, Label::kWall, Label::kKept}, Mounting(),
            0.5, 50.0, &grid);
  EXPECT_EQ(grid.first_column, 1);
  EXPECT_EQ(grid.cells, Cells{kWall});
}

TEST(Rasterize, AlignsGridsOfAllScans) {  // cells are multiples of the resolution
  EXPECT_EQ(rasterized(at(0.51, 0.0), Cloud()).first_column, 1);
  EXPECT_EQ(rasterized(at(0.99, 0.0), Cloud()).first_column, 1);
  EXPECT_EQ(rasterized(at(1.01, 0.0), Cloud()).first_column, 2);
}

TEST(Rasterize, LaysRowsAlongXFromTheSmallestY) {
  Cloud floor;
  floor.add(0.1, 0.1, -0.7);
  floor.add(1.1, 0.1, -0.7);
  const OccupancyGrid grid = rasterized(floor, at(1.2, 0.7));
  EXPECT_EQ(grid.width, 3U);
  EXPECT_EQ(grid.height, 2U);
  EXPECT_EQ(grid.cells, (Cells{kFloor, kUnknown, kFloor, kUnknown, kUnknown, kWall}));
}

TEST(Rasterize, LetsAWallWinItsCell) {
  EXPECT_EQ(rasterized(at(0.1, 0.1), at(0.2, 0.2)).cells, Cells{kWall});
}

TEST(Rasterize, DrawsWallsWithoutFloor) {
  EXPECT_EQ(rasterized(Cloud(), at(0.2, 0.2)).cells, Cells{kWall});
}

TEST(Rasterize, LeavesOutWhatLiesBeyondItsReach) {
  Cloud floor = at(3.0, 4.0);  // 5 m away
  floor.add(30.0, 40.0, -0.7);
  EXPECT_EQ(rasterized(floor, Cloud(), 0.5, 5.0).cells.size(), 1U);
  EXPECT_EQ(rasterized(floor, Cloud(), 0.5, 4.99).cells.size(), 0U);
  EXPECT_EQ(rasterized(floor, at(60.0, 0.0)).width, 55U);  // 3 to 30 m; the wall is too far
}

TEST(Rasterize, LeavesOutInvalidPoints) {
  Cloud floor = at(0.1, 0.1);
  floor.add(kNan, 0, 0);
  floor.add(0, std::numeric_limits<double>::infinity(), 0);
  EXPECT_EQ(rasterized(floor, Cloud()).cells, Cells{kFloor});
  Cloud walls;
  walls.add(0, 0, 0);
  EXPECT_TRUE(rasterized(Cloud(), walls).cells.empty());
}

TEST(Rasterize, LevelsTheSensorFrame) {
  Mounting mounting;
  mounting.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // the sensor's x points left
  const OccupancyGrid grid = rasterized(at(2.1, 0.1), Cloud(), 0.5, 50.0, mounting);
  EXPECT_EQ(grid.first_column, -1);
  EXPECT_EQ(grid.first_row, 4);
}

TEST(Rasterize, RefusesAResolutionItCannotDraw) {
  for (const double resolution : {0.0, -0.1, 0.009, kNan}) {
    EXPECT_THROW(rasterized(at(1, 1), Cloud(), resolution), std::invalid_argument) << resolution;
  }
}

TEST(Rasterize, RefusesAReachOfMoreThanTenThousandCells) {
  EXPECT_NO_THROW(rasterized(at(1, 1), Cloud(), 0.01, 100.0));
  for (const double reach : {0.0, -1.0, 101.0, 1e30, kNan}) {
    EXPECT_THROW(rasterized(at(1, 1), Cloud(), 0.01, reach), std::invalid_argument) << reach;
  }
}

}  // namespace
}  // namespace smoke_ground_reconstruction
