#include "smoke_ground_reconstruction/floor_cells.hpp"

#include <algorithm>
#include <cstring>

#include "cell_guess.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr auto kAcross = static_cast<int>(CellGrid::kAcross);
constexpr double kLevelCell = 0.2;  // [m]
constexpr std::uint16_t kLevelPoints = 3, kFloorPoints = 2;
constexpr std::uint16_t kMostPoints = 60000;

/// The cells of places, eight at a time.
SMOKE_GROUND_MULTIVERSION
void cellsOfEights(const CellGrid& grid, const float* x, const float* y, std::size_t eights,
                   std::uint32_t* cells) {
  const CellGuess guess(grid);
  for (std::size_t i = 0; i < eights * kLanes; i += kLanes) {
    const Ints eight = guess.ofEight(x + i, y + i);
    std::memcpy(cells + i, &eight, sizeof(eight));
  }
}

struct Ends {
  std::uint32_t lowest, highest;
};

SMOKE_GROUND_MULTIVERSION
Ends endsOf(const std::uint32_t* cells, std::size_t size) {
  std::uint32_t lowest = CellGrid::kOutside, highest = 0;
  for (std::size_t i = 0; i < size; ++i) {
    lowest = cells[i] < lowest ? cells[i] : lowest;
    highest = cells[i] > highest ? cells[i] : highest;
  }
  return {lowest, highest};
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
  const std::size_t eights = size / kLanes;
  cellsOfEights(*this, x, y, eights, cells);
  for (std::size_t i = eights * kLanes; i < size; ++i) cells[i] = cellOf(x[i], y[i]);
}

CellSet::CellSet() : grid_(1.0), is_in_(kAlways + 1, 0), lowest_(kAlways), highest_(0) {
  is_in_[kAlways] = 1;
}

void CellSet::clear(double size) {
  grid_ = CellGrid(size);
  if (lowest_ <= highest_) std::fill(is_in_.begin() + lowest_, is_in_.begin() + highest_ + 1, 0);
  lowest_ = kAlways;
  highest_ = 0;
}

void CellSet::insert(const float* x, const float* y, std::size_t size) {
  cells_.resize(size);
  grid_.cellsOf(x, y, size, cells_.data());
  for (const std::uint32_t cell : cells_) is_in_[cell] = 1;
  is_in_[CellGrid::kOutside] = 0;
  const Ends ends = endsOf(cells_.data(), size);
  lowest_ = std::min(lowest_, ends.lowest);
  highest_ = std::max(highest_, std::min<std::uint32_t>(ends.highest, CellGrid::kOutside - 1));
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
