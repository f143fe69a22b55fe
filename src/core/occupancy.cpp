#include "smoke_ground_reconstruction/occupancy.hpp"

#include <algorithm>
#include <cmath>

#include "ordered.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kMostCells = 10000.0;  // from the sensor to the edge of the grid

struct Cell {
  std::int32_t column;
  std::int32_t row;
};
using Cells = Recycled<Cell>;

/// Cells of the points within reach, in the level frame.
template <typename Field>
void findCells(const Field& x, const Field& y, const Field& z, std::size_t size,
               const Mounting& mounting, double resolution, double max_range, Cells* cells) {
  cells->resize(size);
  std::size_t count = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::array<float, 3> p = {x[i], y[i], z[i]};
    if (!isReturn(p[0], p[1], p[2])) continue;
    const auto level = mounting.isLevel() ? p : mounting.toLevel(p[0], p[1], p[2]);
    if (planarRange(level[0], level[1]) > max_range) continue;
    (*cells)[count++] = {floorToInt(static_cast<double>(level[0]) / resolution),
                         floorToInt(static_cast<double>(level[1]) / resolution)};
  }
  cells->resize(count);
}

/// Corner and size of the grid that holds all cells; the corner starts out at the first of them.
void fit(const Cells& floor, const Cells& wall, OccupancyGrid* grid) {
  const Cell& first = floor.empty() ? wall.front() : floor.front();
  Cell low = first;
  Cell high = first;
  for (const auto* cells : {&floor, &wall}) {
    for (const Cell& cell : *cells) {
      low = {std::min(low.column, cell.column), std::min(low.row, cell.row)};
      high = {std::max(high.column, cell.column), std::max(high.row, cell.row)};
    }
  }
  grid->first_column = low.column;
  grid->first_row = low.row;
  grid->width = static_cast<std::size_t>(high.column - low.column + 1);
  grid->height = static_cast<std::size_t>(high.row - low.row + 1);
}

void paint(const Cells& cells, std::int8_t value, OccupancyGrid* grid) {
  for (const Cell& cell : cells) {
    const auto row = static_cast<std::size_t>(cell.row - grid->first_row);
    const auto column = static_cast<std::size_t>(cell.column - grid->first_column);
    grid->cells[row * grid->width + column] = value;
  }
}

}  // namespace

OccupancyGrid rasterize(const FloorSurface& surface, const ScanView& walls,
                        const Mounting& mounting, double resolution, double max_range) {
  OccupancyGrid grid;
  rasterize(surface, walls, mounting, resolution, max_range, &grid);
  return grid;
}

void rasterize(const FloorSurface& surface, const ScanView& walls, const Mounting& mounting,
               double resolution, double max_range, OccupancyGrid* grid) {
  require(resolution >= 0.01, "occupancy_resolution", ">= 0.01", resolution);
  require(max_range > 0.0 && max_range <= kMostCells * resolution, "max_range",
          "> 0 and at most 10000 cells", max_range);
  Cells floor, wall;
  findCells(surface.x, surface.y, surface.z, surface.size(), mounting, resolution, max_range,
            &floor);
  findCells(walls.x, walls.y, walls.z, walls.size, mounting, resolution, max_range, &wall);
  grid->resolution = resolution;
  grid->first_column = grid->first_row = 0;
  grid->width = grid->height = 0;
  grid->cells.clear();
  if (floor.empty() && wall.empty()) return;
  fit(floor, wall, grid);
  grid->cells.assign(grid->width * grid->height, OccupancyGrid::kUnknown);
  paint(floor, OccupancyGrid::kFloor, grid);
  paint(wall, OccupancyGrid::kWall, grid);
}

}  // namespace smoke_ground_reconstruction
