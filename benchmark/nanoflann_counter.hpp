#pragma once

#include <memory>

#include "smoke_ground_reconstruction/neighbor_counter.hpp"

namespace smoke_ground_reconstruction {

/// Counts with nanoflann's KD-tree and stops at the limit: the fastest tree there is to compare
/// with. Single precision alone, so its counts may differ by a point at the very radius.
std::unique_ptr<NeighborCounter> makeNanoflannCounter(const Scan& scan);

}  // namespace smoke_ground_reconstruction
