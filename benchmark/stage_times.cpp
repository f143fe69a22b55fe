// stage_times RUNS REFERENCE_RUNS SCAN...: times every stage and engine on scans, one after the
// other in one thread, and prints JSON. A scan is a file of points as a driver packs them: x y z
// intensity float32, ring uint16, 18 bytes each, in the byte order of the machine.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>

#include "counted_memory.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"
#ifdef SMOKE_GROUND_HAVE_PCL
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#endif
#ifdef SMOKE_GROUND_HAVE_NANOFLANN
#include "nanoflann_counter.hpp"
#endif

namespace smoke_ground_reconstruction {
namespace {

constexpr std::size_t kPointStep = 18;

/// A scan and what the stages before have made of it.
struct Input {
  std::vector<char> packed;
  ScanView view;
  SensorModel sensor;
  std::unique_ptr<Scan> scan;
  std::vector<Label> denoised;
  std::vector<Label> labels;
  std::vector<std::uint32_t> clusters;
  std::unique_ptr<Scan> ground, walls;
  FloorSurface surface;
};

using Inputs = std::vector<std::unique_ptr<Input>>;

struct Stage {
  std::string name;
  std::string engine;
  /// Returns the bytes of the arrays it was given and of those it gave, each once: what any method
  /// must touch. Memory of its own and second looks are not in it.
  std::function<std::size_t(Input*)> work;
};

template <typename T>
std::size_t bytesOf(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

std::size_t bytesOf(const Scan& scan) {
  return bytesOf(scan.x) + bytesOf(scan.y) + bytesOf(scan.z) + bytesOf(scan.intensity) +
         bytesOf(scan.ring) + bytesOf(scan.valid);
}

std::size_t bytesOf(const FloorSurface& s) {
  return bytesOf(s.x) + bytesOf(s.y) + bytesOf(s.z) + bytesOf(s.intensity) + bytesOf(s.ring) +
         bytesOf(s.provenance) + bytesOf(s.confidence) + bytesOf(s.sigma) +
         bytesOf(s.boundary.vertices) + bytesOf(s.boundary.kinds);
}

std::size_t bytesOf(const PipelineResult& result) {
  return bytesOf(result.labels) + bytesOf(result.clusters) + bytesOf(result.surface) +
         bytesOf(result.occupancy.cells);
}

/// Every point asked for more than two neighbours within three azimuth steps of 0.4 deg.
AgdorParams narrow() {
  AgdorParams params;
  params.intensity_threshold = 1e9;
  params.alpha = 3.0;
  params.theta_unit = ThetaUnit::kRadians;
  params.min_neighbors = 2;
  params.max_neighbors = 0;
  return params;
}

WallClusteringParams clustering(double tolerance, ClusterEngine engine) {
  WallClusteringParams params;
  params.cluster_tolerance = tolerance;
  params.max_cluster_size = 0;
  params.cluster_engine = engine;
  return params;
}

void read(const std::string& path, Input* input) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  input->packed.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  const char* first = input->packed.data();
  input->view.x = {first, kPointStep};
  input->view.y = {first + 4, kPointStep};
  input->view.z = {first + 8, kPointStep};
  input->view.intensity = {first + 12, kPointStep};
  input->view.ring = {first + 16, kPointStep};
  input->view.size = input->packed.size() / kPointStep;
}

std::unique_ptr<Scan> pointsWhere(const Input& input, const std::function<bool(std::size_t)>& is) {
  std::vector<float> x, y, z, intensity;
  std::vector<std::uint16_t> ring;
  for (std::size_t i = 0; i < input.view.size; ++i) {
    if (!is(i)) continue;
    x.push_back(input.view.x[i]);
    y.push_back(input.view.y[i]);
    z.push_back(input.view.z[i]);
    intensity.push_back(input.view.intensity[i]);
    ring.push_back(input.view.ring[i]);
  }
  return std::make_unique<Scan>(ScanView::of(x, y, z, intensity, ring));
}

/// What each stage gets from the ones before it.
void prepare(Input* input) {
  input->sensor.observe(input->view);
  input->scan = std::make_unique<Scan>(input->view);
  input->denoised = AgdorFilter(AgdorParams()).classify(*input->scan);
  input->labels = ChannelSegmentation(ChannelSegmentationParams())
                      .classify(*input->scan, input->denoised, input->sensor);
  input->clusters =
      WallClustering(clustering(0.05, ClusterEngine::kGrid)).cluster(*input->scan, input->labels);
  input->ground =
      pointsWhere(*input, [&](std::size_t i) { return input->labels[i] == Label::kGround; });
  input->walls =
      pointsWhere(*input, [&](std::size_t i) { return input->clusters[i] != kNoCluster; });
  input->surface =
      PolarSegments(PolarSegmentsParams())
          .reconstruct(input->ground->view(), input->walls->view(), input->sensor, Mounting());
}

Stage denoiser(const std::string& name, const std::string& engine, AgdorParams params,
               const NeighborCounterFactory& counter = nullptr) {
  if (counter) params.engine = DenoiserEngine::kKdTree;
  const auto filter = std::make_shared<AgdorFilter>(params, counter);
  return {name, engine, [filter](Input* input) {
            return bytesOf(*input->scan) + bytesOf(filter->classify(*input->scan));
          }};
}

Stage clusterer(double tolerance, const std::string& engine,
                const ComponentFinder& finder = nullptr) {
  const auto kind = finder ? ClusterEngine::kKdTree : ClusterEngine::kGrid;
  const auto stage = std::make_shared<WallClustering>(clustering(tolerance, kind), finder);
  const std::string name = tolerance < 0.1 ? "cluster, 0.05 m" : "cluster, 0.20 m";
  return {name, engine, [stage](Input* input) {
            return bytesOf(*input->scan) + bytesOf(input->labels) +
                   bytesOf(stage->cluster(*input->scan, input->labels));
          }};
}

Stage whole(const std::string& engine, PipelineParams params, const Engines& engines) {
  params.segmenter.clustering.max_cluster_size = 0;
  const auto pipeline = std::make_shared<Pipeline>(params, engines);
  const bool is_room = params.reconstructor.method == ReconstructionMethod::kRoomBoundary;
  return {is_room ? "whole, room_boundary" : "whole, polar_segments", engine,
          [pipeline](Input* input) {
            return bytesOf(input->packed) + bytesOf(pipeline->process(input->view));
          }};
}

std::vector<Stage> ourStages() {
  std::vector<Stage> stages;
  stages.push_back({"decode", "", [](Input* input) {
                      return bytesOf(input->packed) + bytesOf(Scan(input->view));
                    }});
  stages.push_back({"observe", "", [](Input* input) {
                      input->sensor.observe(input->view);
                      return bytesOf(input->packed);
                    }});
  stages.push_back(denoiser("denoise A", "window", narrow()));
  stages.push_back(denoiser("denoise B", "window", AgdorParams()));
  const auto segmentation = std::make_shared<ChannelSegmentation>(ChannelSegmentationParams());
  stages.push_back(
      {"segment", "", [segmentation](Input* input) {
         return bytesOf(*input->scan) + bytesOf(input->denoised) +
                bytesOf(segmentation->classify(*input->scan, input->denoised, input->sensor));
       }});
  stages.push_back(clusterer(0.05, "grid"));
  stages.push_back(clusterer(0.20, "grid"));
  const auto polar = std::make_shared<PolarSegments>(PolarSegmentsParams());
  stages.push_back({"reconstruct", "polar_segments", [polar](Input* input) {
                      return bytesOf(*input->ground) + bytesOf(*input->walls) +
                             bytesOf(polar->reconstruct(input->ground->view(), input->walls->view(),
                                                        input->sensor, Mounting()));
                    }});
  stages.push_back({"rasterize", "", [](Input* input) {
                      const auto grid =
                          rasterize(input->surface, input->walls->view(), Mounting(), 0.1);
                      return bytesOf(input->surface) + bytesOf(*input->walls) + bytesOf(grid.cells);
                    }});
  PipelineParams params;
  params.reconstructor.method = ReconstructionMethod::kPolarSegments;
  params.segmenter.clustering.cluster_engine = ClusterEngine::kGrid;
  stages.push_back(whole("window, grid", params, Engines()));
  params.reconstructor.method = ReconstructionMethod::kRoomBoundary;
  stages.push_back(whole("", params, Engines()));
  return stages;
}

std::vector<Stage> referenceStages() {
  std::vector<Stage> stages;
#ifdef SMOKE_GROUND_HAVE_NANOFLANN
  stages.push_back(denoiser("denoise A", "nanoflann", narrow(), makeNanoflannCounter));
  stages.push_back(denoiser("denoise B", "nanoflann", AgdorParams(), makeNanoflannCounter));
#endif
#ifdef SMOKE_GROUND_HAVE_PCL
  stages.push_back(denoiser("denoise A", "PCL", narrow(), makeKdTreeCounter));
  stages.push_back(denoiser("denoise B", "PCL", AgdorParams(), makeKdTreeCounter));
  stages.push_back(clusterer(0.05, "PCL", findComponentsWithPcl));
  stages.push_back(clusterer(0.20, "PCL", findComponentsWithPcl));
  PipelineParams params;
  params.reconstructor.method = ReconstructionMethod::kPolarSegments;
  params.denoiser.engine = DenoiserEngine::kKdTree;
  stages.push_back(whole("PCL", params, pclEngines()));
#endif
  return stages;
}

double milliseconds(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// "p50": ..., "p99": ... of some times [ms].
std::string percentiles(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    return times[static_cast<std::size_t>(std::ceil(share * static_cast<double>(times.size()))) -
                 1];
  };
  return "{\"p50\": " + std::to_string(at(0.5)) + ", \"p99\": " + std::to_string(at(0.99)) + "}";
}

/// Runs a stage on the scans in turn and describes it in one JSON object.
std::string timed(const Stage& stage, const Inputs& inputs, std::size_t runs) {
  std::vector<double> cpu(runs);
  std::vector<double> wall(runs);
  std::size_t touched = 0;
  for (const auto& input : inputs) touched += stage.work(input.get());  // the steady state
  const CountedMemory before = countedMemory();
  for (std::size_t i = 0; i < runs; ++i) {
    Input* const input = inputs[i % inputs.size()].get();
    const double cpu_begin = milliseconds(CLOCK_THREAD_CPUTIME_ID);
    const double wall_begin = milliseconds(CLOCK_MONOTONIC);
    stage.work(input);
    wall[i] = milliseconds(CLOCK_MONOTONIC) - wall_begin;
    cpu[i] = milliseconds(CLOCK_THREAD_CPUTIME_ID) - cpu_begin;
  }
  const CountedMemory after = countedMemory();
  return "{\"stage\": \"" + stage.name + "\", \"engine\": \"" + stage.engine +
         "\", \"runs\": " + std::to_string(runs) + ", \"cpu_ms\": " + percentiles(cpu) +
         ", \"wall_ms\": " + percentiles(wall) +
         ", \"allocations\": " + std::to_string((after.allocations - before.allocations) / runs) +
         ", \"allocated_bytes\": " + std::to_string((after.bytes - before.bytes) / runs) +
         ", \"touched_bytes\": " + std::to_string(touched / inputs.size()) + "}";
}

std::size_t meanOver(const Inputs& inputs, const std::function<std::size_t(const Input&)>& number) {
  std::size_t sum = 0;
  for (const auto& input : inputs) sum += number(*input);
  return sum / inputs.size();
}

void report(const Inputs& inputs, std::size_t runs, std::size_t reference_runs) {
  const std::size_t points = meanOver(inputs, [](const Input& i) { return i.view.size; });
  const std::size_t walls = meanOver(inputs, [](const Input& i) {
    return static_cast<std::size_t>(std::count(i.labels.begin(), i.labels.end(), Label::kWall));
  });
  const std::size_t dark = meanOver(inputs, [](const Input& i) {
    return static_cast<std::size_t>(
        std::count_if(i.scan->intensity.begin(), i.scan->intensity.end(),
                      [](float intensity) { return intensity < 25.0F; }));
  });
  std::cout << "{\"points\": " << points << ", \"wall_points\": " << walls
            << ", \"dark_points\": " << dark << ", \"stages\": [";
  const char* separator = "\n  ";
  for (const auto& [stages, times] :
       {std::pair(ourStages(), runs), std::pair(referenceStages(), reference_runs)}) {
    for (const Stage& stage : stages) {
      std::cout << separator << timed(stage, inputs, times) << std::flush;
      separator = ",\n  ";
    }
  }
  std::cout << "]}\n";
}

}  // namespace
}  // namespace smoke_ground_reconstruction

int main(int argc, char** argv) {
  namespace sgr = smoke_ground_reconstruction;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 0;
  const int reference_runs = argc > 2 ? std::atoi(argv[2]) : 0;
  if (argc < 4 || runs < 1 || reference_runs < 1) {
    std::cerr << "usage: stage_times RUNS REFERENCE_RUNS SCAN...\n";
    return 2;
  }
  try {
    sgr::Inputs inputs;
    for (int i = 3; i < argc; ++i) {
      inputs.push_back(std::make_unique<sgr::Input>());
      sgr::read(argv[i], inputs.back().get());
      sgr::prepare(inputs.back().get());
    }
    sgr::report(inputs, static_cast<std::size_t>(runs), static_cast<std::size_t>(reference_runs));
  } catch (const std::exception& error) {
    std::cerr << "stage_times: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
