#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

using Indices = std::vector<std::uint32_t>;

ScanColumns allColumns(const Scan& scan, const AzimuthBins& bins, const SensorModel& sensor) {
  return ScanColumns(scan, std::vector<std::uint8_t>(scan.size(), 1), bins, sensor);
}

Mounting pitchedDown(double pitch_deg) {  // a sensor nosed down: its +x points below the horizon
  const double c = std::cos(pitch_deg * M_PI / 180.0);
  const double s = std::sin(pitch_deg * M_PI / 180.0);
  Mounting mounting;
  mounting.rotation = {c, 0, s, 0, 1, 0, -s, 0, c};
  return mounting;
}

TEST(IsReturn, HoldsForFinitePoints) {
  EXPECT_TRUE(isReturn(1.0F, 2.0F, 3.0F));
  EXPECT_TRUE(isReturn(0.0F, 0.0F, -1e-30F));
}

TEST(IsReturn, FailsForNanAndInfInAnyPlace) {
  for (const float bad : {kNan, kInf, -kInf}) {
    EXPECT_FALSE(isReturn(bad, 1.0F, 1.0F));
    EXPECT_FALSE(isReturn(1.0F, bad, 1.0F));
    EXPECT_FALSE(isReturn(1.0F, 1.0F, bad));
  }
}

TEST(IsReturn, FailsBeyondAnyLidar) {
  EXPECT_TRUE(isReturn(1e6F, -1e6F, 1e6F));
  EXPECT_FALSE(isReturn(1.1e6F, 0.0F, 0.0F));
  EXPECT_FALSE(isReturn(0.0F, -1e30F, 0.0F));
  EXPECT_FALSE(isReturn(1.0F, 1.0F, 3e38F));
}

TEST(IsReturn, FailsForTheZeroPointOfEitherSign) {
  EXPECT_FALSE(isReturn(0.0F, 0.0F, 0.0F));
  EXPECT_FALSE(isReturn(-0.0F, 0.0F, -0.0F));
}

TEST(StridedField, ReadsUnalignedFieldsOfPackedPoints) {
  // 26 bytes a point, ring at 16 and a double at 18, as a Hesai driver packs them.
  std::vector<unsigned char> bytes(2 * 26, 0xEE);
  const double stamps[] = {1.25, -3.5};
  const std::uint16_t rings[] = {7, 300};
  for (std::size_t i = 0; i < 2; ++i) {
    std::memcpy(&bytes[26 * i + 16], &rings[i], sizeof(std::uint16_t));
    std::memcpy(&bytes[26 * i + 18], &stamps[i], sizeof(double));
  }
  const StridedField<double> stamp(&bytes[18], 26);
  const StridedField<std::uint16_t> ring(&bytes[16], 26);
  EXPECT_EQ(stamp[1], -3.5);
  EXPECT_EQ(ring[0], 7);
  EXPECT_EQ(ring[1], 300);
}

TEST(Scan, OfNothingIsEmpty) {
  const Scan scan{ScanView()};
  EXPECT_EQ(scan.size(), 0U);
  EXPECT_TRUE(scan.valid.empty());
}

TEST(Scan, KeepsEveryPointInInputOrder) {
  Cloud cloud;
  cloud.add(1, 2, 3, 9, 40);
  cloud.add(4, 5, 6, 2, 50);
  const Scan scan(cloud.view());
  EXPECT_EQ(scan.x, cloud.x);
  EXPECT_EQ(scan.y, cloud.y);
  EXPECT_EQ(scan.z, cloud.z);
  EXPECT_EQ(scan.intensity, cloud.intensity);
  EXPECT_EQ(scan.ring, cloud.ring);
}

TEST(Scan, MarksNanInfAndZeroPointsInvalidButKeepsTheirPlaces) {
  Cloud cloud;
  cloud.add(kNan, 0, 1);
  cloud.add(0, 0, 0);
  cloud.add(1, 0, 0);
  cloud.add(1, kInf, 0);
  EXPECT_EQ(Scan(cloud.view()).valid, (std::vector<std::uint8_t>{0, 0, 1, 0}));
}

