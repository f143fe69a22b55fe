#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {
namespace {

using Clusters = std::vector<std::uint32_t>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t kNone = kNoCluster;

WallClusteringParams tolerance(double metres, int min_size = 1, int max_size = 0) {
  WallClusteringParams params;
  params.cluster_tolerance = metres;
  params.min_cluster_size = min_size;
  params.max_cluster_size = max_size;
  params.cluster_engine = ClusterEngine::kGrid;
  return params;
}

Clusters cluster(const Cloud& cloud, const WallClusteringParams& params) {
  return WallClustering(params).cluster(Scan(cloud.view()),
                                        std::vector<Label>(cloud.size(), Label::kWall));
}

/// Points 1 cm apart on the wall y = `y`.
void addWall(Cloud* cloud, int points, double y) {
  for (int i = 0; i < points; ++i) cloud->add(0.01 * i, y, 0);
}

/// The same partition, numbered by first appearance.
Clusters renumbered(const Clusters& components) {
  std::map<std::uint32_t, std::uint32_t> number;
  Clusters result;
  for (const std::uint32_t c : components) {
    result.push_back(number.emplace(c, static_cast<std::uint32_t>(number.size())).first->second);
  }
  return result;
}

/// Components by asking every pair until nothing changes.
Clusters bruteForceComponents(const WallClusteringParams& params, const Scan& scan,
                              const std::vector<std::uint32_t>& points) {
  Clusters component(points.size());
  for (std::uint32_t k = 0; k < points.size(); ++k) component[k] = k;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t a = 0; a < points.size(); ++a) {
      for (std::size_t b = 0; b < points.size(); ++b) {
        if (component[b] <= component[a]) continue;
        if (!areLinked(params, scan.point(points[a]), scan.point(points[b]))) continue;
        component[b] = component[a];
        changed = true;
      }
    }
  }
  return component;
}

void expectExactComponents(const WallClusteringParams& params, const Cloud& cloud) {
  const Scan scan(cloud.view());
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < scan.size(); i += 2) points.push_back(i);  // not all of them
  EXPECT_EQ(renumbered(findComponentsOnGrid(params, scan, points)),
            renumbered(bruteForceComponents(params, scan, points)));
}

TEST(AreLinked, IsStrict) {
  const auto params = tolerance(0.5);
  EXPECT_FALSE(areLinked(params, {1.0F, 0.0F, 0.0F}, {1.5F, 0.0F, 0.0F}));
  EXPECT_TRUE(areLinked(params, {1.0F, 0.0F, 0.0F}, {std::nextafter(1.5F, 0.0F), 0.0F, 0.0F}));
}

TEST(AreLinked, HoldsForPointsInTheSamePlace) {
  EXPECT_TRUE(areLinked(tolerance(1e-9), {1.0F, 2.0F, 3.0F}, {1.0F, 2.0F, 3.0F}));
}

TEST(AreLinked, AddsToTheToleranceByTheRangeOfTheNearerPoint) {
  auto params = tolerance(0.25);
  params.cluster_tolerance_per_range = 0.5;
  const std::array<float, 3> near = {0.5F, 0.0F, 0.0F};  // tolerance 0.25 + 0.5 * 0.5 = 0.5
  EXPECT_FALSE(areLinked(params, near, {1.0F, 0.0F, 0.0F}));
  EXPECT_FALSE(areLinked(params, {1.0F, 0.0F, 0.0F}, near));
  EXPECT_TRUE(areLinked(params, near, {0.99F, 0.0F, 0.0F}));
  EXPECT_TRUE(areLinked(params, {0.99F, 0.0F, 0.0F}, near));
}

TEST(WallClustering, OfNothingSaysNothing) { EXPECT_TRUE(cluster(Cloud(), tolerance(1)).empty()); }

TEST(WallClustering, NumbersTheOnlyPoint) {
  Cloud cloud;
  cloud.add(1, 0, 0);
  EXPECT_EQ(cluster(cloud, tolerance(0.1)), Clusters{0});
}

