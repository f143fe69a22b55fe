#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// The thesis's method with the grid engine and clusters of any size: no PCL, no wall dropped.
PipelineParams gridParams() {
  PipelineParams params;
  params.reconstructor.method = ReconstructionMethod::kPolarSegments;
  params.segmenter.clustering.cluster_engine = ClusterEngine::kGrid;
  params.segmenter.clustering.cluster_tolerance = 0.3;
  params.segmenter.clustering.max_cluster_size = 0;
  params.reconstructor.polar_segments.wall_distance = WallDistance::kPlanarRange;
  return params;
}

BoxRoom boxRoom() {
  BoxRoom room;
  room.elevations_deg = evenElevations(41, -50.0, 30.0);
  return room;
}

Cloud without(const Cloud& cloud, const std::vector<Surface>& surfaces, Surface removed) {
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (surfaces[i] != removed) rest.push_back(i);
  }
  return cloud.select(rest);
}

using SurfacePoint = std::tuple<float, float, float, int>;

std::vector<SurfacePoint> sortedPoints(const FloorSurface& surface) {
  std::vector<SurfacePoint> points;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    points.emplace_back(surface.x[i], surface.y[i], surface.z[i],
                        static_cast<int>(surface.provenance[i]));
  }
  std::sort(points.begin(), points.end());
  return points;
}

/// Claimed floor area [m^2].
double floorArea(const OccupancyGrid& grid) {
  const auto cells = std::count(grid.cells.begin(), grid.cells.end(), OccupancyGrid::kFloor);
  return static_cast<double>(cells) * grid.resolution * grid.resolution;
}

TEST(Pipeline, OfNothingGivesNothing) {
  const auto result = Pipeline(gridParams()).process(ScanView());
  EXPECT_TRUE(result.labels.empty());
  EXPECT_TRUE(result.clusters.empty());
  EXPECT_EQ(result.surface.size(), 0U);
  EXPECT_TRUE(result.occupancy.cells.empty());
}

TEST(Pipeline, OfOnePointKnowsNoFloor) {
  Cloud cloud;
  cloud.add(2, 0, -0.7, 3);
  const auto result = Pipeline(gridParams()).process(cloud.view());
  EXPECT_EQ(result.labels, std::vector<Label>{Label::kKept});
  EXPECT_EQ(result.clusters, std::vector<std::uint32_t>{kNoCluster});
  EXPECT_EQ(result.surface.size(), 0U);
}

TEST(Pipeline, AnswersForEveryPointOfAScanOfGarbage) {
  Cloud cloud;
  for (const double bad : {kNan, 0.0, std::numeric_limits<double>::infinity(), 1e30, -3e38}) {
    cloud.add(bad, bad, bad, 7, bad);
  }
  const auto result = Pipeline(gridParams()).process(cloud.view());
  EXPECT_EQ(result.labels, std::vector<Label>(5, Label::kInvalid));
  EXPECT_EQ(result.surface.size(), 0U);
}

TEST(Pipeline, FindsTheFloorOfABoxRoomInClearAir) {
  const BoxRoom room = boxRoom();
  const Cloud cloud = room.scan();
  const auto result = Pipeline(gridParams()).process(cloud.view());
  ASSERT_GT(result.surface.size(), 1000U);
  for (std::size_t i = 0; i < result.surface.size(); ++i) {
    ASSERT_LE(std::fabs(result.surface.x[i]), 3.41F);
    ASSERT_LE(std::fabs(result.surface.y[i]), 3.01F);
    ASSERT_NEAR(result.surface.z[i], -0.7, 1e-5);
  }
}

TEST(Pipeline, FindsTheFloorWithoutASingleGroundReturn) {  // the thesis's claim
  const BoxRoom room = boxRoom();
  std::vector<Surface> surfaces;
  const Cloud cloud = room.scan(&surfaces);
  auto params = gridParams();
  params.reconstructor.occupancy_resolution = 0.25;  // wider than the drawn rings lie apart
  Pipeline pipeline(params);
  pipeline.sensor() = SensorModel::fromElevations(room.elevations_deg);
  const auto result = pipeline.process(without(cloud, surfaces, Surface::kFloor).view());
  ASSERT_GT(result.surface.size(), 1000U);
  for (std::size_t i = 0; i < result.surface.size(); ++i) {
    ASSERT_EQ(result.surface.provenance[i], Provenance::kReconstructed);
    ASSERT_LE(std::fabs(result.surface.x[i]), 3.41F);
    ASSERT_LE(std::fabs(result.surface.y[i]), 3.01F);
    // Its wall's lowest ring meets the wall up to a ring's spacing above the floor.
    ASSERT_LE(std::fabs(result.surface.z[i] + 0.7F), 0.25F);
  }
  // The nearest wall of a 10 deg segment cuts the farther parts off: at least 85 % of 40.8 m^2.
  EXPECT_GT(floorArea(result.occupancy), 0.85 * 6.8 * 6.0);
  EXPECT_LE(floorArea(result.occupancy), 7.5 * 6.5);
}

