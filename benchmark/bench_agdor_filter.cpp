#include "scene.hpp"
#include "smoke_ground_reconstruction/agdor_filter.hpp"
#ifdef SMOKE_GROUND_HAVE_PCL
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#endif

namespace smoke_ground_reconstruction {
namespace {

/// Three azimuth steps, theta in radians, every point asked for three neighbours.
AgdorParams narrow() {
  AgdorParams params;
  params.intensity_threshold = 1000.0;
  params.alpha = 3.0;
  params.theta_unit = ThetaUnit::kRadians;
  params.min_neighbors = 2;
  params.max_neighbors = 0;
  return params;
}

/// Table A.1, theta in degrees.
AgdorParams printed() { return AgdorParams(); }

void denoise(benchmark::State& state, const AgdorFilter& filter) {
  const Scan scan(sceneOf(static_cast<int>(state.range(0))).packedView());
  for (auto _ : state) benchmark::DoNotOptimize(filter.classify(scan));
}

void denoiseNarrowWindow(benchmark::State& state) { denoise(state, AgdorFilter(narrow())); }
BENCHMARK(denoiseNarrowWindow)->Apply(ringCounts);

void denoisePrintedWindow(benchmark::State& state) { denoise(state, AgdorFilter(printed())); }
BENCHMARK(denoisePrintedWindow)->Apply(ringCounts);

#ifdef SMOKE_GROUND_HAVE_PCL
void denoiseKdTree(benchmark::State& state, AgdorParams params) {
  params.engine = DenoiserEngine::kKdTree;
  denoise(state, AgdorFilter(params, makeKdTreeCounter));
}

void denoiseNarrowKdTree(benchmark::State& state) { denoiseKdTree(state, narrow()); }
BENCHMARK(denoiseNarrowKdTree)->Apply(ringCounts);

void denoisePrintedKdTree(benchmark::State& state) { denoiseKdTree(state, printed()); }
BENCHMARK(denoisePrintedKdTree)->Apply(ringCounts);
#endif

}  // namespace
}  // namespace smoke_ground_reconstruction