TEST(WallClustering, LeavesLabelsOtherThanWallsAlone) {
  Cloud cloud;
  addWall(&cloud, 5, 1.0);
  const WallClustering clustering(tolerance(0.05));
  const Clusters clusters = clustering.cluster(
      Scan(cloud.view()),
      {Label::kGround, Label::kKept, Label::kWall, Label::kNoise, Label::kInvalid});
  EXPECT_EQ(clusters, (Clusters{kNone, kNone, 0, kNone, kNone}));
}

TEST(WallClustering, DoesNotLinkWallsOverOtherPoints) {
  Cloud cloud;
  addWall(&cloud, 3, 1.0);
  const WallClustering clustering(tolerance(0.015));
  EXPECT_EQ(clustering.cluster(Scan(cloud.view()), {Label::kWall, Label::kGround, Label::kWall}),
            (Clusters{0, kNone, 1}));
}

TEST(WallClustering, LinksAlongAChain) {
  Cloud cloud;
  addWall(&cloud, 200, 1.0);  // 2 m long, links of 1 cm
  EXPECT_EQ(cluster(cloud, tolerance(0.011)), Clusters(200, 0));
}

TEST(WallClustering, SeparatesAtTheTolerance) {
  Cloud cloud;
  cloud.add(1.0, 0, 0);
  cloud.add(1.5, 0, 0);
  EXPECT_EQ(cluster(cloud, tolerance(0.5)), (Clusters{0, 1}));
  EXPECT_EQ(cluster(cloud, tolerance(0.5001)), (Clusters{0, 0}));
}

TEST(WallClustering, NumbersBySmallestIndex) {
  Cloud cloud;
  for (const double x : {5.0, -5.0, 5.01, 0.0, -5.01}) cloud.add(x, 1, 0);
  EXPECT_EQ(cluster(cloud, tolerance(0.05)), (Clusters{0, 1, 0, 2, 1}));
}

TEST(WallClustering, KeepsClustersOfTheMinimumSize) {
  Cloud cloud;
  addWall(&cloud, 4, 1.0);
  addWall(&cloud, 5, 2.0);
  EXPECT_EQ(cluster(cloud, tolerance(0.05, 5)),
            (Clusters{kNone, kNone, kNone, kNone, 0, 0, 0, 0, 0}));
}

TEST(WallClustering, KeepsClustersOfTheMaximumSize) {
  Cloud cloud;
  addWall(&cloud, 5, 1.0);
  addWall(&cloud, 4, 2.0);
  EXPECT_EQ(cluster(cloud, tolerance(0.05, 1, 4)),
            (Clusters{kNone, kNone, kNone, kNone, kNone, 0, 0, 0, 0}));
}

TEST(WallClustering, MaximumZeroMeansUnlimited) {
  Cloud cloud;
  addWall(&cloud, 6000, 1.0);
  EXPECT_EQ(cluster(cloud, tolerance(0.05, 50, 0)), Clusters(6000, 0));
}

TEST(WallClustering, DropsAWholeWallAboveThePrintedMaximum) {  // Table A.1: 50 / 5000
  Cloud cloud;
  addWall(&cloud, 5001, 1.0);
  EXPECT_EQ(cluster(cloud, tolerance(0.05, 50, 5000)), Clusters(5001, kNone));
}

TEST(WallClustering, LeavesOutInvalidPointsWhateverTheirLabel) {
  Cloud cloud;
  cloud.add(1, 0, 0);
  cloud.add(kNan, 0, 0);
  cloud.add(1.01, 0, 0);
  EXPECT_EQ(cluster(cloud, tolerance(0.05)), (Clusters{0, kNone, 0}));
}

TEST(WallClustering, PartitionsAShuffledScanAlike) {
  Cloud cloud;
  Uniform uniform(3);
  for (int i = 0; i < 600; ++i) {
    const double x = uniform(-2.0, 2.0);
    const double y = uniform(-2.0, 2.0);
    cloud.add(x, y, 0.3);
  }
  const Clusters plain = cluster(cloud, tolerance(0.12, 3, 40));
  const auto order = shuffledIndices(cloud.size(), 9);
  const Clusters shuffled = cluster(cloud.select(order), tolerance(0.12, 3, 40));
  std::map<std::uint32_t, std::uint32_t> partner;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t expected = plain[order[i]];
    EXPECT_EQ(partner.emplace(shuffled[i], expected).first->second, expected);
    EXPECT_EQ(shuffled[i] == kNone, expected == kNone);
  }
}

