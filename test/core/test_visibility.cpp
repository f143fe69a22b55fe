#include <gtest/gtest.h>

#include <cmath>

#include "smoke_ground_reconstruction/visibility.hpp"

namespace smoke_ground_reconstruction {
namespace {

/// One wall from 1 to 5 m, seen at a cosine of 0.8: I = level cos exp(-2 alpha R).
WallLight wallInSmoke(double extinction, double level) {
  WallLight returns;
  for (int i = 0; i < 4000; ++i) {
    const double range = 1.0 + 0.001 * i;
    returns.push(0, range, level * 0.8 * std::exp(-2.0 * extinction * range), 0.8);
  }
  return returns;
}

TEST(VisibilityEstimator, TakesTheSlopeWhereClearAirWasNeverSeen) {
  VisibilityEstimator estimator;
  const Visibility found = estimator.estimate(wallInSmoke(0.4, 200.0));
  EXPECT_NEAR(found.extinction, 0.4, 0.004);
  EXPECT_NEAR(found.meteorologicalRange(), std::log(20.0) / 0.4, 0.1);
  EXPECT_GT(found.sigma, 0.1);  // patches may tilt it
  EXPECT_TRUE(std::isnan(estimator.clearLevel()));
}

TEST(VisibilityEstimator, LearnsHowBrightWallsAreInClearAir) {
  VisibilityEstimator estimator;
  const Visibility clear = estimator.estimate(wallInSmoke(0.0, 200.0));
  EXPECT_NEAR(clear.extinction, 0.0, 1e-3);
  EXPECT_TRUE(std::isinf(Visibility{0.0, 0.0}.meteorologicalRange()));
  EXPECT_NEAR(estimator.clearLevel(), std::log(200.0), 1e-3);
  estimator.estimate(wallInSmoke(0.0, 100.0));  // a darker room
  EXPECT_NEAR(estimator.clearLevel(), std::log(200.0), 1e-3);
  // The wall of 100 in clear air looks as the one of 200 behind ln(2) / (2 R) of smoke.
  EXPECT_GT(estimator.estimate(wallInSmoke(0.0, 100.0)).extinction, 0.05);
}

TEST(VisibilityEstimator, SaysNothingOfTooFewReturns) {
  VisibilityEstimator estimator;
  EXPECT_FALSE(estimator.estimate({}).isKnown());
  WallLight few;
  for (int i = 0; i < 20; ++i) few.push(0, 1.0 + 0.2 * i, 10.0, 0.8);
  EXPECT_FALSE(estimator.estimate(few).isKnown());
}

}  // namespace
}  // namespace smoke_ground_reconstruction
