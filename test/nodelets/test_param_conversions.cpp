#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "smoke_ground_reconstruction/ros/param_conversions.hpp"

namespace smoke_ground_reconstruction {
namespace {

TEST(ParamConversions, DefaultsOfCfgAreThoseOfTheStages) {
  const AgdorParams denoiser = toParams(DenoiserConfig::__getDefault__());
  EXPECT_EQ(denoiser.intensity_threshold, AgdorParams().intensity_threshold);
  EXPECT_EQ(denoiser.alpha, AgdorParams().alpha);
  EXPECT_EQ(denoiser.theta_deg, AgdorParams().theta_deg);
  EXPECT_EQ(denoiser.theta_unit, AgdorParams().theta_unit);
  EXPECT_EQ(denoiser.min_neighbors, AgdorParams().min_neighbors);
  EXPECT_EQ(denoiser.max_neighbors, AgdorParams().max_neighbors);
  EXPECT_EQ(denoiser.engine, AgdorParams().engine);

  const SegmenterParams segmenter = toParams(SegmenterConfig::__getDefault__());
  const ChannelSegmentationParams segmentation;
  EXPECT_EQ(segmenter.segmentation.min_wall_angle_deg, segmentation.min_wall_angle_deg);
  EXPECT_EQ(segmenter.segmentation.ground_range_step, segmentation.ground_range_step);
  EXPECT_EQ(segmenter.segmentation.wall_range_step, segmentation.wall_range_step);
  EXPECT_EQ(segmenter.clustering.cluster_engine, WallClusteringParams().cluster_engine);

  const ReconstructorParams reconstructor = toParams(ReconstructorConfig::__getDefault__());
  EXPECT_EQ(reconstructor.sensor_height, ReconstructorParams().sensor_height);
  EXPECT_EQ(reconstructor.polar_segments.wall_distance, PolarSegmentsParams().wall_distance);
}

// Every field must arrive under its own name: give each a value of its own.
TEST(ParamConversions, MapEveryFieldOfTheSegmenter) {
  SegmenterConfig config = SegmenterConfig::__getDefault__();
  config.column_width_deg = 0.8;
  config.min_ground_angle_deg = -4;
  config.max_ground_angle_deg = 5;
  config.max_ground_step_height = 0.06;
  config.ground_range_step = "increasing";
  config.ground_relative_margin = true;
  config.min_wall_angle_deg = 61;
  config.max_wall_angle_deg = 121;
  config.max_wall_step_height = 0.07;
  config.wall_range_step = "minimum";
  config.wall_relative_margin = false;
  config.min_range_step = 0.02;
  config.relative_distance_margin = 0.16;
  config.label_point = "second";
  config.cluster_tolerance = 0.08;
  config.cluster_tolerance_per_range = 0.09;
  config.min_cluster_size = 51;
  config.max_cluster_size = 5001;
  config.cluster_engine = "grid";
  const SegmenterParams params = toParams(config);
  const auto& s = params.segmentation;
  EXPECT_EQ(s.column_width_deg, 0.8);
  EXPECT_EQ(s.min_ground_angle_deg, -4);
  EXPECT_EQ(s.max_ground_angle_deg, 5);
  EXPECT_EQ(s.max_ground_step_height, 0.06);
  EXPECT_EQ(s.ground_range_step, RangeStepRule::kIncreasing);
  EXPECT_TRUE(s.ground_relative_margin);
  EXPECT_EQ(s.min_wall_angle_deg, 61);
  EXPECT_EQ(s.max_wall_angle_deg, 121);
  EXPECT_EQ(s.max_wall_step_height, 0.07);
  EXPECT_EQ(s.wall_range_step, RangeStepRule::kMinimum);
  EXPECT_FALSE(s.wall_relative_margin);
  EXPECT_EQ(s.min_range_step, 0.02);
  EXPECT_EQ(s.relative_distance_margin, 0.16);
  EXPECT_EQ(s.label_point, LabelPoint::kSecond);
  EXPECT_EQ(params.clustering.cluster_tolerance, 0.08);
  EXPECT_EQ(params.clustering.cluster_tolerance_per_range, 0.09);
  EXPECT_EQ(params.clustering.min_cluster_size, 51);
  EXPECT_EQ(params.clustering.max_cluster_size, 5001);
  EXPECT_EQ(params.clustering.cluster_engine, ClusterEngine::kGrid);
}

TEST(ParamConversions, MapEveryFieldOfDenoiserAndReconstructor) {
  DenoiserConfig denoiser = DenoiserConfig::__getDefault__();
  denoiser.intensity_threshold = 26;
  denoiser.alpha = 0.6;
  denoiser.theta_deg = 0.5;
  denoiser.theta_unit = "radians";
  denoiser.min_neighbors = 101;
  denoiser.max_neighbors = 5001;
  denoiser.engine = "kdtree";
  const AgdorParams d = toParams(denoiser);
  EXPECT_EQ(d.intensity_threshold, 26);
  EXPECT_EQ(d.alpha, 0.6);
  EXPECT_EQ(d.theta_deg, 0.5);
  EXPECT_EQ(d.theta_unit, ThetaUnit::kRadians);
  EXPECT_EQ(d.min_neighbors, 101);
  EXPECT_EQ(d.max_neighbors, 5001);
  EXPECT_EQ(d.engine, DenoiserEngine::kKdTree);

  ReconstructorConfig reconstructor = ReconstructorConfig::__getDefault__();
  reconstructor.sensor_height = 0.8;
  reconstructor.occupancy_resolution = 0.2;
  reconstructor.segment_angle_deg = 12;
  reconstructor.horizontal_resolution_deg = 0.5;
  reconstructor.reconstruction_gain = 0.16;
  reconstructor.min_wall_points = 11;
  reconstructor.height_difference_threshold = 0.06;
  reconstructor.max_elevation_angle_deg = 6;
  reconstructor.wall_distance = "planar_range";
  reconstructor.max_floor_tilt_deg = 7;
  reconstructor.max_height_deviation = 0.2;
  reconstructor.floor_tolerance = 0.05;
  reconstructor.max_slope = 0.2;
  reconstructor.max_step_height = 0.25;
  reconstructor.drop_depth = 0.06;
  reconstructor.smoke_gate = 3;
  reconstructor.min_wall_height = 0.15;
  reconstructor.furniture_height = 2.5;
  reconstructor.max_bridge_ratio = 1.7;
  reconstructor.max_range = 20;
  reconstructor.cell_size = 0.3;
  const ReconstructorParams r = toParams(reconstructor);
  EXPECT_EQ(r.sensor_height, 0.8);
  EXPECT_EQ(r.occupancy_resolution, 0.2);
  EXPECT_EQ(r.polar_segments.segment_angle_deg, 12);
  EXPECT_EQ(r.polar_segments.horizontal_resolution_deg, 0.5);
  EXPECT_EQ(r.polar_segments.reconstruction_gain, 0.16);
  EXPECT_EQ(r.polar_segments.min_wall_points, 11);
  EXPECT_EQ(r.polar_segments.height_difference_threshold, 0.06);
  EXPECT_EQ(r.polar_segments.max_elevation_angle_deg, 6);
  EXPECT_EQ(r.polar_segments.wall_distance, WallDistance::kPlanarRange);
  EXPECT_EQ(r.room_boundary.max_floor_tilt_deg, 7);
  EXPECT_EQ(r.room_boundary.max_height_deviation, 0.2);
  EXPECT_EQ(r.room_boundary.floor_tolerance, 0.05);
  EXPECT_EQ(r.room_boundary.max_slope, 0.2);
  EXPECT_EQ(r.room_boundary.max_step_height, 0.25);
  EXPECT_EQ(r.room_boundary.drop_depth, 0.06);
  EXPECT_EQ(r.room_boundary.smoke_gate, 3);
  EXPECT_EQ(r.room_boundary.min_wall_height, 0.15);
  EXPECT_EQ(r.room_boundary.furniture_height, 2.5);
  EXPECT_EQ(r.room_boundary.max_bridge_ratio, 1.7);
  EXPECT_EQ(r.room_boundary.max_range, 20);
  EXPECT_EQ(r.room_boundary.cell_size, 0.3);
}

TEST(ParamConversions, RefuseUnknownNames) {
  DenoiserConfig config = DenoiserConfig::__getDefault__();
  config.engine = "octree";
  EXPECT_THROW(toParams(config), std::invalid_argument);
}

TEST(Repair, MovesAnAngleToTheNextDivisor) {
  EXPECT_EQ(nearestDivisorOf360(10.0), 10.0);
  EXPECT_EQ(nearestDivisorOf360(7.2), 7.2);
  EXPECT_DOUBLE_EQ(nearestDivisorOf360(7.0), 360.0 / 51.0);
  EXPECT_DOUBLE_EQ(nearestDivisorOf360(89.0), 90.0);
  EXPECT_DOUBLE_EQ(nearestDivisorOf360(359.0), 90.0);  // at least 4 bins
  EXPECT_DOUBLE_EQ(nearestDivisorOf360(0.001), 0.01);  // at most 36,000
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(nearestDivisorOf360(nan), nearestDivisorOf360(nan));  // left to validate()
}

TEST(Repair, MakesEveryConfigOfTheLimitsValid) {
  // The corners of the sliders, crossed: what toParams() refuses must not come out of repair().
  DenoiserConfig denoiser = DenoiserConfig::__getMax__();
  denoiser.theta_unit = "degrees";
  denoiser.engine = "window";
  denoiser.max_neighbors = 1;
  repair(denoiser);
  EXPECT_NO_THROW(toParams(denoiser));

  SegmenterConfig segmenter = SegmenterConfig::__getDefault__();
  segmenter.column_width_deg = 0.37;
  segmenter.min_ground_angle_deg = 20;
  segmenter.min_wall_angle_deg = 150;
  segmenter.min_cluster_size = 9000;
  repair(segmenter);
  EXPECT_NO_THROW(toParams(segmenter));
  EXPECT_EQ(segmenter.max_cluster_size, 9000);

  ReconstructorConfig reconstructor = ReconstructorConfig::__getDefault__();
  reconstructor.segment_angle_deg = 33;
  repair(reconstructor);
  EXPECT_NO_THROW(toParams(reconstructor));
}

}  // namespace
}  // namespace smoke_ground_reconstruction
