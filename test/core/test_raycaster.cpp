#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "smoke_ground_reconstruction/simulation/raycaster.hpp"
#include "smoke_ground_reconstruction/simulation/scan_simulator.hpp"
#include "smoke_ground_reconstruction/simulation/smoke_field.hpp"

namespace smoke_ground_reconstruction {
namespace simulation {
namespace {

using Loop = FacetMesh::Loop;

Loop square(double half, double z) {
  return {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
}

Ray rayTo(const Eigen::Vector3d& origin, const Eigen::Vector3d& target) {
  return {origin, (target - origin).normalized()};
}

TEST(FacetMesh, MeetsAFloorAtItsDistance) {
  FacetMesh mesh;
  mesh.addFacet({square(5.0, 0.0)}, 7);
  mesh.build();
  const Hit hit = mesh.cast(rayTo({0, 0, 1}, {3, 4, 0}));
  EXPECT_NEAR(hit.range, std::sqrt(26.0), 1e-12);
  EXPECT_NEAR(hit.cos_incidence, 1.0 / std::sqrt(26.0), 1e-12);
  EXPECT_EQ(hit.material, 7);
}

TEST(FacetMesh, LooksThroughAHole) {
  FacetMesh mesh;
  mesh.addFacet({square(5.0, 0.0), square(1.0, 0.0)}, 1);
  mesh.addFacet({square(5.0, -2.0)}, 2);
  mesh.build();
  EXPECT_EQ(mesh.cast(rayTo({0, 0, 1}, {0.99, 0, 0})).material, 2);
  EXPECT_EQ(mesh.cast(rayTo({0, 0, 1}, {1.01, 0, 0})).material, 1);
}

TEST(FacetMesh, MissesBehindBesideAndBeyondTheLimit) {
  FacetMesh mesh;
  mesh.addFacet({square(5.0, 0.0)}, 1);
  mesh.build();
  EXPECT_FALSE(mesh.cast({{0, 0, 1}, {0, 0, 1}}).isHit());
  EXPECT_FALSE(mesh.cast(rayTo({0, 0, 1}, {5.01, 0, 0})).isHit());
  EXPECT_FALSE(mesh.cast({{0, 0, 1}, {0, 0, -1}}, 0.99).isHit());
  EXPECT_FALSE(mesh.cast({{0, 0, 1}, {1, 0, 0}}).isHit());  // parallel to the floor
}

TEST(FacetMesh, AnEmptyMeshIsMissed) {
  FacetMesh mesh;
  mesh.build();
  EXPECT_FALSE(mesh.cast({{0, 0, 0}, {1, 0, 0}}).isHit());
}

TEST(FacetMesh, RefusesWhatIsNoPlanarPolygon) {
  FacetMesh mesh;
  EXPECT_THROW(mesh.addFacet({}, 0), std::invalid_argument);
  EXPECT_THROW(mesh.addFacet({{{0, 0, 0}, {1, 0, 0}}}, 0), std::invalid_argument);
  EXPECT_THROW(mesh.addFacet({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}}, 0), std::invalid_argument);
  EXPECT_THROW(mesh.addFacet({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.01}, {0, 1, 0}}}, 0),
               std::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(mesh.addFacet({{{0, 0, 0}, {1, 0, 0}, {nan, 1, 0}}}, 0), std::invalid_argument);
}

TEST(FacetMesh, TheTreeFindsWhatBruteForceFinds) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(-4.0, 4.0);
  const auto point = [&] {
    const double x = uniform(generator);
    const double y = uniform(generator);
    const double z = uniform(generator);
    return Eigen::Vector3d(x, y, z);
  };
  FacetMesh tree;
  std::vector<FacetMesh> singles;
  for (std::uint16_t i = 0; i < 200; ++i) {
    const Eigen::Vector3d corner = point();
    const Loop triangle = {corner, corner + 0.3 * point(), corner + 0.3 * point()};
    tree.addFacet({triangle}, i);
    singles.emplace_back();
    singles.back().addFacet({triangle}, i);
    singles.back().build();
  }
  tree.build();
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d origin = point();
    const Ray ray = rayTo(origin, point());
    Hit nearest;
    for (const auto& single : singles) {
      const Hit hit = single.cast(ray);
      nearest = hit.range < nearest.range ? hit : nearest;
    }
    const Hit found = tree.cast(ray);
    ASSERT_EQ(found.range, nearest.range);
    ASSERT_EQ(found.material, nearest.material);
    hits += found.isHit() ? 1 : 0;
  }
  EXPECT_GT(hits, 500);
}

