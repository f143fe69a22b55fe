#pragma once

#include <vector>

#include "pair_tests.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// Labels the points of columns by Algorithm 4, however many a ring has in one.
/// \param labels  one per point of the scan.
void labelColumns(const Scan& scan, const ScanColumns& columns, const PairTests& tests,
                  LabelPoint label_point, std::vector<Label>* labels);

}  // namespace smoke_ground_reconstruction
