#include "smoke_ground_reconstruction/occupancy.hpp"

#include <algorithm>
#include <cmath>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kMostCells = 10000.0;  // from the sensor to the edge of the grid

struct Cell {
  std::int64_t column;
  std::int64_t row;
};

/// Cells of the points within reach, in the level frame.
template <typename PointAt>
std::vector<Cell> cellsOf(std::size_t size, const PointAt& point_at, const Mounting& mounting,
                          double resolution, double max_range) {
  std::vector<Cell> cells;
  cells.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::array<float, 3> p = point_at(i);
    if (!isReturn(p[0], p[1], p[2])) continue;
    const auto level = mounting.toLevel(p[0], p[1], p[2]);
    if (planarRange(level[0], level[1]) > max_range) continue;
    cells.push_back(
        {static_cast<std::int64_t>(std::floor(static_cast<double>(level[0]) / resolution)),
         static_cast<std::int64_t>(std::floor(static_cast<double>(level[1]) / resolution))});
  }
  return cells;
}

/// Corner and size of the grid that holds all cells; the corner starts out at the first of them.
void fit(const std::vector<Cell>& floor, const std::vector<Cell>& wall, OccupancyGrid* grid) {
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

void paint(const std::vector<Cell>& cells, std::int8_t value, OccupancyGrid* grid) {
  for (const Cell& cell : cells) {
    const auto row = static_cast<std::size_t>(cell.row - grid->first_row);
    const auto column = static_cast<std::size_t>(cell.column - grid->first_column);
    grid->cells[row * grid->width + column] = value;
  }
}

}  // namespace

OccupancyGrid rasterize(const FloorSurface& surface, const ScanView& walls,
                        const Mounting& mounting, double resolution, double max_range) {
  require(resolution >= 0.01, "occupancy_resolution", ">= 0.01", resolution);
  require(max_range > 0.0 && max_range <= kMostCells * resolution, "max_range",
          "> 0 and at most 10000 cells", max_range);
  const auto floor = cellsOf(
      surface.size(),
      [&](std::size_t i) {
        return std::array<float, 3>{surface.x[i], surface.y[i], surface.z[i]};
      },
      mounting, resolution, max_range);
  const auto wall = cellsOf(
      walls.size,
      [&](std::size_t i) {
        return std::array<float, 3>{walls.x[i], walls.y[i], walls.z[i]};
      },
      mounting, resolution, max_range);
  OccupancyGrid grid;
  grid.resolution = resolution;
  if (floor.empty() && wall.empty()) return grid;
  fit(floor, wall, &grid);
  grid.cells.assign(grid.width * grid.height, OccupancyGrid::kUnknown);
  paint(floor, OccupancyGrid::kFloor, &grid);
  paint(wall, OccupancyGrid::kWall, &grid);
  return grid;
}

}  // namespace smoke_ground_reconstruction
