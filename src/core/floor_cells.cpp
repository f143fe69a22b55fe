#include "smoke_ground_reconstruction/floor_cells.hpp"

#include <algorithm>
#include <array>

#include "cell_numbers.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr int kAcross = 1024;
constexpr double kLevelCell = 0.2;  // [m]
constexpr std::uint16_t kLevelPoints = 3, kFloorPoints = 2;
constexpr std::uint16_t kMostPoints = 60000;

/// Cells by their columns and rows from the middle of the grid.
SMOKE_GROUND_MULTIVERSION
void joinNumbers(const std::int32_t* columns, const std::int32_t* rows, std::size_t size,
                 std::uint32_t* cells) {
  constexpr std::uint32_t kWidth = kAcross;
  for (std::size_t i = 0; i < size; ++i) {
    const auto column = static_cast<std::uint32_t>(columns[i]) + kWidth / 2;
    const auto row = static_cast<std::uint32_t>(rows[i]) + kWidth / 2;
    const bool is_inside = (column < kWidth) & (row < kWidth);
    cells[i] = is_inside ? column * kWidth + row : CellGrid::kOutside;
  }
}

}  // namespace

std::uint32_t CellGrid::cellOf(double x, double y) const {
  const double u = x / size_;
  const double v = y / size_;
  constexpr double kHalf = kAcross / 2;
  if (!(u >= -kHalf && v >= -kHalf && u < kHalf && v < kHalf)) return kOutside;
  const int column = floorToInt(u) + kAcross / 2;
  const int row = floorToInt(v) + kAcross / 2;
  return static_cast<std::uint32_t>(column * kAcross + row);
}

void CellGrid::cellsOf(const float* x, const float* y, std::size_t size,
                       std::uint32_t* cells) const {
  constexpr std::size_t kBlock = 256;
  std::array<std::int32_t, kBlock> columns, rows;
  for (std::size_t begin = 0; begin < size; begin += kBlock) {
    const std::size_t count = std::min(kBlock, size - begin);
    cellNumbers(x + begin, count, size_, columns.data());
    cellNumbers(y + begin, count, size_, rows.data());
    joinNumbers(columns.data(), rows.data(), count, cells + begin);
  }
}

CellSet::CellSet() : grid_(1.0), bits_(CellGrid::kCells / 64 + 1, 0) {}

void CellSet::clear(double size) {
  grid_ = CellGrid(size);
  std::fill(bits_.begin(), bits_.end(), 0);
}

void CellSet::insert(const float* x, const float* y, std::size_t size) {
  cells_.resize(size);
  grid_.cellsOf(x, y, size, cells_.data());
  for (const std::uint32_t cell : cells_) bits_[cell / 64] |= std::uint64_t{1} << (cell % 64);
  bits_[CellGrid::kOutside / 64] = 0;
}

LevelCells::LevelCells() : grid_(kLevelCell), counts_(CellGrid::kCells, Counts()) {}

void LevelCells::clear(double level, double floor) {
  level_ = level;
  floor_ = floor;
  for (const std::uint32_t cell : touched_) counts_[cell] = Counts();
  touched_.clear();
}

void LevelCells::add(double x, double y, double height) {
  const std::uint32_t cell = grid_.cellOf(x, y);
  if (cell == CellGrid::kOutside) return;
  Counts& counts = counts_[cell];
  if (counts.all == 0) touched_.push_back(cell);
  if (counts.all >= kMostPoints) return;
  ++counts.all;
  count(height, level_, &counts.level);
  count(height, floor_, &counts.floor);
}

void LevelCells::count(double height, double half, Band* band) {
  if (height < half) ++band->below_top;
  if (height <= -half) ++band->below_bottom;
}

bool LevelCells::isLevel(double x, double y) const {
  const Counts* counts = find(x, y, kLevelPoints);
  return counts != nullptr && isMedianIn(counts->level, counts->all);
}

bool LevelCells::isLevelAround(double x, double y) const {
  return isMedianAround(x, y, kLevelPoints, &Counts::level);
}

bool LevelCells::isFloorAround(double x, double y) const {
  return isMedianAround(x, y, kFloorPoints, &Counts::floor);
}

/// Does the median of a cell with fewer returns than so many lie in a band, and that of it and the
/// cells around?
bool LevelCells::isMedianAround(double x, double y, std::uint16_t few, Band Counts::*of) const {
  const Counts* own = find(x, y, 1);
  if (own == nullptr || own->all >= few || !isMedianIn(own->*of, own->all)) return false;
  const auto at = static_cast<int>(own - counts_.data());
  BandOf<std::uint32_t> band;
  std::uint32_t all = 0;
  for (int column = std::max(at / kAcross - 1, 0);
       column <= std::min(at / kAcross + 1, kAcross - 1); ++column) {
    for (int row = std::max(at % kAcross - 1, 0); row <= std::min(at % kAcross + 1, kAcross - 1);
         ++row) {
      const Counts& counts = counts_[static_cast<std::size_t>(column * kAcross + row)];
      all += counts.all;
      band.below_top += (counts.*of).below_top;
      band.below_bottom += (counts.*of).below_bottom;
    }
  }
  return all >= kLevelPoints && isMedianIn(band, all);
}

bool LevelCells::isFloor(double x, double y) const {
  const Counts* counts = find(x, y, kFloorPoints);
  return counts != nullptr && isMedianIn(counts->floor, counts->all);
}

/// Null where a cell has too few returns.
const LevelCells::Counts* LevelCells::find(double x, double y, std::uint16_t least) const {
  const std::uint32_t cell = grid_.cellOf(x, y);
  if (cell == CellGrid::kOutside || counts_[cell].all < least) return nullptr;
  return &counts_[cell];
}

/// The median is the value at `all / 2` in ascending order.
template <typename Number>
bool LevelCells::isMedianIn(const BandOf<Number>& band, Number all) {
  return band.below_top > all / 2 && band.below_bottom <= all / 2;
}

}  // namespace smoke_ground_reconstruction
