#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/agdor_filter.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kLow = 5.0;
constexpr double kHigh = 200.0;

using Labels = std::vector<Label>;

AgdorParams neighborsBetween(int more_than, int at_most) {
  AgdorParams params;
  params.min_neighbors = more_than;
  params.max_neighbors = at_most;
  return params;
}

Labels classify(const Cloud& cloud, const AgdorParams& params = neighborsBetween(0, 0)) {
  return AgdorFilter(params).classify(Scan(cloud.view()));
}

/// A low point at 5 m, where the default radius is 0.2 r = 1 m, and neighbours around it.
Cloud lowPointWithNeighbors(int neighbors, double neighbor_intensity) {
  Cloud cloud;
  cloud.add(5, 0, 0, 0, kLow);
  for (int i = 0; i < neighbors; ++i) {
    cloud.add(5.0, 0.4 + 0.001 * i, 0.0, 0, neighbor_intensity);
  }
  return cloud;
}

TEST(AgdorFilter, OfNothingSaysNothing) { EXPECT_TRUE(classify(Cloud()).empty()); }

TEST(AgdorFilter, KeepsTheOnlyPointIfItIsBright) {
  Cloud cloud;
  cloud.add(1, 0, 0, 0, kHigh);
  EXPECT_EQ(classify(cloud), Labels{Label::kKept});
}

TEST(AgdorFilter, RemovesTheOnlyPointIfItIsDark) {
  Cloud cloud;
  cloud.add(1, 0, 0, 0, kLow);
  EXPECT_EQ(classify(cloud), Labels{Label::kNoise});
}

TEST(AgdorFilter, TakesIntensitiesStrictlyBelowTheThreshold) {
  Cloud cloud;
  cloud.add(1, 0, 0, 0, std::nextafter(25.0F, 0.0F));
  cloud.add(-1, 0, 0, 0, 25.0);
  EXPECT_EQ(classify(cloud), (Labels{Label::kNoise, Label::kKept}));
}

TEST(AgdorFilter, KeepsAPointWhoseIntensityIsNoNumber) {
  Cloud cloud;
  cloud.add(1, 0, 0, 0, kNan);
  EXPECT_EQ(classify(cloud), Labels{Label::kKept});
}

TEST(AgdorFilter, ThresholdZeroRemovesNothing) {
  AgdorParams params = neighborsBetween(0, 0);
  params.intensity_threshold = 0.0;
  Cloud cloud;
  cloud.add(1, 0, 0, 0, 0.0);
  EXPECT_EQ(classify(cloud, params), Labels{Label::kKept});
}

TEST(AgdorFilter, NeedsMoreNeighborsThanTheMinimum) {
  const AgdorParams params = neighborsBetween(3, 0);
  EXPECT_EQ(classify(lowPointWithNeighbors(3, kHigh), params)[0], Label::kNoise);
  EXPECT_EQ(classify(lowPointWithNeighbors(4, kHigh), params)[0], Label::kKept);
}

TEST(AgdorFilter, AllowsAsManyNeighborsAsTheMaximum) {
  const AgdorParams params = neighborsBetween(3, 6);
  EXPECT_EQ(classify(lowPointWithNeighbors(6, kHigh), params)[0], Label::kKept);
  EXPECT_EQ(classify(lowPointWithNeighbors(7, kHigh), params)[0], Label::kNoise);
}

TEST(AgdorFilter, MaximumZeroMeansUnlimited) {
  EXPECT_EQ(classify(lowPointWithNeighbors(700, kHigh), neighborsBetween(3, 0))[0], Label::kKept);
}

TEST(AgdorFilter, HasTheThesisDefaultsOf100And5000) {
  const AgdorParams defaults;
  EXPECT_EQ(classify(lowPointWithNeighbors(100, kHigh), defaults)[0], Label::kNoise);
  EXPECT_EQ(classify(lowPointWithNeighbors(101, kHigh), defaults)[0], Label::kKept);
  EXPECT_EQ(defaults.max_neighbors, 5000);
}

TEST(AgdorFilter, CountsBrightAndDarkNeighborsAlike) {  // the tree holds all points
  const AgdorParams params = neighborsBetween(3, 0);
  EXPECT_EQ(classify(lowPointWithNeighbors(4, kLow), params)[0], Label::kKept);
}

