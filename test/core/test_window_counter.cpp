#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/window_counter.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

std::size_t bruteForceCount(const Scan& scan, std::size_t index, double squared_radius) {
  std::size_t neighbors = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (i == index || scan.valid[i] == 0) continue;
    const double d2 = squaredDistance(scan.x[i], scan.y[i], scan.z[i], scan.x[index], scan.y[index],
                                      scan.z[index]);
    if (d2 < squared_radius) ++neighbors;
  }
  return neighbors;
}

/// Each point asked with the radius `asked` * range of a counter made for `built` * range.
void expectExactCounts(const Cloud& cloud, double built, double asked) {
  const Scan scan(cloud.view());
  const WindowCounter counter(scan, built);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.valid[i] == 0) continue;
    const double radius = asked * range(scan.x[i], scan.y[i], scan.z[i]);
    const std::size_t truth = bruteForceCount(scan, i, radius * radius);
    ASSERT_EQ(counter.count(i, radius * radius, kAll), truth) << "point " << i;
    for (const auto& [more_than, at_most] :
         {std::pair<std::size_t, std::size_t>{0, kAll}, {3, 20}, {truth, kAll}, {0, truth}}) {
      ASSERT_EQ(counter.isBetween(i, radius * radius, more_than, at_most),
                truth > more_than && truth <= at_most)
          << "point " << i << " between " << more_than << " and " << at_most;
    }
  }
}

/// All points asked together, half of them in no crowd or none of them, by a counter made for the
/// very radius, and by one that was not.
void expectExactOutsiders(const Cloud& cloud, double k) {
  const Scan scan(cloud.view());
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    if (scan.valid[i] != 0) points.push_back(i);
  }
  for (const auto& [more_than, at_most] :
       {std::pair<std::size_t, std::size_t>{0, kAll}, {2, kAll}, {7, kAll}, {30, kAll}, {2, 9}}) {
    std::vector<std::uint32_t> truth;
    for (const std::uint32_t i : points) {
      const double radius = k * range(scan.x[i], scan.y[i], scan.z[i]);
      const std::size_t neighbors = bruteForceCount(scan, i, radius * radius);
      if (neighbors <= more_than || neighbors > at_most) truth.push_back(i);
    }
    const Crowd crowd = {k, more_than, at_most};
    for (const double built : {k, 0.3 * k}) {
      std::vector<std::uint32_t> found;
      WindowCounter(scan, built).findOutsiders(points, crowd, &found);
      ASSERT_EQ(found, truth) << "more than " << more_than << ", built for " << built;
    }
  }
}

/// Radii from next to nothing over half the range to beyond the sensor.
void expectExactCounts(const Cloud& cloud) {
  for (const double k : {0.0035, 0.02, 0.2, 0.6, 0.999, 1.0, 1.7}) {
    SCOPED_TRACE("radius " + std::to_string(k) + " of the range");
    expectExactCounts(cloud, k, k);
    expectExactOutsiders(cloud, k);
  }
}

void addSphere(Cloud* cloud, int points, double from_range, double to_range, unsigned seed) {
  Uniform uniform(seed);
  for (int i = 0; i < points; ++i) {
    const double z = uniform(-1.0, 1.0);
    const double azimuth_deg = uniform(0.0, 360.0);
    const double r = uniform(from_range, to_range);
    cloud->addPolar(azimuth_deg, r * std::sqrt(1.0 - z * z), r * z);
  }
}

TEST(WindowCounter, CountsNobodyAroundTheOnlyPoint) {
  Cloud cloud;
  cloud.add(1, 2, 3);
  const Scan scan(cloud.view());
  const WindowCounter counter(scan, 0.2);
  EXPECT_EQ(counter.count(0, 100.0, kAll), 0U);
  EXPECT_FALSE(counter.isBetween(0, 100.0, 0, kAll));
}

TEST(WindowCounter, IsMadeOfNothingWithoutComplaint) {
  const Scan scan{ScanView()};
  EXPECT_NO_THROW(WindowCounter(scan, 0.2));
}

TEST(WindowCounter, CountsStrictlyBelowTheRadius) {
  Cloud cloud;
  cloud.add(2.0, 0.0, 0.0);
  cloud.add(2.0, 0.5, 0.0);
  const Scan scan(cloud.view());
  const WindowCounter counter(scan, 0.25);
  EXPECT_EQ(counter.count(0, 0.25, kAll), 0U);
  EXPECT_EQ(counter.count(0, std::nextafter(0.25, 1.0), kAll), 1U);
}

TEST(WindowCounter, CountsPointsInTheSamePlace) {
  Cloud cloud;
  for (int i = 0; i < 4; ++i) cloud.add(1, 1, 1);
  expectExactCounts(cloud);
  const Scan scan(cloud.view());
  EXPECT_EQ(WindowCounter(scan, 0.2).count(2, 1e-12, kAll), 3U);
}

TEST(WindowCounter, CountsNobodyWithinNothing) {
  Cloud cloud;
  for (int i = 0; i < 4; ++i) cloud.add(1, 1, 1);
  const Scan scan(cloud.view());
  const WindowCounter counter(scan, 0.2);
  EXPECT_EQ(counter.count(0, 0.0, kAll), 0U);
  EXPECT_FALSE(counter.isBetween(0, 0.0, 0, kAll));
}

