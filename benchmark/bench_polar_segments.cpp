#include "scene.hpp"
#include "smoke_ground_reconstruction/occupancy.hpp"
#include "smoke_ground_reconstruction/polar_segments.hpp"

namespace smoke_ground_reconstruction {
namespace {

/// No measured ground at all: every segment is drawn.
void reconstruct(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  const Cloud walls = pointsOf(scene, Label::kWall);
  const PolarSegments method{PolarSegmentsParams()};
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        method.reconstruct(ScanView(), walls.view(), scene.sensor, Mounting()));
  }
}
BENCHMARK(reconstruct)->Apply(ringCounts);

/// All ground measured: every segment keeps its points.
void keepMeasured(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  const Cloud walls = pointsOf(scene, Label::kWall);
  const Cloud ground = pointsOf(scene, Label::kGround);
  const PolarSegments method{PolarSegmentsParams()};
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        method.reconstruct(ground.view(), walls.view(), scene.sensor, Mounting()));
  }
}
BENCHMARK(keepMeasured)->Apply(ringCounts);

void rasterizeRoom(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  const Cloud walls = pointsOf(scene, Label::kWall);
  const FloorSurface surface = PolarSegments(PolarSegmentsParams())
                                   .reconstruct(ScanView(), walls.view(), scene.sensor, Mounting());
  for (auto _ : state) {
    benchmark::DoNotOptimize(rasterize(surface, walls.view(), Mounting(), 0.1));
  }
}
BENCHMARK(rasterizeRoom)->Apply(ringCounts);

}  // namespace
}  // namespace smoke_ground_reconstruction
