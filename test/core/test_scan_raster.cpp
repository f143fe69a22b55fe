#include <gtest/gtest.h>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {
namespace {

const AzimuthBins kBins(7.5);  // 48 columns: three stripes

/// Three rings, the highest first, a point of each in every column.
Cloud threeRings() {
  Cloud cloud;
  for (int column = 0; column < 48; ++column) {
    for (int ring = 0; ring < 3; ++ring) {
      cloud.addPolar(7.5 * column + 3.0, 2.0, 1.0 - ring, ring);
    }
  }
  return cloud;
}

ScanRaster rasterOf(const Cloud& cloud, const std::vector<Label>& labels) {
  return {Scan(cloud.view()), labels, kBins};
}

ScanRaster rasterOf(const Cloud& cloud) {
  return rasterOf(cloud, std::vector<Label>(cloud.size(), Label::kKept));
}

TEST(ScanRaster, HasAPlaceForEachPoint) {
  const Cloud cloud = threeRings();
  const ScanRaster raster = rasterOf(cloud);
  ASSERT_FALSE(raster.is_crowded);
  EXPECT_EQ(raster.nowhere(), 3U * 48U);
  EXPECT_TRUE(raster.extras.empty());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t at = raster.place[i];
    EXPECT_EQ(raster.x[at], cloud.x[i]);
    EXPECT_EQ(raster.y[at], cloud.y[i]);
    EXPECT_EQ(raster.z[at], cloud.z[i]);
  }
}

TEST(ScanRaster, HasARowForEachRing) {
  const ScanRaster raster = rasterOf(threeRings());
  EXPECT_EQ(raster.rows, 3U);
  for (std::size_t i = 0; i < 3U * 48U; ++i) EXPECT_EQ(raster.rowOf(raster.place[i]), i % 3);
}

TEST(ScanRaster, LeavesOutInvalidPointsAndThoseNotKept) {
  Cloud cloud = threeRings();
  cloud.x[4] = NAN;
  std::vector<Label> labels(cloud.size(), Label::kKept);
  labels[7] = Label::kNoise;
  const ScanRaster raster = rasterOf(cloud, labels);
  EXPECT_EQ(raster.place[4], raster.nowhere());
  EXPECT_EQ(raster.place[7], raster.nowhere());
}

TEST(ScanRaster, SetsAsideWhatFindsItsPlaceTaken) {
  Cloud cloud = threeRings();
  for (const int i : {7, 3, 7}) {
    cloud.add(1.1 * cloud.x[static_cast<std::size_t>(i)],
              1.1 * cloud.y[static_cast<std::size_t>(i)], cloud.z[static_cast<std::size_t>(i)],
              cloud.ring[static_cast<std::size_t>(i)]);
  }
  const ScanRaster raster = rasterOf(cloud);
  ASSERT_FALSE(raster.is_crowded);
  ASSERT_EQ(raster.extras.size(), 3U);
  const auto extra = [&](std::size_t k) { return raster.extras[k]; };
  EXPECT_LT(extra(0).place, extra(2).place);
  std::vector<std::uint32_t> at_seven;
  for (std::size_t k = 0; k < 3; ++k) {
    if (extra(k).place == raster.place[7]) at_seven.push_back(extra(k).point);
    EXPECT_EQ(raster.place[extra(k).point], raster.nowhere());
  }
  EXPECT_EQ(at_seven, (std::vector<std::uint32_t>{144, 146}));
  EXPECT_EQ(raster.x[raster.place[7]], cloud.x[7]);
}

/// Points `from` to `to` of a cloud once more, a tenth farther.
void addAgain(std::size_t from, std::size_t to, Cloud* cloud) {
  for (std::size_t i = from; i < to; ++i) {
    cloud->add(1.1 * cloud->x[i], 1.1 * cloud->y[i], 1.1 * cloud->z[i], cloud->ring[i]);
  }
}

