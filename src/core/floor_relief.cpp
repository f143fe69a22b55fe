#include "smoke_ground_reconstruction/floor_relief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "cell_numbers.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"
#include "point_loops.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr int kSide = ReliefGrid::kSide;
constexpr double kNearest = 0.5;      // planar range [m]
constexpr std::uint32_t kPoints = 4;  // of a cell
constexpr std::uint32_t kMany = 16;   // or more are looked over before they are ranked
constexpr double kSpread = 0.04;      // between 10th and 90th percentile of a cell's heights [m]
constexpr double kOnPlane = FloorRelief::kOnPlane;
constexpr double kSlack = 0.015;  // of the rise between neighbouring cells [m]
constexpr double kNear = 0.45;    // returns on floor drawn on lie so near to measured floor [m]
constexpr int kHop = 2;           // cells without returns between two rings
constexpr std::size_t kPlatformCells = 25;
constexpr std::size_t kFewestCells = 6;  // fewer make no facet: clutter
constexpr double kUnseenSlope = 0.35;    // of the steepest slope seen may be missed per metre
constexpr double kUnseenHeight = 0.1;    // ... or of the greatest height

/// Are heights so scattered, as those of walls are, that their percentiles cannot lie within
/// kSpread of each other? Those between them would lie in two slots side by side.
bool isScattered(const float* height, std::uint32_t count) {
  constexpr double kPerMetre = 0.8 / kSpread;
  constexpr std::size_t kSlots = 20;
  std::array<std::uint32_t, kSlots + 1> counts{};
  for (std::uint32_t i = 0; i < count; ++i) {
    ++counts[static_cast<std::size_t>((height[i] - ReliefGrid::kLowest) * kPerMetre)];
  }
  const std::uint32_t between = (9 * count) / 10 - count / 10 + 1;
  std::uint32_t most = 0;
  for (std::size_t s = 0; s < kSlots; ++s) most = std::max(most, counts[s] + counts[s + 1]);
  return most < between;
}

/// Column or row of a coordinate.
int indexOf(double coordinate) { return floorToInt(coordinate / ReliefGrid::kCell) + kSide / 2; }

/// Sigma where the nearest measured floor lies away by the root of so many cells.
SMOKE_GROUND_PART double sigmaOf(std::int32_t square, double per_metre) {
  const double away = ReliefGrid::kCell * std::sqrt(static_cast<double>(square));
  const double past = away - ReliefGrid::kCell;
  return per_metre * (past > 0.0 ? past : 0.0);
}

SMOKE_GROUND_MULTIVERSION
void sigmasOf(const std::int32_t* square, std::size_t size, double per_metre, float* sigma) {
  for (std::size_t i = 0; i < size; ++i) {
    sigma[i] = static_cast<float>(sigmaOf(square[i], per_metre));
  }
}

/// Some returns side by side.
struct Block {
  static constexpr std::size_t kMost = 256;
  std::array<float, kMost> x, y, height, planar;
  std::array<std::int32_t, kMost> column, row;
  std::array<std::uint8_t, kMost> marks;  // that each leaves in its cell
};

/// Marks of cells: they have returns, and some off the plane.
constexpr std::uint8_t kUsed = 1, kOff = 2;

void gather(const UprightReturns& returns, const std::uint32_t* which, std::size_t count,
            Block* block) {
  const float *const x = returns.points->x.data(), *const y = returns.points->y.data();
  const float *const height = returns.height.data(), *const planar = returns.planar.data();
  for (std::size_t i = 0; i < count; ++i) {
    block->x[i] = x[which[i]];
    block->y[i] = y[which[i]];
    block->height[i] = height[which[i]];
    block->planar[i] = planar[which[i]];
  }
}

