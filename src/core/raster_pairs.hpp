#pragma once

#include <vector>

#include "pair_tests.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {

/// Labels the points of a raster that is not crowded by Algorithm 4: row against row, in the order
/// of the rings' elevations. Rings without rank take no part. \param labels  one per point of the
/// scan.
void labelRaster(const Scan& scan, const ScanRaster& raster, const SensorModel& sensor,
                 const PairTests& tests, LabelPoint label_point, std::vector<Label>* labels);

}  // namespace smoke_ground_reconstruction
