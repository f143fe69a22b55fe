#include <gtest/gtest.h>

#include <cmath>

#include "clouds.hpp"
#include "counted_memory.hpp"
#include "smoke_ground_reconstruction/agdor_filter.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"
#include "smoke_ground_reconstruction/room_boundary.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {
namespace {

/// A room whose points are partly dark, so that every stage has work.
Cloud room() {
  BoxRoom room;
  room.elevations_deg = evenElevations(32, -50.0, 25.0);
  room.azimuths = 300;
  Cloud cloud = room.scan();
  for (std::size_t i = 0; i < cloud.size(); i += 5) cloud.intensity[i] = 1.0F;
  return cloud;
}

/// Allocations of the third call: the first two fetch what is handed on.
template <typename Work>
std::size_t allocationsOf(const Work& work) {
  work();
  work();
  const std::size_t before = countedMemory().allocations;
  work();
  return countedMemory().allocations - before;
}

// What is handed out is new each time: somebody else keeps it.
constexpr std::size_t kAnswer = 1;

class SteadyState : public ::testing::Test {
 protected:
  const Cloud cloud_ = room();
  const Scan scan_{cloud_.view()};
  const std::vector<Label> kept_ = std::vector<Label>(scan_.size(), Label::kKept);
};

TEST_F(SteadyState, LaysScansOutInTheSameMemory) {
  Mounting tilted;
  tilted.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_EQ(allocationsOf([&] { EXPECT_GT(Scan(cloud_.view(), tilted).size(), 0U); }), 0U);
}

TEST_F(SteadyState, WatchesASensorWithoutMemory) {
  SensorModel sensor;
  EXPECT_EQ(allocationsOf([&] { sensor.observe(cloud_.view()); }), 0U);
}

TEST_F(SteadyState, SortsColumnsInTheSameMemory) {
  SensorModel sensor;
  sensor.observe(cloud_.view());
  const std::vector<std::uint8_t> use(scan_.size(), 1);
  for (const double width_deg : {0.01, 0.4}) {
    const AzimuthBins bins(width_deg);
    EXPECT_EQ(allocationsOf([&] {
                EXPECT_EQ(ScanColumns(scan_, use, bins, sensor).order.size(), scan_.size());
              }),
              0U);
  }
}

TEST_F(SteadyState, DenoisesInTheSameMemory) {
  AgdorParams printed;
  AgdorParams few;
  few.min_neighbors = 2;
  few.max_neighbors = 0;
  few.theta_unit = ThetaUnit::kRadians;
  few.alpha = 3.0;
  const auto allocationsWith = [&](const AgdorParams& params) {
    const AgdorFilter filter(params);
    return allocationsOf([&] { EXPECT_FALSE(filter.classify(scan_).empty()); });
  };
  const std::size_t counter = 1;  // the engine itself
  EXPECT_EQ(allocationsWith(printed), kAnswer + counter);
  EXPECT_EQ(allocationsWith(few), kAnswer);  // on the raster
}

TEST_F(SteadyState, SegmentsInTheSameMemory) {
  SensorModel sensor;
  sensor.observe(cloud_.view());
  const ChannelSegmentation segmentation{ChannelSegmentationParams()};
  EXPECT_EQ(
      allocationsOf([&] { EXPECT_FALSE(segmentation.classify(scan_, kept_, sensor).empty()); }),
      kAnswer);
}

TEST_F(SteadyState, ClustersInTheSameMemory) {
  const std::size_t components = 1;  // the engine's answer
  WallClusteringParams params;
  params.cluster_engine = ClusterEngine::kGrid;
  const std::vector<Label> walls(scan_.size(), Label::kWall);
  for (const double per_range : {0.0, 0.01}) {
    params.cluster_tolerance_per_range = per_range;
    const WallClustering clustering(params);
    EXPECT_EQ(allocationsOf([&] { EXPECT_FALSE(clustering.cluster(scan_, walls).empty()); }),
              kAnswer + components);
  }
}

TEST_F(SteadyState, FindsTheRoomInTheSameMemory) {
  SensorModel sensor;
  sensor.observe(cloud_.view());
  Mounting tilted;
  tilted.rotation = {std::cos(0.05),  0, std::sin(0.05), 0, 1, 0,
                     -std::sin(0.05), 0, std::cos(0.05)};
  for (const Mounting& mounting : {Mounting(), tilted}) {
    RoomBoundary method;
    RoomBoundaryResult result;
    EXPECT_EQ(allocationsOf([&] {
                method.reconstruct(cloud_.view(), sensor, mounting, &result);
                EXPECT_GT(result.surface.size(), 0U);
              }),
              0U);
  }
}

TEST_F(SteadyState, ProcessesARoomInTheSameMemory) {
  PipelineParams params;
  params.segmenter.clustering.cluster_engine = ClusterEngine::kGrid;
  params.reconstructor.method = ReconstructionMethod::kRoomBoundary;
  Pipeline pipeline(params);
  PipelineResult result;
  EXPECT_EQ(allocationsOf([&] {
              pipeline.process(cloud_.view(), Mounting(), &result);
              EXPECT_GT(result.surface.size(), 0U);
            }),
            0U);
}

TEST_F(SteadyState, DrawsAMapInTheSameMemory) {
  RoomBoundary method;
  RoomBoundaryResult room;
  SensorModel sensor;
  sensor.observe(cloud_.view());
  method.reconstruct(cloud_.view(), sensor, Mounting(), &room);
  OccupancyGrid grid;
  EXPECT_EQ(allocationsOf([&] {
              rasterize(room.surface, cloud_.view(), Mounting(), 0.1, kOccupancyRange, &grid);
              EXPECT_FALSE(grid.cells.empty());
            }),
            0U);
}

TEST(Recycled, HandsItsMemoryOn) {
  const float* first = Recycled<float>(1000).data();
  EXPECT_EQ(Recycled<float>(1000).data(), first);
  EXPECT_TRUE(Recycled<float>().empty());
}

TEST(Recycled, CopiesAndMovesAsAVectorDoes) {
  Recycled<int> one(3);
  one[1] = 7;
  const Recycled<int> copy = one;
  EXPECT_EQ(copy, one);
  EXPECT_NE(copy.data(), one.data());
  const int* data = one.data();
  const Recycled<int> moved = std::move(one);
  EXPECT_EQ(moved.data(), data);
  EXPECT_EQ(moved, copy);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