TEST(AgdorFilter, CountsPointsInTheSamePlaceAsNeighbors) {
  Cloud cloud;
  for (int i = 0; i < 3; ++i) cloud.add(2, 1, 0, 0, kLow);
  EXPECT_EQ(classify(cloud, neighborsBetween(1, 0)), Labels(3, Label::kKept));
  EXPECT_EQ(classify(cloud, neighborsBetween(2, 0)), Labels(3, Label::kNoise));
}

TEST(AgdorFilter, SearchesWithinAFifthOfTheRangeExclusive) {
  Cloud cloud;
  cloud.add(5, 0, 0, 0, kLow);
  cloud.add(5, 1, 0, 0, kHigh);  // 0.5 * 0.4 * 5 m away: on the sphere
  EXPECT_EQ(classify(cloud)[0], Label::kNoise);
  cloud.add(5, 0.9999, 0, 0, kHigh);
  EXPECT_EQ(classify(cloud)[0], Label::kKept);
}

TEST(AgdorFilter, SearchesWiderFartherAway) {
  Cloud cloud;  // the same gap of 0.5 m at 2 m (radius 0.4 m) and at 3 m (radius 0.6 m)
  cloud.add(2, 0, 0, 0, kLow);
  cloud.add(2, 0.5, 0, 0, kHigh);
  cloud.add(-3, 0, 0, 0, kLow);
  cloud.add(-3, 0.5, 0, 0, kHigh);
  const Labels labels = classify(cloud);
  EXPECT_EQ(labels[0], Label::kNoise);
  EXPECT_EQ(labels[2], Label::kKept);
}

TEST(AgdorFilter, TakesTheRangeInThreeDimensions) {
  Cloud cloud;  // range 5 m, planar range 3 m: radius 1 m, not 0.6 m
  cloud.add(3, 0, 4, 0, kLow);
  cloud.add(3, 0.9, 4, 0, kHigh);
  EXPECT_EQ(classify(cloud)[0], Label::kKept);
}

TEST(AgdorFilter, UsesTheRadiusOfTheCandidateNotOfItsNeighbor) {
  Cloud cloud;  // 0.9 m apart: within 0.2 * 5 m, beyond 0.2 * 4.1 m
  cloud.add(5, 0, 0, 0, kLow);
  cloud.add(4.1, 0, 0, 0, kLow);
  EXPECT_EQ(classify(cloud), (Labels{Label::kKept, Label::kNoise}));
}

TEST(AgdorFilter, SearchesMillimetresWithThetaInRadians) {
  AgdorParams params = neighborsBetween(0, 0);
  params.theta_unit = ThetaUnit::kRadians;  // 0.5 * 0.4 deg = 3.4907 mm per metre
  Cloud cloud;
  cloud.add(1, 0, 0, 0, kLow);
  cloud.add(1, 0.0034, 0, 0, kHigh);
  cloud.add(-1, 0, 0, 0, kLow);
  cloud.add(-1, 0.0036, 0, 0, kHigh);
  const Labels labels = classify(cloud, params);
  EXPECT_EQ(labels[0], Label::kKept);
  EXPECT_EQ(labels[2], Label::kNoise);
}

TEST(AgdorFilter, ScalesTheRadiusByAlpha) {
  AgdorParams params = neighborsBetween(0, 0);
  EXPECT_DOUBLE_EQ(params.radiusPerRange(), 0.2);
  params.alpha = 2.0;
  EXPECT_DOUBLE_EQ(params.radiusPerRange(), 0.8);
  params.theta_unit = ThetaUnit::kRadians;
  EXPECT_DOUBLE_EQ(params.radiusPerRange(), 0.8 * M_PI / 180.0);
}

TEST(AgdorFilter, CallsWhatIsNoReturnInvalidAndNobodysNeighbor) {
  Cloud cloud;
  cloud.add(kNan, 0, 0, 0, kLow);
  cloud.add(5, 0, 0, 0, kLow);
  cloud.add(5, kInf, 0, 0, kHigh);
  cloud.add(0, 0, 0, 0, 0.0);
  cloud.add(5, 0, -kInf, 0, kLow);
  EXPECT_EQ(classify(cloud), (Labels{Label::kInvalid, Label::kNoise, Label::kInvalid,
                                     Label::kInvalid, Label::kInvalid}));
}

