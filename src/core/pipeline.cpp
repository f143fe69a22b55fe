#include "smoke_ground_reconstruction/pipeline.hpp"

#include <chrono>
#include <optional>
#include <utility>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/point_selection.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

class Stopwatch {
 public:
  explicit Stopwatch(std::vector<StageTime>* times) : times_(times) {}

  /// A stage ends that began with the last call.
  void lap(const char* stage) {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> passed = now - last_;
    last_ = now;
    times_->push_back({stage, passed.count()});
  }

 private:
  std::vector<StageTime>* times_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

void ReconstructorParams::validate() const {
  require(sensor_height > 0.0, "sensor_height", "> 0", sensor_height);
  require(occupancy_resolution >= 0.01, "occupancy_resolution", ">= 0.01", occupancy_resolution);
  polar_segments.validate();
  room_boundary.validate();
}

Pipeline::Pipeline(const PipelineParams& params, const Engines& engines)
    : params_(params),
      denoiser_(params.denoiser, engines.kdtree_counter),
      segmentation_(params.segmenter.segmentation),
      clustering_(params.segmenter.clustering, engines.kdtree_clustering),
      polar_segments_(params.reconstructor.polar_segments),
      room_boundary_(params.reconstructor.room_boundary) {
  params_.reconstructor.validate();
}

PipelineResult Pipeline::process(const ScanView& view) {
  Mounting mounting;
  mounting.sensor_height = params_.reconstructor.sensor_height;
  return process(view, mounting);
}

PipelineResult Pipeline::process(const ScanView& view, const Mounting& mounting) {
  PipelineResult result;
  process(view, mounting, &result);
  return result;
}

void Pipeline::process(const ScanView& view, const Mounting& mounting, PipelineResult* result) {
  result->times.clear();
  if (params_.reconstructor.method == ReconstructionMethod::kRoomBoundary) {
    processRoom(view, mounting, result);
  } else {
    processSegments(view, mounting, result);
  }
}

void Pipeline::processSegments(const ScanView& view, const Mounting& mounting,
                               PipelineResult* result) {
  Stopwatch stopwatch(&result->times);
  const Scan scan(view);         // the denoiser knows nothing of the mounting
  sensor_.observe(scan.view());  // the same points, side by side
  const bool is_level = mounting.isLevel();
  const Scan levelled(is_level ? ScanView() : view, mounting);
  const Scan& level = is_level ? scan : levelled;
  stopwatch.lap("organise");
  std::optional<ScanRaster> raster;
  const auto denoised = denoiser_.classify(scan, &raster);
  stopwatch.lap("denoise");
  if (!is_level) raster.reset();  // its azimuths are others
  result->labels = segmentation_.classify(level, denoised, sensor_, &raster);
  stopwatch.lap("segment");
  result->clusters = clustering_.cluster(level, result->labels);
  stopwatch.lap("cluster");

  PointSelection ground;
  PointSelection walls;
  ground.appendAll(view, result->labels, Label::kGround);
  for (std::size_t i = 0; i < view.size; ++i) {
    if (result->clusters[i] != kNoCluster) walls.append(view, i);
  }
  result->visibility = Visibility();
  result->surface = polar_segments_.reconstruct(ground.view(), walls.view(), sensor_, mounting);
  stopwatch.lap("reconstruct");
  rasterize(result->surface, walls.view(), mounting, params_.reconstructor.occupancy_resolution,
            kOccupancyRange, &result->occupancy);
  stopwatch.lap("rasterize");
}

/// It denoises and segments by itself, and has no clusters.
void Pipeline::processRoom(const ScanView& view, const Mounting& mounting, PipelineResult* result) {
  Stopwatch stopwatch(&result->times);
  sensor_.observe(view);
  stopwatch.lap("organise");
  room_boundary_.reconstruct(view, sensor_, mounting, &room_);
  result->visibility = room_.visibility;
  std::swap(result->surface, room_.surface);
  std::swap(result->labels, room_.labels);
  result->clusters.assign(view.size, kNoCluster);
  stopwatch.lap("reconstruct");
  rasterize(result->surface, view, result->labels, mounting,
            params_.reconstructor.occupancy_resolution, kOccupancyRange, &result->occupancy);
  stopwatch.lap("rasterize");
}

}  // namespace smoke_ground_reconstruction