TEST(Scan, RotatesIntoTheLevelFrame) {
  Cloud cloud;
  cloud.add(1, 0, 0);
  cloud.add(0, 1, 0);
  const Scan scan(cloud.view(), pitchedDown(30.0));
  EXPECT_NEAR(scan.x[0], std::sqrt(3.0) / 2.0, 1e-7);
  EXPECT_NEAR(scan.z[0], -0.5, 1e-7);  // what lies ahead of a sensor nosed down lies low
  EXPECT_EQ(scan.point(1), (std::array<float, 3>{0.0F, 1.0F, 0.0F}));
}

TEST(Scan, JudgesPointsBeforeItRotatesThem) {  // the denoiser and the segmenter must agree
  Cloud cloud;
  cloud.add(1e6, 0, 1e6);
  const Scan scan(cloud.view(), pitchedDown(45.0));
  EXPECT_NEAR(scan.x[0], std::sqrt(2.0) * 1e6, 1.0);
  EXPECT_EQ(scan.valid[0], 1);
}

TEST(Scan, ViewsItsOwnPoints) {
  Cloud cloud;
  cloud.add(1, 2, 3, 4, 5);
  const Scan scan(cloud.view());
  const ScanView view = scan.view();
  ASSERT_EQ(view.size, 1U);
  EXPECT_EQ(view.x[0], 1.0F);
  EXPECT_EQ(view.y[0], 2.0F);
  EXPECT_EQ(view.z[0], 3.0F);
  EXPECT_EQ(view.ring[0], 4);
  EXPECT_EQ(view.intensity[0], 5.0F);
}

TEST(Mounting, IsLevelByDefaultAndThenTouchesNoBit) {
  const Mounting level;
  EXPECT_TRUE(level.isLevel());
  EXPECT_EQ(level.toLevel(0.1F, 0.2F, 0.3F), (std::array<float, 3>{0.1F, 0.2F, 0.3F}));
  EXPECT_FALSE(pitchedDown(0.001).isLevel());
}

TEST(Mounting, ComesBackFromTheLevelFrame) {
  const Mounting mounting = pitchedDown(17.0);
  const auto level = mounting.toLevel(1.5F, -2.5F, 0.5F);
  const auto back = mounting.toSensor(level[0], level[1], level[2]);
  EXPECT_NEAR(back[0], 1.5, 1e-6);
  EXPECT_NEAR(back[1], -2.5, 1e-6);
  EXPECT_NEAR(back[2], 0.5, 1e-6);
}

/// x, y, z and intensity of a point side by side, as drivers pack them.
TEST(Scan, ReadsPackedPointsAsItReadsOthers) {
  for (const std::size_t size : {0U, 1U, 3U, 4U, 2050U}) {
    const std::size_t step = 18;
    std::vector<unsigned char> bytes(size * step);
    Cloud cloud;
    for (std::size_t i = 0; i < size; ++i) {
      const auto n = static_cast<double>(i);
      cloud.add(i % 7 == 3 ? static_cast<double>(kNan) : n, n + 0.25, -n, static_cast<int>(i),
                n / 2);
      const float fields[] = {cloud.x[i], cloud.y[i], cloud.z[i], cloud.intensity[i]};
      std::memcpy(&bytes[i * step], fields, sizeof(fields));
      std::memcpy(&bytes[i * step + 16], &cloud.ring[i], sizeof(std::uint16_t));
    }
    ScanView view;
    view.x = {bytes.data(), step};
    view.y = {bytes.data() + 4, step};
    view.z = {bytes.data() + 8, step};
    view.intensity = {bytes.data() + 12, step};
    view.ring = {bytes.data() + 16, step};
    view.size = size;
    const Scan packed(view);
    const Scan apart(cloud.view());
    EXPECT_EQ(packed.y, cloud.y);
    EXPECT_EQ(packed.z, cloud.z);
    EXPECT_EQ(packed.intensity, cloud.intensity);
    EXPECT_EQ(packed.ring, cloud.ring);
    EXPECT_EQ(packed.valid, apart.valid);
    ASSERT_EQ(packed.size(), size);
    for (std::size_t i = 0; i < size; ++i) {
      EXPECT_TRUE(packed.x[i] == cloud.x[i] || i % 7 == 3) << i;
      EXPECT_EQ(packed.valid[i], i % 7 == 3 ? 0 : 1) << i;
    }
  }
}

