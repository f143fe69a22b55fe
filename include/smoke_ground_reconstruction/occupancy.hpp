#pragma once

#include <vector>

#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

constexpr double kOccupancyRange = 50.0;  ///< planar reach of the pipeline's grid [m]

/// Occupancy of the cells around the sensor: floor where a surface point lies, wall where a wall
/// point lies (wall wins in a shared cell), else unknown. Cells are aligned to multiples of the
/// resolution in the level frame, so grids of successive scans match. Points beyond `max_range` of
/// the sensor are left out: one stray return must not allocate a hall.
/// \param walls  wall points in the sensor frame.
/// \param resolution  edge of a cell [m], at least 0.01.
/// \param max_range  planar, at most 10,000 cells [m].
/// \throws std::invalid_argument on a resolution or reach out of these limits.
OccupancyGrid rasterize(const FloorSurface& surface, const ScanView& walls,
                        const Mounting& mounting, double resolution,
                        double max_range = kOccupancyRange);

/// The same into a grid that may bring its memory.
void rasterize(const FloorSurface& surface, const ScanView& walls, const Mounting& mounting,
               double resolution, double max_range, OccupancyGrid* grid);

/// ... with the points of a scan that are labelled as walls.
/// \param labels  one per point.
void rasterize(const FloorSurface& surface, const ScanView& scan, const std::vector<Label>& labels,
               const Mounting& mounting, double resolution, double max_range, OccupancyGrid* grid);

}  // namespace smoke_ground_reconstruction
