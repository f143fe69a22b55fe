#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/raster_crowds.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();
constexpr double kDegree = M_PI / 180.0;

const AzimuthBins kBins(2.0);  // 180 columns: eleven stripes and a quarter

/// More than two within three columns.
const Crowd kFew = {6.0 * kDegree, 2, kUnlimited};

std::vector<std::uint8_t> outsidersByBruteForce(const Scan& scan, const Crowd& crowd) {
  std::vector<std::uint8_t> is_outside(scan.size(), 0);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.valid[i] == 0) continue;
    const double radius = crowd.radius_per_range * range(scan.x[i], scan.y[i], scan.z[i]);
    std::size_t neighbors = 0;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      if (k == i || scan.valid[k] == 0) continue;
      const double d2 =
          squaredDistance(scan.x[k], scan.y[k], scan.z[k], scan.x[i], scan.y[i], scan.z[i]);
      neighbors += d2 < radius * radius ? 1 : 0;
    }
    is_outside[i] = neighbors > crowd.more_than ? 0 : 1;
  }
  return is_outside;
}

ScanRaster rasterOf(const Scan& scan) {
  return {scan, std::vector<Label>(scan.size(), Label::kKept), kBins};
}

void expectExact(const Cloud& cloud) {
  const Scan scan(cloud.view());
  const ScanRaster raster = rasterOf(scan);
  ASSERT_FALSE(raster.is_crowded);
  for (const std::size_t more_than : {0U, 1U, 2U, 5U, 12U}) {
    for (const double columns : {0.5, 1.0, 3.0}) {
      const Crowd crowd = {columns * 2.0 * kDegree, more_than, kUnlimited};
      std::vector<std::uint8_t> found;
      ASSERT_TRUE(findOutsiders(scan, raster, crowd, &found));
      EXPECT_EQ(found, outsidersByBruteForce(scan, crowd))
          << "more than " << more_than << " within " << columns << " columns";
    }
  }
}

/// A room whose every n-th ray ends in smoke.
Cloud smokyRoom(int n, unsigned seed) {
  BoxRoom room;
  room.elevations_deg = evenElevations(12, -40.0, 40.0);
  room.azimuths = 180;
  Cloud cloud = room.scan();
  Uniform uniform(seed);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double part = uniform(0.1, 0.6);
    if (uniform(0.0, static_cast<double>(n)) > 1.0) continue;
    for (auto* values : {&cloud.x, &cloud.y, &cloud.z}) {
      (*values)[i] = static_cast<float>((*values)[i] * part);
    }
  }
  return cloud;
}

/// Every n-th point once more, some farther, some at the same place.
void addAgain(std::size_t n, unsigned seed, Cloud* cloud) {
  Uniform uniform(seed);
  for (std::size_t i = 0, size = cloud->size(); i < size; i += n) {
    const double times = i % 3 == 0 ? 1.0 : uniform(0.9, 1.3);
    cloud->add(times * cloud->x[i], times * cloud->y[i], times * cloud->z[i], cloud->ring[i]);
  }
}

TEST(RasterCrowds, MayTellNothingOfLargeLimitedOrFarCrowds) {
  EXPECT_TRUE(mayFindOutsiders(kFew, 180));
  EXPECT_FALSE(mayFindOutsiders({6.0 * kDegree, 100, kUnlimited}, 180));
  EXPECT_FALSE(mayFindOutsiders({6.0 * kDegree, 2, 5000}, 180));
  EXPECT_FALSE(mayFindOutsiders({0.3, 2, kUnlimited}, 180));
  EXPECT_FALSE(mayFindOutsiders({1.5, 2, kUnlimited}, 180));
  EXPECT_FALSE(mayFindOutsiders(kFew, 90));
}

TEST(RasterCrowds, AreExactInSmoke) {
  for (const unsigned seed : {1U, 2U}) expectExact(smokyRoom(4, seed));
}

TEST(RasterCrowds, AreExactForDualReturns) {
  Cloud cloud = smokyRoom(2, 3);
  addAgain(1, 4, &cloud);
  expectExact(cloud);
}

TEST(RasterCrowds, CountWhatFoundItsPlaceTaken) {
  Cloud cloud = smokyRoom(2, 5);
  addAgain(40, 6, &cloud);
  ASSERT_EQ(rasterOf(Scan(cloud.view())).extras.size(), 54U);
  expectExact(cloud);
}

TEST(RasterCrowds, AreExactWhateverTheOrderOfTheRings) {
  Cloud cloud = smokyRoom(4, 7);
  for (auto& ring : cloud.ring) ring = static_cast<std::uint16_t>(ring * 5 % 12);
  cloud.ring[100] = 11;  // and one of them said wrong
  expectExact(cloud);
}

TEST(RasterCrowds, LeaveInvalidPointsOut) {
  Cloud cloud = smokyRoom(4, 8);
  for (std::size_t i = 0; i < cloud.size(); i += 7) cloud.x[i] = NAN;
  for (std::size_t i = 3; i < cloud.size(); i += 50) cloud.x[i] = cloud.y[i] = cloud.z[i] = 0.0F;
  expectExact(cloud);
}

TEST(RasterCrowds, AreExactWhereNeighborsAreEquallyFar) {  // as far as the radius itself
  Cloud cloud;
  for (int column = 0; column < 180; ++column) {
    for (int ring = 0; ring < 3; ++ring) {
      cloud.addPolar(2.0 * column + 1.0, 2.0, 0.1 * (ring - 1), ring);
    }
  }
  const Scan scan(cloud.view());
  const Crowd crowd = {2.0 * std::sin(1.0 * kDegree), 1, kUnlimited};
  std::vector<std::uint8_t> found;
  ASSERT_TRUE(findOutsiders(scan, rasterOf(scan), crowd, &found));
  EXPECT_EQ(found, outsidersByBruteForce(scan, crowd));
}

TEST(RasterCrowds, KnowNothingOfSteepRows) {
  Cloud cloud = smokyRoom(4, 9);
  cloud.add(0.001, 0.0, 1.0, 0);
  const Scan scan(cloud.view());
  std::vector<std::uint8_t> found;
  EXPECT_FALSE(findOutsiders(scan, rasterOf(scan), kFew, &found));
}

TEST(RasterCrowds, KnowNothingOfPointsNextToTheSensor) {
  Cloud cloud = smokyRoom(4, 10);
  cloud.add(1e-12, 0.0, 0.0, 5);
  const Scan scan(cloud.view());
  std::vector<std::uint8_t> found;
  EXPECT_FALSE(findOutsiders(scan, rasterOf(scan), kFew, &found));
}

}  // namespace
}  // namespace smoke_ground_reconstruction