TEST(Pipeline, GivesTheWholeFloorByRoomBoundaryWithoutASingleGroundReturn) {
  const BoxRoom room = boxRoom();
  std::vector<Surface> surfaces;
  const Cloud cloud = room.scan(&surfaces);
  auto params = gridParams();
  params.reconstructor.method = ReconstructionMethod::kRoomBoundary;
  Pipeline pipeline(params);
  pipeline.sensor() = SensorModel::fromElevations(room.elevations_deg);
  const auto result = pipeline.process(without(cloud, surfaces, Surface::kFloor).view());
  for (std::size_t i = 0; i < result.surface.size(); ++i) {
    ASSERT_EQ(result.surface.provenance[i], Provenance::kReconstructed);
    ASSERT_LE(std::fabs(result.surface.x[i]), 3.41F);
    ASSERT_LE(std::fabs(result.surface.y[i]), 3.01F);
    ASSERT_NEAR(result.surface.z[i], -0.7, 1e-5);  // the mounting's word alone
  }
  // 6.8 x 6 m up to every corner, in cells of 0.1 m; walls may cut a cell on either side.
  EXPECT_GT(floorArea(result.occupancy), 0.97 * 6.8 * 6.0);
  EXPECT_LE(floorArea(result.occupancy), 7.0 * 6.2);
}

TEST(Pipeline, RemovesDarkScatteredPointsAndKeepsTheRoom) {
  const BoxRoom room = boxRoom();
  Cloud cloud = room.scan();
  const std::size_t room_points = cloud.size();
  Uniform uniform(1);
  for (int i = 0; i < 300; ++i) {  // far too sparse for 100 neighbours
    const double azimuth_deg = uniform(0.0, 360.0);
    const double r = uniform(0.1, 0.2);
    const double z = uniform(0.5, 1.0);
    cloud.addPolar(azimuth_deg, r, z, i % 41, 3.0);
  }
  auto params = gridParams();
  params.denoiser.alpha = 0.01;
  const auto result = Pipeline(params).process(cloud.view());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ASSERT_EQ(result.labels[i] == Label::kNoise, i >= room_points) << i;
  }
}

TEST(Pipeline, ClustersExactlyTheWallPoints) {
  const Cloud cloud = boxRoom().scan();
  const auto result = Pipeline(gridParams()).process(cloud.view());
  std::size_t walls = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ASSERT_EQ(result.labels[i] == Label::kWall, result.clusters[i] != kNoCluster);
    if (result.labels[i] == Label::kWall) ++walls;
  }
  EXPECT_GT(walls, 5000U);
}

TEST(Pipeline, DropsWholeWallsAtThePrintedMaximum) {  // why max_cluster_size 0 is recommended
  auto params = gridParams();
  params.segmenter.clustering.max_cluster_size = 5000;
  const auto result = Pipeline(params).process(boxRoom().scan().view());
  EXPECT_EQ(std::count(result.clusters.begin(), result.clusters.end(), kNoCluster),
            static_cast<std::ptrdiff_t>(result.clusters.size()));
}

TEST(Pipeline, TakesNoReturnsForSuchHoweverPointsArePacked) {
  constexpr std::size_t kStep = 4 * sizeof(float) + sizeof(std::uint16_t);
  Cloud cloud = boxRoom().scan();
  cloud = cloud.select(shuffledIndices(cloud.size() - 1, 3));  // no multiple of four
  std::vector<bool> is_return(cloud.size(), true);
  const auto infinity = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < cloud.size(); i += 3 + i % 5) {  // at every place of four
    const float bad = std::array<float, 4>{std::nanf(""), infinity, -1e7F, 0.0F}[i % 4];
    is_return[i] = false;
    (i % 3 == 0 ? cloud.x : i % 3 == 1 ? cloud.y : cloud.z)[i] = bad;
    if (bad == 0.0F) cloud.x[i] = cloud.y[i] = cloud.z[i] = 0.0F;
  }
  std::vector<unsigned char> packed(cloud.size() * kStep);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::array<float, 4> fields = {cloud.x[i], cloud.y[i], cloud.z[i], cloud.intensity[i]};
    std::memcpy(&packed[i * kStep], fields.data(), sizeof(fields));
    std::memcpy(&packed[i * kStep + sizeof(fields)], &cloud.ring[i], sizeof(std::uint16_t));
  }
  ScanView view;
  view.x = {packed.data(), kStep};
  view.y = {packed.data() + 4, kStep};
  view.z = {packed.data() + 8, kStep};
  view.intensity = {packed.data() + 12, kStep};
  view.ring = {packed.data() + 16, kStep};
  view.size = cloud.size();

  PipelineParams params = gridParams();
  params.reconstructor.method = ReconstructionMethod::kRoomBoundary;
  const auto side_by_side = Pipeline(params).process(view);
  const auto apart = Pipeline(params).process(cloud.view());
  EXPECT_EQ(side_by_side.labels, apart.labels);
  EXPECT_EQ(sortedPoints(side_by_side.surface), sortedPoints(apart.surface));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(apart.labels[i] != Label::kInvalid, is_return[i]) << i;
  }
}

