#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/window_counter.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Points on a sphere's shell, a crowd near the sensor, doubled and coincident points.
Cloud scattered(double scale, unsigned seed) {
  Cloud cloud;
  Uniform uniform(seed);
  for (int i = 0; i < 500; ++i) {
    const double azimuth_deg = uniform(0.0, 360.0);
    const double slope = uniform(-1.0, 1.0);
    const double r = scale * (i % 3 == 0 ? uniform(0.01, 0.2) : uniform(1.0, 6.0));
    const double intensity = uniform(0.0, 50.0);
    cloud.addPolar(azimuth_deg, r, slope * r, 0, intensity);
    if (i % 7 == 0) cloud.addPolar(azimuth_deg, r, slope * r, 0, 5.0);
  }
  cloud.add(kNan, 0, 0, 0, 5.0);
  cloud.add(0, 0, 0, 0, 5.0);
  return cloud;
}

TEST(KdTreeCounter, CountsAsTheWindowDoes) {
  for (const double scale : {1e-30, 1e-3, 1.0, 1e5}) {
    const Cloud cloud = scattered(scale, 1);
    const Scan scan(cloud.view());
    const auto tree = makeKdTreeCounter(scan);
    for (const double k : {0.0035, 0.2, 0.999, 1.5}) {
      const WindowCounter window(scan, k);
      for (std::size_t i = 0; i < scan.size(); ++i) {
        if (scan.valid[i] == 0) continue;
        const double radius = k * range(scan.x[i], scan.y[i], scan.z[i]);
        ASSERT_EQ(tree->count(i, radius * radius, kAll), window.count(i, radius * radius, kAll))
            << "point " << i << ", scale " << scale << ", radius " << k;
      }
    }
  }
}

TEST(KdTreeCounter, CountsStrictlyBelowTheRadius) {
  Cloud cloud;
  cloud.add(2.0, 0.0, 0.0);
  cloud.add(2.0, 0.5, 0.0);
  const Scan scan(cloud.view());
  const auto tree = makeKdTreeCounter(scan);
  EXPECT_EQ(tree->count(0, 0.25, kAll), 0U);
  EXPECT_EQ(tree->count(0, std::nextafter(0.25, 1.0), kAll), 1U);
  EXPECT_EQ(tree->count(0, 0.0, kAll), 0U);
}

TEST(KdTreeCounter, StopsAtTheLimit) {
  Cloud cloud;
  for (int i = 0; i < 50; ++i) cloud.add(3.0, 0.001 * i, 0.0);
  const Scan scan(cloud.view());
  EXPECT_EQ(makeKdTreeCounter(scan)->count(7, 0.36, 10), 10U);
  EXPECT_EQ(makeKdTreeCounter(scan)->count(7, 0.36, kAll), 49U);
}

TEST(KdTreeCounter, IsMadeOfNothingWithoutComplaint) {
  Cloud cloud;
  cloud.add(kNan, kNan, kNan);
  EXPECT_NO_THROW(makeKdTreeCounter(Scan(cloud.view())));
  EXPECT_NO_THROW(makeKdTreeCounter(Scan{ScanView()}));
}

TEST(KdTreeEngine, RemovesTheSamePointsAsTheWindow) {
  const Cloud cloud = scattered(1.0, 2);
  const Scan scan(cloud.view());
  for (const int most : {0, 30}) {
    AgdorParams params;
    params.min_neighbors = 6;
    params.max_neighbors = most;
    const auto window = AgdorFilter(params).classify(scan);
    params.engine = DenoiserEngine::kKdTree;
    EXPECT_EQ(AgdorFilter(params, makeKdTreeCounter).classify(scan), window);
  }
}

std::vector<std::uint32_t> renumbered(const std::vector<std::uint32_t>& components) {
  std::map<std::uint32_t, std::uint32_t> number;
  std::vector<std::uint32_t> result;
  for (const std::uint32_t c : components) {
    result.push_back(number.emplace(c, static_cast<std::uint32_t>(number.size())).first->second);
  }
  return result;
}

void expectSamePartition(const WallClusteringParams& params, const Cloud& cloud) {
  const Scan scan(cloud.view());
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    if (scan.valid[i] != 0) points.push_back(i);
  }
  EXPECT_EQ(renumbered(findComponentsWithPcl(params, scan, points)),
            renumbered(findComponentsOnGrid(params, scan, points)));
}

TEST(FindComponentsWithPcl, PartitionsAsTheGridDoes) {
  for (const double scale : {1.0, 1e4}) {
    for (const double tolerance : {0.01, 0.05, 0.2, 0.6}) {
      SCOPED_TRACE(std::to_string(tolerance) + " at scale " + std::to_string(scale));
      WallClusteringParams params;
      params.cluster_tolerance = tolerance * scale;
      expectSamePartition(params, scattered(scale, 3));
      params.cluster_tolerance_per_range = 0.02;
      expectSamePartition(params, scattered(scale, 4));
    }
  }
}

TEST(FindComponentsWithPcl, SeparatesAtTheTolerance) {
  Cloud cloud;
  for (int i = 0; i < 20; ++i) cloud.add(0.25 * i, 1, 0);
  WallClusteringParams params;
  params.cluster_tolerance = 0.25;
  expectSamePartition(params, cloud);
  const Scan scan(cloud.view());
  EXPECT_EQ(findComponentsWithPcl(params, scan, {0, 1}), (std::vector<std::uint32_t>{0, 1}));
}

TEST(FindComponentsWithPcl, LinksPointsInTheSamePlace) {
  Cloud cloud;
  for (int i = 0; i < 6; ++i) cloud.add(1, 1, i / 3);
  WallClusteringParams params;
  params.cluster_tolerance = 1e-6;
  expectSamePartition(params, cloud);
}

TEST(PclEngines, ServeTheStagesOfTheThesisWithTheirDefaults) {
  BoxRoom room;
  room.elevations_deg = evenElevations(31, -50.0, 25.0);
  const Cloud cloud = room.scan();
  PipelineParams params;  // kdtree clustering of 50 to 5000 points, tolerance 0.05 m
  params.reconstructor.method = ReconstructionMethod::kPolarSegments;
  const auto result = Pipeline(params, pclEngines()).process(cloud.view());
  PipelineParams grid = params;
  grid.segmenter.clustering.cluster_engine = ClusterEngine::kGrid;
  EXPECT_EQ(Pipeline(grid).process(cloud.view()).clusters, result.clusters);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
