#pragma once

#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/agdor_filter.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/occupancy.hpp"
#include "smoke_ground_reconstruction/polar_segments.hpp"
#include "smoke_ground_reconstruction/room_boundary.hpp"
#include "smoke_ground_reconstruction/visibility.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {

/// The thesis's own method on a polar grid, or ours: the room's boundary per azimuth column.
enum class ReconstructionMethod { kPolarSegments, kRoomBoundary };

/// Parameters of the last stage, whatever the method.
struct ReconstructorParams {
  ReconstructionMethod method = ReconstructionMethod::kRoomBoundary;
  double sensor_height = 0.70;        ///< of the sensor above the floor [m]
  double occupancy_resolution = 0.1;  ///< edge of a cell of the occupancy grid [m]
  PolarSegmentsParams polar_segments;
  RoomBoundaryParams room_boundary;

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

/// Milliseconds of wall time of one stage.
struct StageTime {
  const char* stage;
  double milliseconds;
};

struct PipelineResult {
  std::vector<Label> labels;            ///< per input point, after segmentation
  std::vector<std::uint32_t> clusters;  ///< per input point; room_boundary makes none
  FloorSurface surface;
  OccupancyGrid occupancy;
  Visibility visibility;         ///< unknown with polar_segments
  std::vector<StageTime> times;  ///< in the order of work
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
  /// Into an answer that may bring the memory of an earlier one: `room_boundary` then needs no
  /// more.
  void process(const ScanView& scan, const Mounting& mounting, PipelineResult* result);

  /// The beams; seed it for a known sensor, else it learns from each scan.
  SensorModel& sensor() { return sensor_; }

 private:
  void processSegments(const ScanView& scan, const Mounting& mounting, PipelineResult* result);
  void processRoom(const ScanView& scan, const Mounting& mounting, PipelineResult* result);

  PipelineParams params_;
  AgdorFilter denoiser_;
  ChannelSegmentation segmentation_;
  WallClustering clustering_;
  PolarSegments polar_segments_;
  RoomBoundary room_boundary_;
  RoomBoundaryResult room_;
  SensorModel sensor_;
};

}  // namespace smoke_ground_reconstruction