TEST(AgdorFilter, CountsAcrossTheAzimuthWrap) {
  Cloud cloud;
  cloud.addPolar(359.9, 4.0, 0.0, 0, kLow);
  cloud.addPolar(0.1, 4.0, 0.0, 0, kLow);
  cloud.addPolar(179.9, 4.0, 0.0, 0, kLow);
  cloud.addPolar(-179.9, 4.0, 0.0, 0, kLow);
  EXPECT_EQ(classify(cloud), Labels(4, Label::kKept));
}

TEST(AgdorFilter, CountsAcrossAPole) {
  Cloud cloud;
  cloud.add(0.1, 0, -2, 0, kLow);
  cloud.add(-0.1, 0, -2, 0, kLow);
  EXPECT_EQ(classify(cloud), Labels(2, Label::kKept));
}

TEST(AgdorFilter, LabelsAShuffledScanAlike) {
  Cloud cloud;
  Uniform uniform(1);
  for (int i = 0; i < 800; ++i) {
    const double azimuth_deg = uniform(0.0, 360.0);
    const double r = uniform(0.2, 6.0);
    const double z = uniform(-1.0, 1.0);
    const double intensity = uniform(0.0, 50.0);
    cloud.addPolar(azimuth_deg, r, z, 0, intensity);
  }
  const AgdorParams params = neighborsBetween(4, 12);
  const Labels plain = classify(cloud, params);
  const auto order = shuffledIndices(cloud.size(), 4);
  const Labels shuffled = classify(cloud.select(order), params);
  for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(shuffled[i], plain[order[i]]);
}

TEST(AgdorFilter, AsksTheCounterItIsGiven) {
  class Lonely : public NeighborCounter {
   public:
    using NeighborCounter::NeighborCounter;
    std::size_t count(std::size_t, double, std::size_t) const override { return 0; }
  };
  AgdorParams params = neighborsBetween(3, 0);
  params.engine = DenoiserEngine::kKdTree;
  const AgdorFilter filter(params, [](const Scan& scan) { return std::make_unique<Lonely>(scan); });
  const Cloud cloud = lowPointWithNeighbors(50, kHigh);
  EXPECT_EQ(filter.classify(Scan(cloud.view()))[0], Label::kNoise);
}

TEST(AgdorFilter, RefusesTheKdTreeEngineWithoutOne) {
  AgdorParams params;
  params.engine = DenoiserEngine::kKdTree;
  EXPECT_THROW(AgdorFilter{params}, std::invalid_argument);
}

TEST(AgdorParams, AcceptsEveryLimit) {
  AgdorParams params;
  params.intensity_threshold = 0.0;
  params.min_neighbors = 0;
  params.max_neighbors = 1;
  EXPECT_NO_THROW(params.validate());
  params.max_neighbors = 0;
  EXPECT_NO_THROW(params.validate());
}

void expectRefusal(const std::string& name, const std::function<void(AgdorParams*)>& spoil) {
  AgdorParams params;
  spoil(&params);
  try {
    const AgdorFilter filter(params);
    ADD_FAILURE() << name << " was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).rfind(name + " must be ", 0), 0U) << error.what();
  }
}

TEST(AgdorParams, NamesTheParameterItRefuses) {
  expectRefusal("intensity_threshold", [](AgdorParams* p) { p->intensity_threshold = -1.0; });
  expectRefusal("intensity_threshold", [](AgdorParams* p) { p->intensity_threshold = kNan; });
  expectRefusal("alpha", [](AgdorParams* p) { p->alpha = 0.0; });
  expectRefusal("alpha", [](AgdorParams* p) { p->alpha = kInf; });
  expectRefusal("theta_deg", [](AgdorParams* p) { p->theta_deg = -0.4; });
  expectRefusal("min_neighbors", [](AgdorParams* p) { p->min_neighbors = -1; });
  expectRefusal("max_neighbors", [](AgdorParams* p) { p->max_neighbors = 100; });
  expectRefusal("max_neighbors", [](AgdorParams* p) { p->max_neighbors = -1; });
}

}  // namespace
}  // namespace smoke_ground_reconstruction
