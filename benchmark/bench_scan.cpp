#include "scene.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {
namespace {

/// From the driver's packed points to the scan.
void decode(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const Scan scan(scene.packedView());
    benchmark::DoNotOptimize(scan.valid.data());
  }
}
BENCHMARK(decode)->Apply(ringCounts);

/// Learning the beams of an unknown sensor.
void observe(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    SensorModel sensor;
    sensor.observe(scene.packedView());
    benchmark::DoNotOptimize(sensor.ringsByElevation().data());
  }
}
BENCHMARK(observe)->Apply(ringCounts);

/// The same scan once more: no ring shows more points than before.
void observeAgain(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  SensorModel sensor;
  for (auto _ : state) {
    sensor.observe(scene.packedView());
    benchmark::DoNotOptimize(sensor.ringsByElevation().data());
  }
}
BENCHMARK(observeAgain)->Apply(ringCounts);

/// The layout by azimuth and ring.
void columns(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  const Scan scan(scene.packedView());
  const AzimuthBins bins(0.4);
  const std::vector<std::uint8_t> use(scan.size(), 1);
  for (auto _ : state) {
    const ScanColumns laid_out(scan, use, bins, scene.sensor);
    benchmark::DoNotOptimize(laid_out.order.data());
  }
}
BENCHMARK(columns)->Apply(ringCounts);

/// The same without sorting, as the segmentation takes it.
void raster(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  const Scan scan(scene.packedView());
  const AzimuthBins bins(0.4);
  const std::vector<Label> labels(scan.size(), Label::kKept);
  for (auto _ : state) {
    const ScanRaster laid_out(scan, labels, bins);
    benchmark::DoNotOptimize(laid_out.place.data());
  }
}
BENCHMARK(raster)->Apply(ringCounts);

}  // namespace
}  // namespace smoke_ground_reconstruction
