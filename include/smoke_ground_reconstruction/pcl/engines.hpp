#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "smoke_ground_reconstruction/neighbor_counter.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {

/// Neighbour counts with pcl::search::KdTree (thesis, Algorithm 1 line 15): the reference engine.
/// The tree proposes candidates a hair beyond the radius; squaredDistance() decides.
std::unique_ptr<NeighborCounter> makeKdTreeCounter(const Scan& scan);

/// Components with pcl::EuclideanClusterExtraction on pcl::search::KdTree (thesis, Section 3.3):
/// the reference engine. PCL compares distances in single precision; its search is therefore asked
/// a hair wider and its answers pass areLinked(), so that the partition is that of the grid engine.
std::vector<std::uint32_t> findComponentsWithPcl(const WallClusteringParams& params,
                                                 const Scan& scan,
                                                 const std::vector<std::uint32_t>& points);

/// Both, as Pipeline wants them.
Engines pclEngines();

}  // namespace smoke_ground_reconstruction