TEST(WindowCounter, StopsAtTheLimit) {
  Cloud cloud;
  for (int i = 0; i < 50; ++i) cloud.add(3.0, 0.001 * i, 0.0);
  const Scan scan(cloud.view());
  const WindowCounter counter(scan, 0.2);
  EXPECT_EQ(counter.count(7, 0.36, 10), 10U);
  EXPECT_EQ(counter.count(7, 0.36, 49), 49U);
  EXPECT_EQ(counter.count(7, 0.36, kAll), 49U);
}

TEST(WindowCounter, LeavesInvalidPointsOut) {
  Cloud cloud;
  cloud.add(1, 0, 0);
  cloud.add(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  cloud.add(0, 0, 0);
  cloud.add(1, std::numeric_limits<double>::infinity(), 0);
  cloud.add(1, 0.01, 0);
  const Scan scan(cloud.view());
  EXPECT_EQ(WindowCounter(scan, 0.2).count(0, 4.0, kAll), 1U);
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactForScatteredDirections) {
  Cloud cloud;
  addSphere(&cloud, 500, 0.3, 12.0, 1);
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactForACrowdInFewBuckets) {
  Cloud cloud;
  Uniform uniform(2);
  for (int i = 0; i < 400; ++i) {
    const double azimuth_deg = uniform(30.0, 31.0);
    const double r = uniform(1.0, 8.0);
    const double z = uniform(-0.1, 0.1);
    cloud.addPolar(azimuth_deg, r, z);
  }
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactForDualReturns) {  // each beam twice, some of them at the same range
  Cloud cloud;
  Uniform uniform(3);
  for (int i = 0; i < 250; ++i) {
    const double azimuth_deg = uniform(0.0, 360.0);
    const double slope = uniform(-0.8, 0.8);
    const double first = uniform(0.5, 3.0);
    const double second = i % 5 == 0 ? first : uniform(3.0, 9.0);
    cloud.addPolar(azimuth_deg, first, slope * first);
    cloud.addPolar(azimuth_deg, second, slope * second);
  }
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactAcrossTheAzimuthWrap) {
  Cloud cloud;
  Uniform uniform(4);
  for (int i = 0; i < 300; ++i) {
    const double azimuth_deg = uniform(-3.0, 3.0);
    const double r = uniform(2.0, 3.0);
    cloud.addPolar(azimuth_deg, r, 0.0);
  }
  cloud.add(2.5, 0.0, 0.0);
  cloud.add(2.5, -0.0, 0.0);
  cloud.add(2.5, -1e-30, 0.0);
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactBehindTheSensor) {
  Cloud cloud;
  Uniform uniform(5);
  for (int i = 0; i < 300; ++i) {
    const double azimuth_deg = uniform(177.0, 183.0);
    const double r = uniform(2.0, 3.0);
    cloud.addPolar(azimuth_deg, r, 0.0);
  }
  cloud.add(-2.5, -0.0, 0.0);
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactAroundBothPoles) {
  Cloud cloud;
  Uniform uniform(6);
  for (int i = 0; i < 400; ++i) {
    const double azimuth_deg = uniform(0.0, 360.0);
    const double tilt = uniform(0.0, 0.3);
    const double z = (i % 2 == 0 ? 1.0 : -1.0) * uniform(0.5, 3.0);
    cloud.addPolar(azimuth_deg, tilt * std::fabs(z), z);
  }
  cloud.add(0, 0, 2);
  cloud.add(0, 0, -2);
  expectExactCounts(cloud);
}

TEST(WindowCounter, IsExactAtAnyDistance) {
  for (const double scale : {1e-30, 1e-6, 1e5}) {
    Cloud cloud;
    addSphere(&cloud, 200, 0.5 * scale, 2.0 * scale, 7);
    SCOPED_TRACE("scale " + std::to_string(scale));
    expectExactCounts(cloud);
  }
}

TEST(WindowCounter, IsExactNextToTheSensor) {  // one radius holds the sensor, another does not
  Cloud cloud;
  addSphere(&cloud, 200, 1e-3, 0.05, 8);
  addSphere(&cloud, 200, 1.0, 6.0, 9);
  expectExactCounts(cloud);
}

TEST(WindowCounter, StaysExactForRadiiItWasNotMadeFor) {
  Cloud cloud;
  addSphere(&cloud, 40, 0.5, 9.0, 10);
  for (const double built : {1e-9, 0.0035, 0.2, 1.0, 1e9}) {
    for (const double asked : {1e-6, 0.05, 0.5, 3.0}) expectExactCounts(cloud, built, asked);
  }
}

TEST(WindowCounter, IsExactOnARasterWhoseNeighborsAreEquallyFar) {
  BoxRoom room;
  room.elevations_deg = evenElevations(12, -40.0, 40.0);
  room.azimuths = 60;
  expectExactCounts(room.scan());
}

}  // namespace
}  // namespace smoke_ground_reconstruction
