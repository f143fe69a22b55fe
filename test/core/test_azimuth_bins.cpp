#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/azimuth_bins.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr double kDegree = M_PI / 180.0;

std::size_t indexAt(const AzimuthBins& bins, double azimuth_deg, double r) {
  return bins.index(static_cast<float>(r * std::cos(azimuth_deg * kDegree)),
                    static_cast<float>(r * std::sin(azimuth_deg * kDegree)));
}

TEST(AzimuthBins, CountsWhatTheWidthDividesTheCircleInto) {
  EXPECT_EQ(AzimuthBins(10.0).count(), 36U);
  EXPECT_EQ(AzimuthBins(0.4).count(), 900U);
  EXPECT_EQ(AzimuthBins(0.01).count(), 36000U);
  EXPECT_EQ(AzimuthBins(90.0).count(), 4U);
  EXPECT_EQ(AzimuthBins(360.0 / 7.0).count(), 7U);
}

TEST(AzimuthBins, RefusesWidthsThatDoNotDivideTheCircle) {
  for (const double width :
       {7.0, 0.0, -10.0, 120.0, 360.0, 0.009, 1e-300, 1e300,
        std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(AzimuthBins{width}, std::invalid_argument) << width;
  }
}

TEST(AzimuthBins, NamesTheWidthItRefuses) {
  try {
    const AzimuthBins bins(7.0);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("7"), std::string::npos) << error.what();
  }
}

TEST(AzimuthBins, CountsCounterClockwiseFromPlusX) {
  const AzimuthBins bins(90.0);
  EXPECT_EQ(bins.index(1.0F, 0.5F), 0U);
  EXPECT_EQ(bins.index(-0.5F, 1.0F), 1U);
  EXPECT_EQ(bins.index(-1.0F, -0.5F), 2U);
  EXPECT_EQ(bins.index(0.5F, -1.0F), 3U);
}

TEST(AzimuthBins, GivesAnEdgeToTheBinItBegins) {
  const AzimuthBins bins(90.0);
  EXPECT_EQ(bins.index(1.0F, 0.0F), 0U);
  EXPECT_EQ(bins.index(0.0F, 1.0F), 1U);
  EXPECT_EQ(bins.index(-1.0F, 0.0F), 2U);
  EXPECT_EQ(bins.index(0.0F, -1.0F), 3U);
  const AzimuthBins eighths(45.0);
  EXPECT_EQ(eighths.index(2.5F, 2.5F), 1U);
  EXPECT_EQ(eighths.index(std::nextafter(2.5F, 3.0F), 2.5F), 0U);
}

TEST(AzimuthBins, SplitsAtTheWrapWhateverTheSignOfZero) {
  const AzimuthBins bins(0.4);
  EXPECT_EQ(bins.index(5.0F, 0.0F), 0U);
  EXPECT_EQ(bins.index(5.0F, -0.0F), 0U);
  EXPECT_EQ(bins.index(5.0F, std::numeric_limits<float>::denorm_min()), 0U);
  EXPECT_EQ(bins.index(5.0F, -std::numeric_limits<float>::denorm_min()), 899U);
}

TEST(AzimuthBins, IsOneBinOnBothSidesOfHalfATurn) {
  const AzimuthBins bins(0.4);  // pi is the edge of bin 450
  EXPECT_EQ(bins.index(-5.0F, 0.0F), 450U);
  EXPECT_EQ(bins.index(-5.0F, -0.0F), 450U);
  EXPECT_EQ(bins.index(-5.0F, -1e-30F), 450U);
  EXPECT_EQ(bins.index(-5.0F, 1e-30F), 449U);
}

TEST(AzimuthBins, PutsTheAxisIntoTheFirstBin) {
  EXPECT_EQ(AzimuthBins(10.0).index(0.0F, 0.0F), 0U);
  EXPECT_EQ(AzimuthBins(10.0).index(-0.0F, -0.0F), 0U);
}

TEST(AzimuthBins, FindsTheMiddleOfEachBinAtAnyRange) {
  const AzimuthBins bins(0.4);
  for (std::size_t bin = 0; bin < bins.count(); ++bin) {
    for (const double r : {1e-30, 0.05, 7.0, 1e30}) {
      EXPECT_EQ(indexAt(bins, (static_cast<double>(bin) + 0.5) * 0.4, r), bin);
    }
  }
}

TEST(AzimuthBins, SeparatesTenThousandthsOfADegree) {
  const AzimuthBins bins(0.4);
  for (std::size_t bin = 1; bin < bins.count(); ++bin) {
    const double edge = static_cast<double>(bin) * 0.4;
    EXPECT_EQ(indexAt(bins, edge + 1e-4, 10.0), bin);
    EXPECT_EQ(indexAt(bins, edge - 1e-4, 10.0), bin - 1);
  }
}

TEST(AzimuthBins, FindsBinsOfTheFinestWidth) {
  const AzimuthBins bins(0.01);
  for (std::size_t bin = 0; bin < bins.count(); bin += 71) {
    EXPECT_EQ(indexAt(bins, (static_cast<double>(bin) + 0.5) * 0.01, 3.0), bin);
  }
}

TEST(AzimuthBins, AnswersManyPointsAsOneByOne) {
  std::vector<float> x = {0.0F, -0.0F, 0.0F, 1e-45F, 3e-40F, 1e6F, -1e6F, 2.0F, 2.0F, -2.0F};
  std::vector<float> y = {0.0F, 0.0F, 1e-45F, -1e-45F, 1e-40F, -1e-45F, -0.0F, 0.0F, -0.0F, 1e-30F};
  Uniform uniform(6);
  for (int i = 0; i < 40000; ++i) {
    const double azimuth_deg =
        i % 2 == 0 ? 0.1 * (i / 2) : uniform(-180.0, 180.0);  // on edges, too
    const double r = uniform(0.1, 30.0);
    x.push_back(static_cast<float>(r * std::cos(azimuth_deg * M_PI / 180.0)));
    y.push_back(static_cast<float>(r * std::sin(azimuth_deg * M_PI / 180.0)));
  }
  for (const double width_deg : {0.01, 0.1, 0.4, 10.0, 90.0}) {
    const AzimuthBins bins(width_deg);
    std::vector<std::uint32_t> index(x.size());
    bins.indices(x.data(), y.data(), x.size(), index.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      ASSERT_EQ(index[i], bins.index(x[i], y[i])) << width_deg << " deg, (" << x[i] << ", " << y[i];
    }
  }
}

}  // namespace
}  // namespace smoke_ground_reconstruction
