#include "smoke_ground_reconstruction/ros/param_conversions.hpp"

#include <algorithm>
#include <cmath>

#include "smoke_ground_reconstruction/enum_names.hpp"

namespace smoke_ground_reconstruction {
namespace {

ChannelSegmentationParams segmentationParams(const SegmenterConfig& config) {
  ChannelSegmentationParams params;
  params.column_width_deg = config.column_width_deg;
  params.min_ground_angle_deg = config.min_ground_angle_deg;
  params.max_ground_angle_deg = config.max_ground_angle_deg;
  params.max_ground_step_height = config.max_ground_step_height;
  params.ground_range_step =
      parseEnum<RangeStepRule>("ground_range_step", config.ground_range_step);
  params.ground_relative_margin = config.ground_relative_margin;
  params.min_wall_angle_deg = config.min_wall_angle_deg;
  params.max_wall_angle_deg = config.max_wall_angle_deg;
  params.max_wall_step_height = config.max_wall_step_height;
  params.wall_range_step = parseEnum<RangeStepRule>("wall_range_step", config.wall_range_step);
  params.wall_relative_margin = config.wall_relative_margin;
  params.min_range_step = config.min_range_step;
  params.relative_distance_margin = config.relative_distance_margin;
  params.label_point = parseEnum<LabelPoint>("label_point", config.label_point);
  return params;
}

WallClusteringParams clusteringParams(const SegmenterConfig& config) {
  WallClusteringParams params;
  params.cluster_tolerance = config.cluster_tolerance;
  params.cluster_tolerance_per_range = config.cluster_tolerance_per_range;
  params.min_cluster_size = config.min_cluster_size;
  params.max_cluster_size = config.max_cluster_size;
  params.cluster_engine = parseEnum<ClusterEngine>("cluster_engine", config.cluster_engine);
  return params;
}

RoomBoundaryParams roomParams(const ReconstructorConfig& config) {
  RoomBoundaryParams params;
  params.max_floor_tilt_deg = config.max_floor_tilt_deg;
  params.max_height_deviation = config.max_height_deviation;
  params.floor_tolerance = config.floor_tolerance;
  params.max_slope = config.max_slope;
  params.max_step_height = config.max_step_height;
  params.drop_depth = config.drop_depth;
  params.smoke_gate = config.smoke_gate;
  params.min_wall_height = config.min_wall_height;
  params.furniture_height = config.furniture_height;
  params.max_bridge_ratio = config.max_bridge_ratio;
  params.max_range = config.max_range;
  params.cell_size = config.cell_size;
  return params;
}

}  // namespace

AgdorParams toParams(const DenoiserConfig& config) {
  AgdorParams params;
  params.intensity_threshold = config.intensity_threshold;
  params.alpha = config.alpha;
  params.theta_deg = config.theta_deg;
  params.theta_unit = parseEnum<ThetaUnit>("theta_unit", config.theta_unit);
  params.min_neighbors = config.min_neighbors;
  params.max_neighbors = config.max_neighbors;
  params.engine = parseEnum<DenoiserEngine>("engine", config.engine);
  params.validate();
  return params;
}

SegmenterParams toParams(const SegmenterConfig& config) {
  SegmenterParams params{segmentationParams(config), clusteringParams(config)};
  params.segmentation.validate();
  params.clustering.validate();
  return params;
}

ReconstructorParams toParams(const ReconstructorConfig& config) {
  ReconstructorParams params;
  params.method = parseEnum<ReconstructionMethod>("method", config.method);
  params.sensor_height = config.sensor_height;
  params.occupancy_resolution = config.occupancy_resolution;
  params.polar_segments.segment_angle_deg = config.segment_angle_deg;
  params.polar_segments.horizontal_resolution_deg = config.horizontal_resolution_deg;
  params.polar_segments.reconstruction_gain = config.reconstruction_gain;
  params.polar_segments.min_wall_points = config.min_wall_points;
  params.polar_segments.height_difference_threshold = config.height_difference_threshold;
  params.polar_segments.max_elevation_angle_deg = config.max_elevation_angle_deg;
  params.polar_segments.wall_distance =
      parseEnum<WallDistance>("wall_distance", config.wall_distance);
  params.room_boundary = roomParams(config);
  params.validate();
  return params;
}

double nearestDivisorOf360(double width_deg) {
  if (!(width_deg > 0.0)) return width_deg;
  const double bins = std::min(std::max(std::round(360.0 / width_deg), 4.0), 36000.0);
  const bool divides = std::fabs(width_deg * bins - 360.0) <= 360.0 * 1e-6;
  return divides ? width_deg : 360.0 / bins;
}

void repair(DenoiserConfig& config) {
  if (config.max_neighbors != 0) {
    config.max_neighbors = std::max(config.max_neighbors, config.min_neighbors + 1);
  }
}

void repair(SegmenterConfig& config) {
  config.column_width_deg = nearestDivisorOf360(config.column_width_deg);
  config.max_ground_angle_deg = std::max(config.max_ground_angle_deg, config.min_ground_angle_deg);
  config.max_wall_angle_deg = std::max(config.max_wall_angle_deg, config.min_wall_angle_deg);
  if (config.max_cluster_size != 0) {
    config.max_cluster_size = std::max(config.max_cluster_size, config.min_cluster_size);
  }
}

void repair(ReconstructorConfig& config) {
  config.segment_angle_deg = nearestDivisorOf360(config.segment_angle_deg);
}

}  // namespace smoke_ground_reconstruction