TEST(WallClustering, AsksTheEngineItIsGiven) {
  auto params = tolerance(0.5);
  params.cluster_engine = ClusterEngine::kKdTree;
  const WallClustering clustering(params, [](const WallClusteringParams&, const Scan&,
                                             const std::vector<std::uint32_t>& points) {
    return Clusters(points.size(), 7);  // all one, though far apart
  });
  Cloud cloud;
  cloud.add(1, 0, 0);
  cloud.add(-9, 0, 0);
  EXPECT_EQ(clustering.cluster(Scan(cloud.view()), {Label::kWall, Label::kWall}), (Clusters{0, 0}));
}

TEST(WallClustering, RefusesTheKdTreeEngineWithoutOne) {
  EXPECT_THROW(WallClustering{WallClusteringParams()}, std::invalid_argument);
}

TEST(FindComponentsOnGrid, IsExactForScatteredPoints) {
  for (const double metres : {1e-6, 0.05, 0.2, 0.31, 1.0, 50.0}) {
    Cloud cloud;
    Uniform uniform(11);
    for (int i = 0; i < 500; ++i) {
      const double x = uniform(-2.0, 2.0);
      const double y = uniform(-2.0, 2.0);
      const double z = uniform(-0.5, 0.5);
      cloud.add(x, y, z);
    }
    SCOPED_TRACE("tolerance " + std::to_string(metres));
    expectExactComponents(tolerance(metres), cloud);
  }
}

TEST(FindComponentsOnGrid, IsExactWithAToleranceThatGrows) {
  Cloud cloud;
  addWall(&cloud, 50, 0.02);
  Uniform uniform(12);
  for (int i = 0; i < 400; ++i) {
    const double azimuth_deg = uniform(0.0, 360.0);
    const double r = uniform(0.1, 12.0);
    cloud.addPolar(azimuth_deg, r, 0.0);
  }
  auto params = tolerance(0.02);
  params.cluster_tolerance_per_range = 0.03;
  expectExactComponents(params, cloud);
}

TEST(FindComponentsOnGrid, IsExactForPointsOnTheCellsFaces) {
  Cloud cloud;
  for (int i = -12; i <= 12; ++i) {
    for (int j = -3; j <= 3; ++j) cloud.add(0.25 * i, 0.25 * j, -0.25 * (i % 3));
  }
  for (const double metres : {0.25, 0.2500001, 0.36}) {
    expectExactComponents(tolerance(metres), cloud);
  }
}

/// Components of two heaps of 21 points each, `gap` metres apart along x. Each rises by 20 mm as it
/// recedes from the other, the second from `rise` metres on, or falls as much from there.
std::size_t componentsOfHeaps(float gap, double rise, double metres) {
  Cloud cloud;
  for (int i = 0; i <= 20; ++i) {
    const double x = 0.0009765625 * i;
    cloud.add(-x, 1.0, 0.001 * i);
    cloud.add(static_cast<double>(gap) + x, 1.0, rise == 0.0 ? 0.001 * i : rise - 0.001 * i);
  }
  expectExactComponents(tolerance(metres), cloud);
  const Clusters clusters = cluster(cloud, tolerance(metres));
  return std::size_t{1} + *std::max_element(clusters.begin(), clusters.end());
}

TEST(FindComponentsOnGrid, LinksDenseCellsByTheirNearestPoints) {
  EXPECT_EQ(componentsOfHeaps(0.24F, 0.0, 0.25), 1U);
  EXPECT_EQ(componentsOfHeaps(std::nextafter(0.25F, 0.0F), 0.0, 0.25), 1U);
  EXPECT_EQ(componentsOfHeaps(0.25F, 0.0, 0.25), 2U);  // strictly nearer
  // The nearest two points are 0.2498 m apart along x and 0.02 m in height: 0.2506 m.
  EXPECT_EQ(componentsOfHeaps(0.2498F, 0.02, 0.25), 2U);
  EXPECT_EQ(componentsOfHeaps(0.2498F, 0.02, 0.251), 1U);
}

