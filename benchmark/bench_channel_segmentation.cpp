#include "scene.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"

namespace smoke_ground_reconstruction {
namespace {

void segment(benchmark::State& state) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  const Scan scan(scene.packedView());
  std::vector<Label> labels(scan.size(), Label::kKept);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scene.labels[i] == Label::kNoise) labels[i] = Label::kNoise;
  }
  const ChannelSegmentation segmentation{ChannelSegmentationParams()};
  for (auto _ : state) {
    benchmark::DoNotOptimize(segmentation.classify(scan, labels, scene.sensor));
  }
}
BENCHMARK(segment)->Apply(ringCounts);

}  // namespace
}  // namespace smoke_ground_reconstruction