TEST(NoiseTile, HasZeroMeanAndUnitVariance) {
  const auto tile = noiseTile(3);
  double sum = 0.0, squares = 0.0;
  for (const float sample : tile) {
    sum += sample;
    squares += static_cast<double>(sample) * sample;
  }
  const auto count = static_cast<double>(tile.size());
  EXPECT_NEAR(sum / count, 0.0, 1e-5);
  EXPECT_NEAR(squares / count, 1.0, 1e-5);
  EXPECT_NE(tile, noiseTile(4));
}

TEST(SmokeField, AHomogeneousFieldFollowsBeerAndLambert) {
  SmokeParams params;
  params.sigma_ln = 0.0;
  params.mean_extinction = 0.5;
  const SmokeField field(params, 0);
  const auto passage = field.march({{1, 2, 0.7}, {0.6, 0.8, 0}}, 4.0, 0.0, DetectionLimit());
  EXPECT_NEAR(passage.optical_depth, 2.0, 1e-9);
}

TEST(SmokeField, TheMeanOfAPatchyFieldIsTheMeanExtinction) {
  SmokeParams params;
  params.mean_extinction = 0.5;
  const SmokeField field(params, 1);
  double sum = 0.0;
  const int steps = 40;  // over one period: 12.8 m x 12.8 m x 3.2 m
  for (int i = 0; i < steps * steps * steps; ++i) {
    const Eigen::Vector3d share(i % steps, (i / steps) % steps, i / (steps * steps));
    sum +=
        field.extinction((share.array() * Eigen::Array3d(12.8, 12.8, 3.2) / steps).matrix(), 0.0);
  }
  EXPECT_NEAR(sum / (steps * steps * steps), 0.5, 0.025);  // interpolation flattens the peaks
}

TEST(SmokeField, TheMarchAgreesWithAFineSum) {
  SmokeParams params;
  params.mean_extinction = 0.3;
  params.plume_radius = 0.7;
  params.plume_gain = 2.0;
  params.plume_centre = {3.0, 2.0, 0.5};
  params.layer_height = 1.0;
  params.layer_thickness = 0.5;
  params.below_layer = 0.4;
  const SmokeField field(params, 2);
  for (int i = 0; i < 20; ++i) {
    const double azimuth = 0.3 * i;
    const Ray ray{{2.5, 1.5, 0.7},
                  Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.02 * i).normalized()};
    const double length = 2.0 + 0.4 * i;
    double depth = 0.0;
    for (double range = 0.0005; range < length; range += 0.001) {
      depth += 0.001 * field.extinction(ray.origin + range * ray.direction, 0.0);
    }
    const auto passage = field.march(ray, length, 0.0, DetectionLimit());
    EXPECT_NEAR(passage.optical_depth / depth, 1.0, 0.02) << "ray " << i;
  }
}

TEST(SmokeField, DriftCarriesThePatternAlong) {
  SmokeParams params;
  params.drift = {0.3, -0.2, 0.1};
  const SmokeField field(params, 9);
  const Eigen::Vector3d place(1.1, 2.3, 0.9);
  EXPECT_NEAR(field.extinction(place, 0.0), field.extinction(place + 2.0 * params.drift, 2.0),
              1e-4);
}

TEST(SmokeField, RefusesParametersOutOfTheirLimits) {
  SmokeParams params;
  params.mean_extinction = -0.1;
  EXPECT_THROW(SmokeField(params, 0), std::invalid_argument);
}

TEST(Detection, IsEvenAtTheLimit) {
  EXPECT_DOUBLE_EQ(detectionProbability(1.0, 0.25), 0.5);
  EXPECT_NEAR(detectionProbability(std::exp(0.25), 0.25), 0.8413447, 1e-6);  // one sigma above
  EXPECT_EQ(detectionProbability(0.0, 0.25), 0.0);
}

}  // namespace
}  // namespace simulation
}  // namespace smoke_ground_reconstruction
