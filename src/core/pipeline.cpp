#include "smoke_ground_reconstruction/pipeline.hpp"

#include <chrono>

#include "smoke_ground_reconstruction/label.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

class Stopwatch {
 public:
  /// Milliseconds since the last call.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> passed = now - last_;
    last_ = now;
    return passed.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Structure-of-arrays copy of some points of a view, in its order and frame.
struct Selection {
  std::vector<float> x, y, z, intensity;
  std::vector<std::uint16_t> ring;

  void append(const ScanView& scan, std::size_t i) {
    x.push_back(scan.x[i]);
    y.push_back(scan.y[i]);
    z.push_back(scan.z[i]);
    intensity.push_back(scan.intensity[i]);
    ring.push_back(scan.ring[i]);
  }
  ScanView view() const { return ScanView::of(x, y, z, intensity, ring); }
};

}  // namespace

void ReconstructorParams::validate() const {
  require(sensor_height > 0.0, "sensor_height", "> 0", sensor_height);
  require(occupancy_resolution >= 0.01, "occupancy_resolution", ">= 0.01", occupancy_resolution);
  if (method == ReconstructionMethod::kRoomBoundary) {
    throw std::invalid_argument(
        "method must be polar_segments in the compiled engine, is room_boundary: only the Python "
        "engine has it yet");
  }
  polar_segments.validate();
}

Pipeline::Pipeline(const PipelineParams& params, const Engines& engines)
    : params_(params),
      denoiser_(params.denoiser, engines.kdtree_counter),
      segmentation_(params.segmenter.segmentation),
      clustering_(params.segmenter.clustering, engines.kdtree_clustering),
      polar_segments_(params.reconstructor.polar_segments) {
  params_.reconstructor.validate();
}

PipelineResult Pipeline::process(const ScanView& view) {
  Mounting mounting;
  mounting.sensor_height = params_.reconstructor.sensor_height;
  return process(view, mounting);
}

PipelineResult Pipeline::process(const ScanView& view, const Mounting& mounting) {
  PipelineResult result;
  Stopwatch stopwatch;
  sensor_.observe(view);
  const Scan scan(view);  // the denoiser knows nothing of the mounting
  const bool is_level = mounting.isLevel();
  const Scan levelled(is_level ? ScanView() : view, mounting);
  const Scan& level = is_level ? scan : levelled;
  result.times.organise = stopwatch.lap();
  const auto denoised = denoiser_.classify(scan);
  result.times.denoise = stopwatch.lap();
  result.labels = segmentation_.classify(level, denoised, sensor_);
  result.times.segment = stopwatch.lap();
  result.clusters = clustering_.cluster(level, result.labels);
  result.times.cluster = stopwatch.lap();

  Selection ground;
  Selection walls;
  for (std::size_t i = 0; i < view.size; ++i) {
    if (result.labels[i] == Label::kGround) ground.append(view, i);
    if (result.clusters[i] != kNoCluster) walls.append(view, i);
  }
  result.surface = polar_segments_.reconstruct(ground.view(), walls.view(), sensor_, mounting);
  result.times.reconstruct = stopwatch.lap();
  result.occupancy =
      rasterize(result.surface, walls.view(), mounting, params_.reconstructor.occupancy_resolution);
  result.times.rasterize = stopwatch.lap();
  return result;
}

}  // namespace smoke_ground_reconstruction
