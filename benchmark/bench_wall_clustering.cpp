#include "scene.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"
#ifdef SMOKE_GROUND_HAVE_PCL
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#endif

namespace smoke_ground_reconstruction {
namespace {

/// The room's wall points alone, at a tolerance of range(1) centimetres.
void cluster(benchmark::State& state, ClusterEngine engine, const ComponentFinder& kdtree) {
  const Cloud walls = pointsOf(sceneOf(static_cast<int>(state.range(0))), Label::kWall);
  const Scan scan(walls.view());
  WallClusteringParams params;
  params.cluster_tolerance = 0.01 * static_cast<double>(state.range(1));
  params.cluster_engine = engine;
  const WallClustering clustering(params, kdtree);
  const std::vector<Label> labels(scan.size(), Label::kWall);
  for (auto _ : state) benchmark::DoNotOptimize(clustering.cluster(scan, labels));
  state.counters["points"] = static_cast<double>(scan.size());
}

void ringsAndTolerances(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"rings", "cm"})->Unit(benchmark::kMillisecond);
  bench->ArgsProduct({{16, 32, 64, 128}, {5, 20}});
}

void clusterGrid(benchmark::State& state) { cluster(state, ClusterEngine::kGrid, nullptr); }
BENCHMARK(clusterGrid)->Apply(ringsAndTolerances);

#ifdef SMOKE_GROUND_HAVE_PCL
void clusterKdTree(benchmark::State& state) {
  cluster(state, ClusterEngine::kKdTree, findComponentsWithPcl);
}
BENCHMARK(clusterKdTree)->Apply(ringsAndTolerances);
#endif

}  // namespace
}  // namespace smoke_ground_reconstruction
