#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

enum class ClusterEngine { kKdTree, kGrid };

/// Parameters of the clustering; names, units and defaults as in cfg/Segmenter.cfg.
struct WallClusteringParams {
  double cluster_tolerance = 0.05;           ///< largest gap inside a cluster [m]
  double cluster_tolerance_per_range = 0.0;  ///< added to it per metre of range of the nearer point
  int min_cluster_size = 50;                 ///< smaller clusters are dropped [points]
  int max_cluster_size = 5000;               ///< larger clusters are dropped [points]; 0: unlimited
  ClusterEngine cluster_engine = ClusterEngine::kKdTree;

  /// \throws std::invalid_argument naming the parameter, its value and what it may be.
  void validate() const;
};

/// Are two points neighbours? squaredDistance < T^2 with
/// T = cluster_tolerance + cluster_tolerance_per_range * min(range a, range b).
bool areLinked(const WallClusteringParams& params, const std::array<float, 3>& a,
               const std::array<float, 3>& b);

/// Connected components of the linked points: for each entry of `points` the number of its
/// component, numbers in any order. Components are not yet judged by size.
using ComponentFinder = std::function<std::vector<std::uint32_t>(
    const WallClusteringParams&, const Scan&, const std::vector<std::uint32_t>& points)>;

/// Components by a hash of cubic cells: exact, and of cost about linear in the points.
std::vector<std::uint32_t> findComponentsOnGrid(const WallClusteringParams& params,
                                                const Scan& scan,
                                                const std::vector<std::uint32_t>& points);

/// Euclidean clustering of wall points. Thesis: Section 3.3 "Clustering", Table A.1.
/// Reading: the tolerance is printed as "dynamic" alone; see WallClusteringParams.
class WallClustering {
 public:
  /// \param kdtree  the KD-tree engine (pcl/engines.hpp); needed for engine kKdTree alone.
  /// \throws std::invalid_argument on bad parameters, or on engine kKdTree without one.
  explicit WallClustering(const WallClusteringParams& params, ComponentFinder kdtree = nullptr);

  /// One number per point of the scan: its cluster, or kNoCluster where the point is no wall or its
  /// cluster is too small or too large. Clusters count from 0 by their smallest point index.
  std::vector<std::uint32_t> cluster(const Scan& scan, const std::vector<Label>& labels) const;

 private:
  WallClusteringParams params_;
  ComponentFinder find_components_;
};

}  // namespace smoke_ground_reconstruction
