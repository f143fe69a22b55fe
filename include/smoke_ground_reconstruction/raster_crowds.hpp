#pragma once

#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/neighbor_counter.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {

/// May the raster of a scan, that many columns wide, tell who is in no crowd? Not where crowds are
/// large or limited, or reach far.
bool mayFindOutsiders(const Crowd& crowd, std::size_t columns);

/// Finds the points of a scan that are in no crowd, on their raster: neighbours within a few
/// azimuth steps lie a few rows and columns away. Eight points beside each other are compared at
/// once with those a step further in their row, then in rows of near elevations, until all eight
/// have found enough. Single precision judges by a radius a hair smaller and one a hair larger;
/// squaredDistance() is asked where the two disagree. Exact: which rows are near is measured on
/// their points, not taken from the sensor.
/// \param raster  of all valid points, not crowded, mayFindOutsiders().
/// \param is_outside  one flag per point: valid, and in no crowd.
/// \return false: points are too near, or rows too steep or too wide, and nothing was found out.
bool findOutsiders(const Scan& scan, const ScanRaster& raster, const Crowd& crowd,
                   std::vector<std::uint8_t>* is_outside);

}  // namespace smoke_ground_reconstruction
