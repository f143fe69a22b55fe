#include "smoke_ground_reconstruction/occupancy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cell_numbers.hpp"
#include "multiversion.hpp"
#include "point_loops.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kMostCells = 10000.0;  // from the sensor to the edge of the grid

/// Memory for points.
struct Memory {
  Recycled<float> x, y, z;

  explicit Memory(std::size_t most) : x(most), y(most), z(most) {}
  PointArrays arrays(std::size_t size) const { return {x.data(), y.data(), z.data(), size}; }
};

/// Some points of a scan.
/// \param which  tells the number in the scan of the first, second... of them.
template <typename Which>
PointArrays gather(const ScanView& scan, std::size_t size, const Which& which, Memory* memory) {
  float *const x = memory->x.data(), *const y = memory->y.data(), *const z = memory->z.data();
  const ScanView from = scan;  // which nothing that is written can be part of
  for (std::size_t k = 0; k < size; ++k) {
    const std::size_t i = which(k);
    x[k] = from.x[i];
    y[k] = from.y[i];
    z[k] = from.z[i];
  }
  return memory->arrays(size);
}

/// Are all of them returns that lie nearer than a range?
SMOKE_GROUND_MULTIVERSION
bool areAllNear(const PointArrays& points, float range) {
  const PointArrays at = points;
  const float farthest = range * range;
  int are_near = 1;
  for (std::size_t i = 0; i < at.size; ++i) {
    const float square = (at.x[i] * at.x[i] + at.y[i] * at.y[i]) + at.z[i] * at.z[i];
    are_near &= (isReturn(at.x[i], at.y[i], at.z[i]) ? 1 : 0) & (square < farthest ? 1 : 0);
  }
  return are_near != 0;
}

/// The returns within a planar range, in the level frame.
PointArrays levelled(const PointArrays& points, const Mounting& mounting, double range,
                     Memory* memory) {
  constexpr double kClear = 0.999;  // of the range: what is nearer is surely within it
  float *const x = memory->x.data(), *const y = memory->y.data(), *const z = memory->z.data();
  if (areAllNear(points, static_cast<float>(kClear * range))) {
    if (mounting.isLevel()) return points;
    turnPoints(points, mounting.rotation, x, y, z);
    return memory->arrays(points.size);
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (!isReturn(points.x[i], points.y[i], points.z[i])) continue;
    const auto level = mounting.toLevel(points.x[i], points.y[i], points.z[i]);
    if (planarRange(level[0], level[1]) > range) continue;
    x[count] = level[0];
    y[count] = level[1];
    ++count;
  }
  return memory->arrays(count);
}

/// Columns or rows of cells.
using Numbers = Recycled<std::int32_t>;

struct Cells {
  Numbers column, row;

  Cells(const PointArrays& places, double resolution) : column(places.size), row(places.size) {
    cellNumbers(places.x, places.size, resolution, column.data());
    cellNumbers(places.y, places.size, resolution, row.data());
  }
};

struct Bounds {
  std::int32_t lowest = std::numeric_limits<std::int32_t>::max();
  std::int32_t highest = std::numeric_limits<std::int32_t>::lowest();

  std::size_t size() const { return static_cast<std::size_t>(highest - lowest + 1); }
};

SMOKE_GROUND_MULTIVERSION
Bounds widened(Bounds bounds, const std::int32_t* numbers, std::size_t size) {
  std::int32_t lowest = bounds.lowest, highest = bounds.highest;
  for (std::size_t i = 0; i < size; ++i) {
    lowest = numbers[i] < lowest ? numbers[i] : lowest;
    highest = numbers[i] > highest ? numbers[i] : highest;
  }
  return {lowest, highest};
}

Bounds boundsOf(const Numbers& floor, const Numbers& wall) {
  return widened(widened(Bounds(), floor.data(), floor.size()), wall.data(), wall.size());
}

void paint(const Cells& cells, std::int8_t value, OccupancyGrid* grid) {
  const auto width = static_cast<std::int64_t>(grid->width);
  const std::int32_t *const column = cells.column.data(), *const row = cells.row.data();
  std::int8_t* const cell = grid->cells.data();
  const std::int64_t corner = grid->first_row * width + grid->first_column;
  for (std::size_t i = 0, n = cells.column.size(); i < n; ++i) {
    cell[row[i] * width + column[i] - corner] = value;
  }
}

/// The grid that holds all cells; where floor and wall share one, it is a wall's.
void draw(const Cells& floor, const Cells& wall, OccupancyGrid* grid) {
  const Bounds columns = boundsOf(floor.column, wall.column);
  const Bounds rows = boundsOf(floor.row, wall.row);
  grid->first_column = columns.lowest;
  grid->first_row = rows.lowest;
  grid->width = columns.size();
  grid->height = rows.size();
  grid->cells.assign(grid->width * grid->height, OccupancyGrid::kUnknown);
  paint(floor, OccupancyGrid::kFloor, grid);
  paint(wall, OccupancyGrid::kWall, grid);
}

/// Throws on numbers that no grid has.
void check(double resolution, double max_range) {
  require(resolution >= 0.01, "occupancy_resolution", ">= 0.01", resolution);
  require(max_range > 0.0 && max_range <= kMostCells * resolution, "max_range",
          "> 0 and at most 10000 cells", max_range);
}

/// \param walls  in the sensor frame.
void rasterizeAll(const FloorSurface& surface, const PointArrays& walls, const Mounting& mounting,
                  double resolution, double max_range, OccupancyGrid* grid) {
  Memory level_walls(walls.size), level_floor(surface.size());
  const PointArrays wall = levelled(walls, mounting, max_range, &level_walls);
  const PointArrays floor =
      levelled({surface.x.data(), surface.y.data(), surface.z.data(), surface.size()}, mounting,
               max_range, &level_floor);
  grid->resolution = resolution;
  grid->first_column = grid->first_row = 0;
  grid->width = grid->height = 0;
  grid->cells.clear();
  if (floor.size + wall.size == 0) return;
  draw(Cells(floor, resolution), Cells(wall, resolution), grid);
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
  check(resolution, max_range);
  Memory memory(walls.size);
  const auto all = [](std::size_t k) { return k; };
  rasterizeAll(surface, gather(walls, walls.size, all, &memory), mounting, resolution, max_range,
               grid);
}

void rasterize(const FloorSurface& surface, const ScanView& scan, const std::vector<Label>& labels,
               const Mounting& mounting, double resolution, double max_range, OccupancyGrid* grid) {
  check(resolution, max_range);
  Recycled<std::uint32_t> walls;
  listWhere(reinterpret_cast<const std::uint8_t*>(labels.data()), scan.size, 0xFF,
            static_cast<std::uint8_t>(Label::kWall), &walls);
  Memory memory(walls.size());
  const auto wall = [first = walls.data()](std::size_t k) { return first[k]; };
  rasterizeAll(surface, gather(scan, walls.size(), wall, &memory), mounting, resolution, max_range,
               grid);
}

}  // namespace smoke_ground_reconstruction
