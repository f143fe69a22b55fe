#pragma once

#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/agdor_filter.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/occupancy.hpp"
#include "smoke_ground_reconstruction/polar_segments.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {

/// kRoomBoundary runs in the Python reference alone so far; ReconstructorParams::validate() refuses
/// it.
enum class ReconstructionMethod { kPolarSegments, kRoomBoundary };

/// Parameters of the last stage, whatever the method.
struct ReconstructorParams {
  ReconstructionMethod method = ReconstructionMethod::kPolarSegments;
  double sensor_height = 0.70;        ///< of the sensor above the floor [m]
  double occupancy_resolution = 0.1;  ///< edge of a cell of the occupancy grid [m]
  PolarSegmentsParams polar_segments;

  /// \throws std::invalid_argument naming the parameter, its value and what it may be.
  void validate() const;
};

struct SegmenterParams {
  ChannelSegmentationParams segmentation;
  WallClusteringParams clustering;
};

struct PipelineParams {
  AgdorParams denoiser;
  SegmenterParams segmenter;
  ReconstructorParams reconstructor;
};

/// What stands on a KD-tree; pcl/engines.hpp makes both.
struct Engines {
  NeighborCounterFactory kdtree_counter;
  ComponentFinder kdtree_clustering;
};

/// Milliseconds of wall time per stage, in the order of work.
struct StageTimes {
  double organise = 0, denoise = 0, segment = 0, cluster = 0, reconstruct = 0, rasterize = 0;
};

struct PipelineResult {
  std::vector<Label> labels;            ///< per input point, after segmentation
  std::vector<std::uint32_t> clusters;  ///< per input point
  FloorSurface surface;
  OccupancyGrid occupancy;
  StageTimes times;
};

/// The stages in order, in one thread: what the three nodelets do between them.
class Pipeline {
 public:
  /// \throws std::invalid_argument on bad parameters or a missing engine.
  explicit Pipeline(const PipelineParams& params, const Engines& engines = Engines());

  /// \param rotation  levels the sensor frame (Mounting::rotation).
  PipelineResult process(const ScanView& scan, const Mounting& mounting);
  /// Level sensor at reconstructor.sensor_height.
  PipelineResult process(const ScanView& scan);

  /// The beams; seed it for a known sensor, else it learns from each scan.
  SensorModel& sensor() { return sensor_; }

 private:
  PipelineParams params_;
  AgdorFilter denoiser_;
  ChannelSegmentation segmentation_;
  WallClustering clustering_;
  PolarSegments polar_segments_;
  SensorModel sensor_;
};

}  // namespace smoke_ground_reconstruction