/// Cells by their columns and rows, ReliefGrid::kCells where a return lies too high, too low, too
/// near or too far; and what each leaves there.
SMOKE_GROUND_MULTIVERSION
void joinNumbers(std::size_t count, Block* of, std::uint16_t* cell) {
  constexpr auto kFarthest = static_cast<float>(ReliefGrid::kReach);
  constexpr auto kNone = static_cast<int>(ReliefGrid::kCells);
  Block& block = *of;
  for (std::size_t i = 0; i < count; ++i) {
    const float height = block.height[i];
    const bool is_in = (height > ReliefGrid::kLowest) & (height < ReliefGrid::kHighest) &
                       (block.planar[i] > kNearest) & (std::fabs(block.x[i]) < kFarthest) &
                       (std::fabs(block.y[i]) < kFarthest);
    const int at = (block.row[i] + kSide / 2) * kSide + (block.column[i] + kSide / 2);
    cell[i] = static_cast<std::uint16_t>(is_in ? at : kNone);
    block.marks[i] = std::fabs(height) < kOnPlane ? kUsed : kUsed | kOff;
  }
}

void findCells(Block* block, std::size_t count, std::uint16_t* cell) {
  cellNumbers(block->x.data(), count, ReliefGrid::kCell, block->column.data());
  cellNumbers(block->y.data(), count, ReliefGrid::kCell, block->row.data());
  joinNumbers(count, block, cell);
}

}  // namespace

void ReliefGrid::fill(const UprightReturns& returns, const std::vector<std::uint32_t>& which) {
  returns_ = &returns;
  which_ = &which;
  take();
  off.resize(cell_of_.size());
  std::size_t some = 0;
  for (std::uint32_t i = 0; i < cell_of_.size(); ++i) {
    off[some] = i;
    some += (marks_[cell_of_[i]] & kOff) != 0 ? 1U : 0U;
  }
  off.resize(some);
  rank();
}

/// The cells of the returns, how many each has, and which have some off the plane.
void ReliefGrid::take() {
  const std::size_t size = which_->size();
  cell_of_.resize(size);
  count.assign(kCells + 1, 0);
  marks_.assign(kCells + 1, 0);
  Block block;
  for (std::size_t begin = 0; begin < size; begin += Block::kMost) {
    const std::size_t some = std::min(Block::kMost, size - begin);
    std::uint16_t* const cell = cell_of_.data() + begin;
    gather(*returns_, which_->data() + begin, some, &block);
    findCells(&block, some, cell);
    for (std::size_t i = 0; i < some; ++i) {
      ++count[cell[i]];
      marks_[cell[i]] |= block.marks[i];
    }
  }
  marks_[kCells] = 0;
  listWhere(marks_, kUsed, kUsed, &used);
  listWhere(marks_, kOff, kOff, &off_cells_);
}

/// What the heights of each cell say. No need to rank what lies on the plane altogether.
void ReliefGrid::rank() {
  cells.resize(kCells);
  for (const std::uint32_t c : used) cells[c] = {count[c] >= kPoints, 0.0F, 0.0F, 0.0F};
  begin_.resize(kCells);
  std::uint32_t ranked = 0;
  for (const std::uint32_t c : off_cells_) {
    begin_[c] = ranked;
    ranked += count[c];
  }
  heights_.resize(ranked);
  const float* const height = returns_->height.data();
  for (const std::uint32_t i : off) heights_[begin_[cell_of_[i]]++] = height[(*which_)[i]];
  float* first = heights_.data();
  for (const std::uint32_t c : off_cells_) {
    rank(first, count[c], &cells[c]);
    first += count[c];
  }
}

/// Their extent, and their median if they agree on one height.
void ReliefGrid::rank(float* first, std::uint32_t count, Cell* cell) {
  const auto ends = std::minmax_element(first, first + count);
  cell->bottom = *ends.first;
  cell->top = *ends.second;
  cell->is_even = false;
  if (count < kPoints || (count >= kMany && isScattered(first, count))) return;
  float* low = first + count / 10;
  float* middle = first + count / 2;
  float* high = first + (9 * count) / 10;
  std::nth_element(first, high, first + count);
  if (low != high) std::nth_element(first, low, high);
  cell->is_even = static_cast<double>(*high) - static_cast<double>(*low) < kSpread;
  if (!cell->is_even) return;
  if (middle != low && middle != high) std::nth_element(low + 1, middle, high);
  cell->median = *middle;
}

