#include "scene.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"
#ifdef SMOKE_GROUND_HAVE_PCL
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#endif

namespace smoke_ground_reconstruction {
namespace {

void process(benchmark::State& state, const PipelineParams& params, const Engines& engines) {
  const Scene& scene = sceneOf(static_cast<int>(state.range(0)));
  Pipeline pipeline(params, engines);
  for (auto _ : state) benchmark::DoNotOptimize(pipeline.process(scene.packedView()));
}

/// The stages of the thesis.
PipelineParams unlimitedClusters() {
  PipelineParams params;
  params.reconstructor.method = ReconstructionMethod::kPolarSegments;
  params.segmenter.clustering.max_cluster_size = 0;
  return params;
}

/// All stages but clustering: every wall point goes into one cluster unseen.
void processWithoutClustering(benchmark::State& state) {
  Engines engines;
  engines.kdtree_clustering = [](const WallClusteringParams&, const Scan&,
                                 const std::vector<std::uint32_t>& points) {
    return std::vector<std::uint32_t>(points.size(), 0);
  };
  process(state, unlimitedClusters(), engines);
}
BENCHMARK(processWithoutClustering)->Apply(ringCounts);

void processWithGridClustering(benchmark::State& state) {
  PipelineParams params = unlimitedClusters();
  params.segmenter.clustering.cluster_engine = ClusterEngine::kGrid;
  process(state, params, Engines());
}
BENCHMARK(processWithGridClustering)->Apply(ringCounts);

#ifdef SMOKE_GROUND_HAVE_PCL
/// Both KD-tree engines of PCL.
void processWithKdTrees(benchmark::State& state) {
  PipelineParams params = unlimitedClusters();
  params.denoiser.engine = DenoiserEngine::kKdTree;
  process(state, params, pclEngines());
}
BENCHMARK(processWithKdTrees)->Apply(ringCounts);
#endif

}  // namespace
}  // namespace smoke_ground_reconstruction
