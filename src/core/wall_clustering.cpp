#include "smoke_ground_reconstruction/wall_clustering.hpp"

#include <algorithm>
#include <utility>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// No branches: returns of walls and others lie mixed.
Recycled<std::uint32_t> wallPoints(const Scan& scan, const std::vector<Label>& labels) {
  Recycled<std::uint32_t> walls(labels.size() + 1);
  std::uint32_t* next = walls.data();
  for (std::uint32_t i = 0, size = static_cast<std::uint32_t>(labels.size()); i < size; ++i) {
    *next = i;
    next += (labels[i] == Label::kWall) & (scan.valid[i] != 0) ? 1 : 0;
  }
  walls.resize(static_cast<std::size_t>(next - walls.data()));
  return walls;
}

}  // namespace

void WallClusteringParams::validate() const {
  require(cluster_tolerance > 0.0, "cluster_tolerance", "> 0", cluster_tolerance);
  require(cluster_tolerance_per_range >= 0.0, "cluster_tolerance_per_range", ">= 0",
          cluster_tolerance_per_range);
  require(min_cluster_size >= 1, "min_cluster_size", ">= 1", min_cluster_size);
  require(max_cluster_size == 0 || max_cluster_size >= min_cluster_size, "max_cluster_size",
          "0 (unlimited) or at least min_cluster_size", max_cluster_size);
}

bool areLinked(const WallClusteringParams& params, const std::array<float, 3>& a,
               const std::array<float, 3>& b) {
  double tolerance = params.cluster_tolerance;
  if (params.cluster_tolerance_per_range > 0.0) {
    const double nearer = std::min(range(a[0], a[1], a[2]), range(b[0], b[1], b[2]));
    tolerance += params.cluster_tolerance_per_range * nearer;
  }
  return squaredDistance(a[0], a[1], a[2], b[0], b[1], b[2]) < tolerance * tolerance;
}

WallClustering::WallClustering(const WallClusteringParams& params, ComponentFinder kdtree)
    : params_(params), find_components_(std::move(kdtree)) {
  params_.validate();
  if (params_.cluster_engine == ClusterEngine::kGrid) find_components_ = findComponentsOnGrid;
  require(static_cast<bool>(find_components_), "cluster_engine", "grid in a build without PCL",
          "kdtree");
}

std::vector<std::uint32_t> WallClustering::cluster(const Scan& scan,
                                                   const std::vector<Label>& labels) const {
  std::vector<std::uint32_t> clusters(scan.size(), kNoCluster);
  const auto points = wallPoints(scan, labels);
  if (points.empty()) return clusters;
  const auto component = find_components_(params_, scan, points);

  const std::size_t component_count = *std::max_element(component.begin(), component.end()) + 1U;
  Recycled<std::size_t> size;
  size.assign(component_count, 0);
  for (const std::uint32_t c : component) ++size[c];
  const auto least = static_cast<std::size_t>(params_.min_cluster_size);
  const auto most = params_.max_cluster_size == 0
                        ? scan.size()
                        : static_cast<std::size_t>(params_.max_cluster_size);
  Recycled<std::uint32_t> number;
  number.assign(component_count, kNoCluster);
  std::uint32_t next = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {  // ascending indices: numbers by smallest index
    const std::uint32_t c = component[k];
    if (size[c] < least || size[c] > most) continue;
    if (number[c] == kNoCluster) number[c] = next++;
    clusters[points[k]] = number[c];
  }
  return clusters;
}

}  // namespace smoke_ground_reconstruction