/// Points 5 cm apart on the wall y = 1, of x from `from_x` to `to_x` and z from `from_z` to `to_z`.
void addPanel(Cloud* cloud, double from_x, double to_x, double from_z, double to_z) {
  for (double x = from_x; x < to_x + 0.01; x += 0.05) {
    for (double z = from_z; z < to_z + 0.01; z += 0.05) cloud->add(x, 1.0, z);
  }
}

TEST(FindComponentsOnGrid, JoinsPanelsAboveEachOtherWhereTheyMeetAlone) {
  Cloud cloud;
  addPanel(&cloud, 0.0, 3.0, -1.0, -0.5);
  const std::size_t lower = cloud.size();
  addPanel(&cloud, 0.0, 3.0, 0.0, 1.0);  // 0.5 m above the other
  Clusters clusters = cluster(cloud, tolerance(0.2));
  EXPECT_EQ(std::count(clusters.begin(), clusters.end(), 0U), lower);
  EXPECT_EQ(std::count(clusters.begin(), clusters.end(), 1U), cloud.size() - lower);
  addPanel(&cloud, 3.15, 3.3, -1.0, 1.0);  // 0.15 m beside both, whole from bottom to top
  clusters = cluster(cloud, tolerance(0.2));
  EXPECT_EQ(std::count(clusters.begin(), clusters.end(), 0U), cloud.size());
  EXPECT_EQ(cluster(cloud, tolerance(0.14)).back(), 2U);
}

TEST(FindComponentsOnGrid, IsExactForDenseColumnsWithGaps) {
  for (const double share : {0.2, 0.5, 0.8}) {  // of the points that are there
    Cloud cloud;
    Uniform uniform(13);
    for (int i = 0; i < 40; ++i) {
      for (int k = 0; k < 30; ++k) {
        if (uniform(0.0, 1.0) < share) cloud.add(0.05 * i, 1.0 + 0.02 * (i % 3), 0.1 * k);
      }
    }
    SCOPED_TRACE("share " + std::to_string(share));
    for (const double metres : {0.11, 0.15, 0.21}) expectExactComponents(tolerance(metres), cloud);
  }
}

TEST(FindComponentsOnGrid, IsExactBeyondTheCellsItCanNumber) {  // 2^20 cells of 1 mm are 1049 m
  Cloud cloud;
  for (int i = 0; i < 60; ++i) cloud.add(1040.0 + 0.5 * i, -2e5, 1e6);
  cloud.add(1040.0, -2e5, 1e6);
  cloud.add(1040.0, -2e5, 1e6);
  expectExactComponents(tolerance(0.001), cloud);
  expectExactComponents(tolerance(0.6), cloud);
}

TEST(WallClusteringParams, AcceptsEveryLimit) {
  EXPECT_NO_THROW(tolerance(1e-9, 1, 1).validate());
  EXPECT_NO_THROW(tolerance(10.0, 100, 0).validate());
}

void expectRefusal(const std::string& name,
                   const std::function<void(WallClusteringParams*)>& spoil) {
  WallClusteringParams params = tolerance(0.05, 50, 5000);
  spoil(&params);
  try {
    const WallClustering clustering(params);
    ADD_FAILURE() << name << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).rfind(name + " must be ", 0), 0U) << error.what();
  }
}

TEST(WallClusteringParams, NamesTheParameterItRefuses) {
  using P = WallClusteringParams;
  expectRefusal("cluster_tolerance", [](P* p) { p->cluster_tolerance = 0.0; });
  expectRefusal("cluster_tolerance", [](P* p) { p->cluster_tolerance = kNan; });
  expectRefusal("cluster_tolerance_per_range", [](P* p) { p->cluster_tolerance_per_range = -0.1; });
  expectRefusal("min_cluster_size", [](P* p) { p->min_cluster_size = 0; });
  expectRefusal("max_cluster_size", [](P* p) { p->max_cluster_size = 49; });
  expectRefusal("max_cluster_size", [](P* p) { p->max_cluster_size = -1; });
}

}  // namespace
}  // namespace smoke_ground_reconstruction