void ReliefGrid::findMeans() {
  means.assign(kCells + 1, Mean());
  for (std::size_t i = 0; i < size(); ++i) {
    const Return one = at(i);
    Mean& mean = means[one.cell];
    mean.x += one.x;
    mean.y += one.y;
    mean.height += one.height;
  }
  for (const std::uint32_t c : used) {
    means[c].x /= count[c];
    means[c].y /= count[c];
    means[c].height /= count[c];
  }
}

FloorRelief::FloorRelief() { setFlat(); }

/// No relief; the cells of the plane are the measured ones.
void FloorRelief::setFlat() {
  facets_.assign(1, ReliefFacet());
  creases_.clear();
  has_heights_ = has_step_ = false;
  highest_ = 0.0;
}

void FloorRelief::find(const UprightReturns& returns, const std::vector<std::uint32_t>& which,
                       const RoomBoundaryParams& params) {
  params_ = params;
  setFlat();
  grid_.fill(returns, which);
  has_step_ = findStep();
  if (has_step_) grid_.findMeans();
  findFloor();
  nearest_.take(is_floor_);
  if (!has_heights_ && !has_step_) return;
  if (!has_step_) grid_.findMeans();
  findFacets();
  if (has_step_) joinStep();
  findCreases();
  lowerSlopes();
}

/// Cells of the plane and of what a climbable slope leads to, and platforms.
void FloorRelief::findFloor() {
  is_floor_.assign(ReliefGrid::kCells, 0);
  may_join_.assign(ReliefGrid::kCells + sizeof(std::uint64_t), 0);  // looked at by words
  facet_.assign(ReliefGrid::kCells, -1);
  height_.resize(ReliefGrid::kCells);
  queue_.clear();
  for (const std::uint32_t c : grid_.used) {
    const auto& cell = grid_.cells[c];
    if (!cell.is_even) continue;
    const bool is_on_plane = std::fabs(static_cast<double>(cell.median)) <= kOnPlane;
    may_join_[c] = is_on_plane ? 0 : 1;
    if (!is_on_plane) continue;
    is_floor_[c] = 1;
    facet_[c] = 0;
    queue_.push_back(c);
  }
  const auto on_plane = static_cast<std::ptrdiff_t>(queue_.size());
  reach(&queue_, true);
  queue_.erase(queue_.begin(), queue_.begin() + on_plane);
  addPlatforms();
  has_heights_ = queue_.size() >= kFewestCells;
  left_.clear();
  if (!has_heights_) return;
  left_.swap(queue_);
  std::sort(left_.begin(), left_.end());
  for (const std::uint32_t c : left_) {
    is_floor_[c] = 1;
    height_[c] = grid_.cells[c].median;
    highest_ = std::max(highest_, std::fabs(height_[c]));
  }
}

/// Appends the cells that a chain of neighbours leads to, each step judged by its rise and length.
void FloorRelief::reach(Indices* queue, bool climbs) {
  for (std::size_t next = 0; next < queue->size(); ++next) {
    const std::uint32_t from = (*queue)[next];
    const int row = static_cast<int>(from) / kSide;
    for (int y = std::max(0, row - kHop); y <= std::min(kSide - 1, row + kHop); ++y) {
      reachRow(from, y, climbs, queue);
    }
  }
}

void FloorRelief::reachRow(std::uint32_t from, int row, bool climbs, Indices* queue) {
  const int from_column = static_cast<int>(from) % kSide, from_row = static_cast<int>(from) / kSide;
  const int left = std::max(0, from_column - kHop);
  const int right = std::min(kSide - 1, from_column + kHop);
  std::uint64_t some = 0;
  std::memcpy(&some, &may_join_[static_cast<std::size_t>(row * kSide + left)], sizeof(some));
  if (some == 0) return;  // as mostly, and some cells beyond the last one are nothing, too
  const double rise = params_.max_slope * ReliefGrid::kCell;
  for (int column = left; column <= right; ++column) {
    const auto to = static_cast<std::uint32_t>(row * kSide + column);
    if (may_join_[to] == 0) continue;
    const int away = std::max(std::abs(column - from_column), std::abs(row - from_row));
    const double steepest = climbs ? rise * away + kSlack : kSlack;
    const double step =
        static_cast<double>(grid_.cells[to].median) - static_cast<double>(grid_.cells[from].median);
    if (!(std::fabs(step) < steepest)) continue;
    may_join_[to] = 0;
    queue->push_back(to);
  }
}