TEST(ScanRaster, HasASecondLayerWhereManyShareAPlace) {
  Cloud cloud = threeRings();
  addAgain(0, 144, &cloud);
  const ScanRaster raster = rasterOf(cloud);
  ASSERT_FALSE(raster.is_crowded);
  ASSERT_TRUE(raster.has_second);
  EXPECT_TRUE(raster.extras.empty());
  for (std::size_t i = 0; i < 144; ++i) {
    const std::size_t second = raster.secondOf(raster.place[i]);
    EXPECT_EQ(raster.place[144 + i], second);
    EXPECT_EQ(raster.x[raster.place[i]], cloud.x[i]);
    EXPECT_EQ(raster.x[second], cloud.x[144 + i]);
    EXPECT_EQ(raster.y[second], cloud.y[144 + i]);
    EXPECT_EQ(raster.z[second], cloud.z[144 + i]);
  }
}

TEST(ScanRaster, SetsAsideTheThirdAtAPlace) {
  Cloud cloud = threeRings();
  addAgain(10, 11, &cloud);
  addAgain(10, 11, &cloud);
  addAgain(0, 60, &cloud);
  const ScanRaster raster = rasterOf(cloud);
  ASSERT_FALSE(raster.is_crowded);
  ASSERT_EQ(raster.extras.size(), 2U);
  for (const std::size_t k : {0U, 1U}) EXPECT_EQ(raster.extras[k].place, raster.place[10]);
  EXPECT_EQ(raster.extras[0].point, 145U);
  EXPECT_EQ(raster.extras[1].point, 156U);
  EXPECT_EQ(raster.place[144], raster.secondOf(raster.place[10]));
  EXPECT_EQ(raster.place[145], raster.nowhere());
}

TEST(ScanRaster, KeepsWhatIsAsked) {
  Cloud cloud = threeRings();
  std::vector<Label> labels(cloud.size(), Label::kKept);
  labels[7] = labels[30] = Label::kNoise;
  ScanRaster raster = rasterOf(cloud);
  const std::size_t of_7 = raster.place[7];
  raster.keep(Scan(cloud.view()), labels);
  EXPECT_FALSE(raster.isTaken(of_7));
  EXPECT_EQ(raster.place, rasterOf(cloud, labels).place);
}

TEST(ScanRaster, KeepsTheFirstLayerFirst) {
  Cloud cloud = threeRings();
  addAgain(0, 144, &cloud);
  addAgain(20, 22, &cloud);  // 288 and 289 are third
  std::vector<Label> labels(cloud.size(), Label::kKept);
  labels[20] = labels[21] = labels[144 + 21] = labels[144 + 50] = Label::kNoise;
  ScanRaster raster = rasterOf(cloud);
  const std::size_t at_20 = raster.place[20], at_21 = raster.place[21];
  ASSERT_EQ(raster.extras.size(), 2U);
  raster.keep(Scan(cloud.view()), labels);
  EXPECT_TRUE(raster.extras.empty());
  EXPECT_EQ(raster.place[144 + 20], at_20);
  EXPECT_EQ(raster.place[288], raster.secondOf(at_20));
  EXPECT_EQ(raster.place[289], at_21);
  EXPECT_FALSE(raster.isTaken(raster.secondOf(at_21)));
  EXPECT_EQ(raster.x[at_20], cloud.x[144 + 20]);
  EXPECT_EQ(raster.x[raster.secondOf(at_20)], cloud.x[288]);
  EXPECT_FALSE(raster.isTaken(raster.secondOf(raster.place[50])));
}

TEST(ScanRaster, GivesUpWhereManyPlacesHaveThree) {
  Cloud cloud = threeRings();
  addAgain(0, 48, &cloud);
  addAgain(0, 48, &cloud);
  EXPECT_TRUE(rasterOf(cloud).is_crowded);
}

TEST(ScanRaster, GivesUpWhereMostPlacesStayEmpty) {
  Cloud cloud;
  for (int i = 0; i < 8; ++i) cloud.addPolar(40.0 * i, 2.0, 0.0, 2);
  EXPECT_TRUE(rasterOf(cloud).is_crowded);
}

TEST(ScanRaster, OfNothingIsOfNoUse) { EXPECT_TRUE(rasterOf(Cloud()).is_crowded); }

}  // namespace
}  // namespace smoke_ground_reconstruction
