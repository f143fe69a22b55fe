#include "scene.hpp"
#include "smoke_ground_reconstruction/room_boundary.hpp"

namespace smoke_ground_reconstruction {
namespace {

/// The whole method, from the points as a driver packs them to surface and labels.
void roomBoundary(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  RoomBoundary method;
  RoomBoundaryResult result;
  for (auto _ : state) {
    method.reconstruct(scene.packedView(), scene.sensor, Mounting(), &result);
    benchmark::DoNotOptimize(result.surface.x.data());
  }
}
BENCHMARK(roomBoundary)->Apply(ringCounts);

}  // namespace
}  // namespace smoke_ground_reconstruction