/// Low, wide, level groups of cells, and what lies on the platform of a step.
void FloorRelief::addPlatforms() {
  left_.clear();
  for (const std::uint32_t c : grid_.used) {
    if (may_join_[c] == 0) continue;
    const double height = std::fabs(static_cast<double>(grid_.cells[c].median));
    may_join_[c] = height <= params_.max_step_height ? 1 : 0;
    if (may_join_[c] != 0) left_.push_back(c);
  }
  for (const std::uint32_t start : left_) {
    if (may_join_[start] == 0) continue;
    group_.assign(1, start);
    may_join_[start] = 0;
    reach(&group_, false);
    if (group_.size() < kPlatformCells && !(has_step_ && stepCarries(group_))) continue;
    queue_.insert(queue_.end(), group_.begin(), group_.end());
  }
}

double FloorRelief::heightAt(std::int32_t cell, double x, double y) const {
  int facet = facet_[static_cast<std::size_t>(cell)];
  if (facet < 0) return height_[static_cast<std::size_t>(cell)];
  for (std::size_t pass = 1; pass < facets_.size(); ++pass) {
    for (const ReliefCrease& crease : creases_) {
      if (crease.of == facet && crease.side(x, y) > 0.0) facet = crease.to;
    }
  }
  return facets_[static_cast<std::size_t>(facet)].at(x, y);
}

double FloorRelief::at(double x, double y) {
  if (isFlat() || nearest_.empty()) return 0.0;
  return heightAt(nearest(x, y).cell, x, y);
}

double FloorRelief::sigma(double x, double y, double flatness) {
  if (nearest_.empty()) return 0.0;
  return sigmaOf(nearest(x, y).square, sigmaPerMetre(flatness));
}

void FloorRelief::sigmas(const float* x, const float* y, std::size_t size, double flatness,
                         float* sigma) {
  constexpr std::size_t kBlock = 256;
  if (nearest_.empty()) {
    std::fill_n(sigma, size, 0.0F);
    return;
  }
  const double per_metre = sigmaPerMetre(flatness);
  std::array<std::int32_t, kBlock> column, row, square;
  for (std::size_t begin = 0; begin < size; begin += kBlock) {
    const std::size_t count = std::min(kBlock, size - begin);
    cellNumbers(x + begin, count, ReliefGrid::kCell, column.data());
    cellNumbers(y + begin, count, ReliefGrid::kCell, row.data());
    for (std::size_t i = 0; i < count; ++i) {
      square[i] = nearest_.of(column[i] + kSide / 2, row[i] + kSide / 2).square;
    }
    sigmasOf(square.data(), count, per_metre, sigma + begin);
  }
}

double FloorRelief::sigmaPerMetre(double flatness) const {
  double square = 0.0;
  for (const ReliefFacet& facet : facets_) {
    square = std::max(square, facet.a * facet.a + facet.b * facet.b);
  }
  const double height = isFlat() ? 0.0 : kUnseenHeight * highest_;
  return std::max({flatness, kUnseenSlope * std::sqrt(square), height});
}

bool FloorRelief::carries(double x, double y, double height) {
  if (isFlat() || nearest_.empty()) return false;
  if (!(height > ReliefGrid::kLowest) || !(height < ReliefGrid::kHighest)) return false;
  if (!(std::fabs(x) < ReliefGrid::kReach) || !(std::fabs(y) < ReliefGrid::kReach)) return false;
  const NearestCells::Found found = nearest(x, y);
  if (!(ReliefGrid::kCell * std::sqrt(static_cast<double>(found.square)) < kNear)) return false;
  const double over = heightAt(found.cell, x, y);
  return over != 0.0 && std::fabs(height - over) < kOnPlane;
}

NearestCells::Found FloorRelief::nearest(double x, double y) {
  return nearest_.of(indexOf(x), indexOf(y));
}

}  // namespace smoke_ground_reconstruction