TEST(Pipeline, RepeatsItself) {
  const Cloud cloud = boxRoom().scan();
  Pipeline pipeline(gridParams());
  const auto first = pipeline.process(cloud.view());
  const auto second = pipeline.process(cloud.view());
  EXPECT_EQ(first.labels, second.labels);
  EXPECT_EQ(first.clusters, second.clusters);
  EXPECT_EQ(first.surface.x, second.surface.x);
  EXPECT_EQ(first.surface.y, second.surface.y);
  EXPECT_EQ(first.surface.z, second.surface.z);
  EXPECT_EQ(first.occupancy.cells, second.occupancy.cells);
}

TEST(Pipeline, DoesNotHangOnTheOrderOfPoints) {
  BoxRoom room = boxRoom();
  room.azimuths = 300;
  const Cloud cloud = room.scan();
  const auto plain = Pipeline(gridParams()).process(cloud.view());
  const Cloud shuffled = cloud.select(shuffledIndices(cloud.size(), 8));
  const auto other = Pipeline(gridParams()).process(shuffled.view());
  EXPECT_EQ(sortedPoints(plain.surface), sortedPoints(other.surface));
  EXPECT_EQ(plain.occupancy.cells, other.occupancy.cells);
}

TEST(Pipeline, DoesNotHangOnTheNumberingOfRings) {
  BoxRoom upward = boxRoom();
  BoxRoom downward = boxRoom();
  std::reverse(downward.elevations_deg.begin(), downward.elevations_deg.end());
  const auto a = Pipeline(gridParams()).process(upward.scan().view());
  const auto b = Pipeline(gridParams()).process(downward.scan().view());
  EXPECT_EQ(sortedPoints(a.surface), sortedPoints(b.surface));
}

TEST(Pipeline, LevelsATiltedSensor) {
  const double c = std::cos(10.0 * M_PI / 180.0);
  const double s = std::sin(10.0 * M_PI / 180.0);
  Mounting mounting;
  mounting.rotation = {c, 0, s, 0, 1, 0, -s, 0, c};
  const Cloud level = boxRoom().scan();
  Cloud tilted;
  for (std::size_t i = 0; i < level.size(); ++i) {
    const auto p = mounting.toSensor(level.x[i], level.y[i], level.z[i]);
    tilted.add(p[0], p[1], p[2], level.ring[i]);
  }
  Pipeline pipeline(gridParams());
  pipeline.sensor() = SensorModel::fromElevations(boxRoom().elevations_deg);
  const auto result = pipeline.process(tilted.view(), mounting);
  ASSERT_GT(result.surface.size(), 1000U);
  for (std::size_t i = 0; i < result.surface.size(); ++i) {
    const auto p = mounting.toLevel(result.surface.x[i], result.surface.y[i], result.surface.z[i]);
    ASSERT_NEAR(p[2], -0.7, 0.01);
    ASSERT_LE(std::fabs(p[0]), 3.41F);
  }
}

TEST(Pipeline, TakesTheSensorsHeightFromItsParameters) {
  auto params = gridParams();
  params.reconstructor.sensor_height = 0.31;
  const auto result = Pipeline(params).process(ScanView());
  EXPECT_EQ(result.surface.floor_plane[2], -0.31);
}

TEST(Pipeline, RefusesTheKdTreeWithoutPcl) {
  EXPECT_THROW(Pipeline{PipelineParams()}, std::invalid_argument);
}

void expectRefusal(const std::string& name, const std::function<void(PipelineParams*)>& spoil) {
  PipelineParams params = gridParams();
  spoil(&params);
  try {
    const Pipeline pipeline(params);
    ADD_FAILURE() << name << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).rfind(name + " must be ", 0), 0U) << error.what();
  }
}

TEST(PipelineParams, NameTheParameterTheyRefuse) {
  using P = PipelineParams;
  expectRefusal("sensor_height", [](P* p) { p->reconstructor.sensor_height = 0.0; });
  expectRefusal("sensor_height", [](P* p) { p->reconstructor.sensor_height = kNan; });
  expectRefusal("occupancy_resolution",
                [](P* p) { p->reconstructor.occupancy_resolution = 0.001; });
  expectRefusal("alpha", [](P* p) { p->denoiser.alpha = -1.0; });
  expectRefusal("column_width_deg", [](P* p) { p->segmenter.segmentation.column_width_deg = 7.0; });
  expectRefusal("cluster_tolerance", [](P* p) { p->segmenter.clustering.cluster_tolerance = 0.0; });
  expectRefusal("segment_angle_deg",
                [](P* p) { p->reconstructor.polar_segments.segment_angle_deg = 7.0; });
}

}  // namespace
}  // namespace smoke_ground_reconstruction
