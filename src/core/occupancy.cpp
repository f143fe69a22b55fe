#include "smoke_ground_reconstruction/occupancy.hpp"

#include <algorithm>
#include <array>
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

/// Points that are worked on together.
struct Block {
  static constexpr std::size_t kMost = 512;

  std::array<float, kMost> x, y, z;

  PointArrays arrays(std::size_t size) const { return {x.data(), y.data(), z.data(), size}; }
};

/// Some points of a scan.
class ScanPoints {
 public:
  /// \param which  tell the numbers in the scan of `size` points; null: all of them.
  ScanPoints(const ScanView& scan, const std::uint32_t* which, std::size_t size)
      : scan_(scan), which_(which), size_(size) {}

  std::size_t size() const { return size_; }
  PointArrays take(std::size_t begin, std::size_t count, Block* block) const {
    constexpr std::size_t kAhead = 40;  // points: as long as memory lets us wait
    const ScanView from = scan_;        // which nothing that is written can be part of
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = numberOf(begin + k);
      if (begin + k + kAhead < size_) fetch(from, numberOf(begin + k + kAhead));
      block->x[k] = from.x[i];
      block->y[k] = from.y[i];
      block->z[k] = from.z[i];
    }
    return block->arrays(count);
  }

 private:
  std::size_t numberOf(std::size_t k) const { return which_ == nullptr ? k : which_[k]; }
  /// Some of a scan lies too far from the last to be foreseen by the processor.
  static void fetch(const ScanView& scan, std::size_t i) {
    __builtin_prefetch(scan.x.data() + static_cast<std::ptrdiff_t>(i) * scan.x.stride());
  }

  ScanView scan_;
  const std::uint32_t* which_;
  std::size_t size_;
};

/// Those of a surface.
class SurfacePoints {
 public:
  explicit SurfacePoints(const FloorSurface& surface) : surface_(surface) {}

  std::size_t size() const { return surface_.size(); }
  PointArrays take(std::size_t begin, std::size_t count, Block* /*block*/) const {
    return {surface_.x.data() + begin, surface_.y.data() + begin, surface_.z.data() + begin, count};
  }

 private:
  const FloorSurface& surface_;
};

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
                     Block* memory) {
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

/// The columns or rows of points.
class Numbers {
 public:
  explicit Numbers(std::size_t most) : numbers_(most) {}

  /// Appends those of coordinates.
  void add(const float* values, std::size_t count, double resolution) {
    std::int32_t* const to = numbers_.data() + size_;
    cellNumbers(values, count, resolution, to);
    bounds_ = widened(bounds_, to, count);
    size_ += count;
  }
  const std::int32_t* data() const { return numbers_.data(); }
  std::size_t size() const { return size_; }
  const Bounds& bounds() const { return bounds_; }

 private:
  Recycled<std::int32_t> numbers_;
  std::size_t size_ = 0;
  Bounds bounds_;
};

/// Those of the returns within a planar range, in the level frame.
struct Cells {
  Numbers column, row;

  template <typename SomePoints>
  Cells(const SomePoints& points, const Mounting& mounting, double range, double resolution)
      : column(points.size()), row(points.size()) {
    Block taken, level;
    for (std::size_t begin = 0; begin < points.size(); begin += Block::kMost) {
      const std::size_t count = std::min(Block::kMost, points.size() - begin);
      const PointArrays places =
          levelled(points.take(begin, count, &taken), mounting, range, &level);
      column.add(places.x, places.size, resolution);
      row.add(places.y, places.size, resolution);
    }
  }
};

Bounds together(const Bounds& a, const Bounds& b) {
  return {std::min(a.lowest, b.lowest), std::max(a.highest, b.highest)};
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
  const Bounds columns = together(floor.column.bounds(), wall.column.bounds());
  const Bounds rows = together(floor.row.bounds(), wall.row.bounds());
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

void rasterizeAll(const FloorSurface& surface, const ScanPoints& walls, const Mounting& mounting,
                  double resolution, double max_range, OccupancyGrid* grid) {
  const Cells wall(walls, mounting, max_range, resolution);
  const Cells floor(SurfacePoints(surface), mounting, max_range, resolution);
  grid->resolution = resolution;
  grid->first_column = grid->first_row = 0;
  grid->width = grid->height = 0;
  grid->cells.clear();
  if (floor.column.size() + wall.column.size() == 0) return;
  draw(floor, wall, grid);
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
  rasterizeAll(surface, ScanPoints(walls, nullptr, walls.size), mounting, resolution, max_range,
               grid);
}

void rasterize(const FloorSurface& surface, const ScanView& scan, const std::vector<Label>& labels,
               const Mounting& mounting, double resolution, double max_range, OccupancyGrid* grid) {
  check(resolution, max_range);
  Recycled<std::uint32_t> walls;
  listWhere(reinterpret_cast<const std::uint8_t*>(labels.data()), scan.size, 0xFF,
            static_cast<std::uint8_t>(Label::kWall), &walls);
  rasterizeAll(surface, ScanPoints(scan, walls.data(), walls.size()), mounting, resolution,
               max_range, grid);
}

}  // namespace smoke_ground_reconstruction
