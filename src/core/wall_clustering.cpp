#include "smoke_ground_reconstruction/wall_clustering.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t find(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Cubic cells as wide as the longest link: linked points lie in the same cell or in adjacent ones.
class CellMap {
 public:
  CellMap(const Scan& scan, const std::vector<std::uint32_t>& points, double edge)
      : scan_(scan), edge_(edge) {
    for (std::uint32_t k = 0; k < points.size(); ++k)
      cells_[keyOf(points[k], 0, 0, 0)].push_back(k);
  }

  /// Entries of `points` in the cell (dx, dy, dz) cells away from a point's own.
  const std::vector<std::uint32_t>* find(std::uint32_t point, int dx, int dy, int dz) const {
    const auto cell = cells_.find(keyOf(point, dx, dy, dz));
    return cell == cells_.end() ? nullptr : &cell->second;
  }

 private:
  // 21 bits an axis; what lies beyond 2^20 cells shares the outermost.
  std::uint64_t keyOf(std::uint32_t point, int dx, int dy, int dz) const {
    return (axisKey(scan_.x[point], dx) << 42U) | (axisKey(scan_.y[point], dy) << 21U) |
           axisKey(scan_.z[point], dz);
  }
  std::uint64_t axisKey(float coordinate, int offset) const {
    constexpr double kHalf = 1 << 20;
    const double cell = std::floor(static_cast<double>(coordinate) / edge_);
    const double shifted = std::clamp(cell, 1.0 - kHalf, kHalf - 2.0) + kHalf + offset;
    return static_cast<std::uint64_t>(shifted);
  }

  const Scan& scan_;
  double edge_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

double longestLink(const WallClusteringParams& params, const Scan& scan,
                   const std::vector<std::uint32_t>& points) {
  double farthest = 0.0;
  for (const std::uint32_t i : points) {
    farthest = std::max(farthest, range(scan.x[i], scan.y[i], scan.z[i]));
  }
  // A hair wider than any tolerance, against the rounding of the division by it.
  return (params.cluster_tolerance + params.cluster_tolerance_per_range * farthest) * (1.0 + 1e-9);
}

std::vector<std::uint32_t> wallPoints(const Scan& scan, const std::vector<Label>& labels) {
  std::vector<std::uint32_t> walls;
  for (std::uint32_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == Label::kWall && scan.valid[i] != 0) walls.push_back(i);
  }
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

std::vector<std::uint32_t> findComponentsOnGrid(const WallClusteringParams& params,
                                                const Scan& scan,
                                                const std::vector<std::uint32_t>& points) {
  const CellMap cells(scan, points, longestLink(params, scan, points));
  DisjointSets sets(points.size());
  const auto join_with_cell = [&](std::uint32_t k, const std::vector<std::uint32_t>& cell) {
    for (const std::uint32_t other : cell) {
      if (other <= k || sets.find(other) == sets.find(k)) continue;
      if (areLinked(params, scan.point(points[k]), scan.point(points[other]))) sets.join(other, k);
    }
  };
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    for (int neighbor = 0; neighbor < 27; ++neighbor) {
      const auto* cell =
          cells.find(points[k], neighbor / 9 - 1, neighbor / 3 % 3 - 1, neighbor % 3 - 1);
      if (cell != nullptr) join_with_cell(k, *cell);
    }
  }
  std::vector<std::uint32_t> component(points.size());
  for (std::uint32_t k = 0; k < points.size(); ++k) component[k] = sets.find(k);
  return component;
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
  std::vector<std::size_t> size(component_count, 0);
  for (const std::uint32_t c : component) ++size[c];
  const auto least = static_cast<std::size_t>(params_.min_cluster_size);
  const auto most = params_.max_cluster_size == 0
                        ? scan.size()
                        : static_cast<std::size_t>(params_.max_cluster_size);
  std::vector<std::uint32_t> number(component_count, kNoCluster);
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