TEST(ScanColumns, OfNothingHaveOneEmptyRangePerBin) {
  const AzimuthBins bins(90.0);
  const ScanColumns columns = allColumns(Scan{ScanView()}, bins, SensorModel());
  EXPECT_TRUE(columns.order.empty());
  EXPECT_EQ(columns.column_begin, (Indices{0, 0, 0, 0, 0}));
}

TEST(ScanColumns, OrderByAzimuthThenElevationThenIndex) {
  const auto sensor = SensorModel::fromElevations({-30.0, -20.0, -10.0});
  Cloud cloud;
  cloud.addPolar(100.0, 1, 0, 2);  // column 1
  cloud.addPolar(10.0, 1, 0, 1);   // column 0
  cloud.addPolar(20.0, 2, 0, 0);
  cloud.addPolar(30.0, 3, 0, 1);
  const ScanColumns columns = allColumns(Scan(cloud.view()), AzimuthBins(90.0), sensor);
  EXPECT_EQ(columns.order, (Indices{2, 1, 3, 0}));
  EXPECT_EQ(columns.column_begin, (Indices{0, 3, 4, 4, 4}));
  EXPECT_EQ(columns.rank, (std::vector<std::uint16_t>{0, 1, 1, 2}));
}

TEST(ScanColumns, PutTheLowestBeamFirstWhateverItsNumber) {
  const auto sensor = SensorModel::fromElevations({10.0, 0.0, -10.0});  // as an Ouster numbers them
  Cloud cloud;
  for (int ring = 0; ring < 3; ++ring) cloud.addPolar(5.0, 1, 0, ring);
  EXPECT_EQ(allColumns(Scan(cloud.view()), AzimuthBins(10.0), sensor).order, (Indices{2, 1, 0}));
}

TEST(ScanColumns, LeaveOutUnusedInvalidAndUnknownRings) {
  const auto sensor = SensorModel::fromElevations({-10.0, 0.0});
  Cloud cloud;
  cloud.add(1, 0, 0, 0);
  cloud.add(1, 0, 0, 1);
  cloud.add(1, 0, 0, 2);       // no such beam
  cloud.add(1, 0, 0, 0xFFFF);  // the number that means "no rank"
  cloud.add(kNan, 0, 0, 0);
  const ScanColumns columns(Scan(cloud.view()), {0, 1, 1, 1, 1}, AzimuthBins(90.0), sensor);
  EXPECT_EQ(columns.order, (Indices{1}));
}

TEST(ScanColumns, TakeThePointsOfAShuffledScanAlike) {
  BoxRoom room;
  room.elevations_deg = evenElevations(8, -30.0, 10.0);
  room.azimuths = 90;
  const Cloud cloud = room.scan();
  const auto sensor = SensorModel::fromElevations(room.elevations_deg);
  const AzimuthBins bins(4.0);
  const auto order = shuffledIndices(cloud.size(), 3);
  const ScanColumns plain = allColumns(Scan(cloud.view()), bins, sensor);
  const ScanColumns shuffled = allColumns(Scan(cloud.select(order).view()), bins, sensor);
  ASSERT_EQ(plain.order.size(), shuffled.order.size());
  for (std::size_t k = 0; k < plain.order.size(); ++k) {
    EXPECT_EQ(plain.order[k], order[shuffled.order[k]]);
  }
}

}  // namespace
}  // namespace smoke_ground_reconstruction
