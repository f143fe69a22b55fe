#include "smoke_ground_reconstruction/floor_relief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "cell_numbers.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr int kSide = ReliefGrid::kSide;
constexpr double kNearest = 0.5;      // planar range [m]
constexpr std::uint32_t kPoints = 4;  // of a cell
constexpr std::uint32_t kMany = 16;   // or more are looked over before they are ranked
constexpr double kSpread = 0.04;      // between 10th and 90th percentile of a cell's heights [m]
constexpr double kOnPlane = 0.03;
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

/// Cells by their columns and rows, ReliefGrid::kCells where a return lies too high, too low, too
/// near or too far.
SMOKE_GROUND_MULTIVERSION
void joinNumbers(const ReliefReturns& input, std::size_t begin, std::size_t count,
                 const std::int32_t* column, const std::int32_t* row, std::uint32_t* cell) {
  constexpr auto kFarthest = static_cast<float>(ReliefGrid::kReach);
  constexpr auto kNone = static_cast<int>(ReliefGrid::kCells);
  const float* px = input.x.data() + begin;
  const float* py = input.y.data() + begin;
  const float* pz = input.height.data() + begin;
  const float* planar = input.planar.data() + begin;
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_in = (pz[i] > ReliefGrid::kLowest) & (pz[i] < ReliefGrid::kHighest) &
                       (planar[i] > kNearest) & (std::fabs(px[i]) < kFarthest) &
                       (std::fabs(py[i]) < kFarthest);
    const int at = (row[i] + kSide / 2) * kSide + (column[i] + kSide / 2);
    cell[i] = static_cast<std::uint32_t>(is_in ? at : kNone);
  }
}

void findCells(const ReliefReturns& input, std::uint32_t* cell) {
  constexpr std::size_t kBlock = 256;
  std::array<std::int32_t, kBlock> column, row;
  for (std::size_t begin = 0; begin < input.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, input.size() - begin);
    cellNumbers(input.x.data() + begin, count, ReliefGrid::kCell, column.data());
    cellNumbers(input.y.data() + begin, count, ReliefGrid::kCell, row.data());
    joinNumbers(input, begin, count, column.data(), row.data(), cell + begin);
  }
}

}  // namespace

void ReliefReturns::clear() {
  for (auto* values : {&x, &y, &height, &planar}) values->clear();
}

void ReliefReturns::push(float at_x, float at_y, float over_plane, float range) {
  x.push_back(at_x);
  y.push_back(at_y);
  height.push_back(over_plane);
  planar.push_back(range);
}

void ReliefGrid::fill(const ReliefReturns& input) {
  take(input);
  off.resize(returns.size());
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < returns.size(); ++i) {
    off[count] = i;
    count += is_off_[returns[i].cell];
  }
  off.resize(count);
  for (const std::uint32_t i : off) {
    const float height = returns[i].height;
    Cell& cell = cells[returns[i].cell];
    cell.bottom = std::min(cell.bottom, height);
    cell.top = std::max(cell.top, height);
  }
  rank();
}

/// Returns with their cells, how many each has, and which have some off the plane.
void ReliefGrid::take(const ReliefReturns& input) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  cell_of_.resize(input.size());
  findCells(input, cell_of_.data());
  returns.resize(input.size());
  cells.assign(kCells + 1, Cell{0, false, 0.0F, kInfinity, -kInfinity});
  is_off_.assign(kCells + 1, 0);
  std::size_t taken = 0;
  for (std::size_t i = 0; i < input.size(); ++i) {
    const std::uint32_t cell = cell_of_[i];
    const float height = input.height[i];
    returns[taken] = {input.x[i], input.y[i], height, cell};
    taken += cell < kCells ? 1U : 0U;
    ++cells[cell].count;
    if (!(std::fabs(height) < kOnPlane)) is_off_[cell] = 1;
  }
  returns.resize(taken);
  cells.resize(kCells);
}

/// What the heights of each cell say. No need to rank what lies on the plane altogether.
void ReliefGrid::rank() {
  begin_.resize(kCells);
  off_cells_.clear();
  std::uint32_t ranked = 0;
  for (std::uint32_t c = 0; c < kCells; ++c) {
    cells[c].is_even = cells[c].count >= kPoints;
    if (is_off_[c] == 0) continue;
    off_cells_.push_back(c);
    begin_[c] = ranked;
    ranked += cells[c].count;
  }
  heights_.resize(ranked);
  for (const std::uint32_t i : off) heights_[begin_[returns[i].cell]++] = returns[i].height;
  for (const std::uint32_t c : off_cells_) {
    if (cells[c].count >= kPoints) rank(&cells[c], heights_.data() + begin_[c] - cells[c].count);
  }
}

/// Median of a cell's heights, if they agree on one.
void ReliefGrid::rank(Cell* cell, float* first) const {
  const std::uint32_t count = cell->count;
  cell->is_even = false;
  if (count >= kMany && isScattered(first, count)) return;
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
  means.assign(kCells, Mean());
  for (const Return& one : returns) {
    Mean& mean = means[one.cell];
    mean.x += one.x;
    mean.y += one.y;
    mean.height += one.height;
  }
  for (std::size_t c = 0; c < kCells; ++c) {
    const std::uint32_t count = cells[c].count;
    if (count == 0) continue;
    means[c].x /= count;
    means[c].y /= count;
    means[c].height /= count;
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

void FloorRelief::find(const ReliefReturns& returns, const RoomBoundaryParams& params) {
  params_ = params;
  setFlat();
  grid_.fill(returns);
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
  const std::size_t n = ReliefGrid::kCells;
  is_floor_.assign(n, 0);
  may_join_.resize(n);
  facet_.assign(n, -1);
  height_.assign(n, 0.0);
  queue_.clear();
  for (std::uint32_t c = 0; c < n; ++c) {
    const auto& cell = grid_.cells[c];
    may_join_[c] = cell.is_even ? 1 : 0;
    if (!cell.is_even || std::fabs(static_cast<double>(cell.median)) > kOnPlane) continue;
    is_floor_[c] = 1;
    facet_[c] = 0;
    queue_.push_back(c);
  }
  reach(&queue_, &is_floor_, true);
  addPlatforms();
  left_.clear();
  for (std::uint32_t c = 0; c < n; ++c) {
    if (is_floor_[c] != 0 && facet_[c] != 0) left_.push_back(c);
  }
  has_heights_ = left_.size() >= kFewestCells;
  if (!has_heights_) {
    for (const std::uint32_t c : left_) is_floor_[c] = 0;
    left_.clear();
  }
  for (const std::uint32_t c : left_) {
    height_[c] = grid_.cells[c].median;
    highest_ = std::max(highest_, std::fabs(height_[c]));
  }
}

/// Adds the cells that a chain of neighbours leads to, each step judged by its rise and length.
void FloorRelief::reach(Indices* queue, std::vector<std::uint8_t>* found, bool climbs) {
  const double rise = params_.max_slope * ReliefGrid::kCell;
  for (std::size_t next = 0; next < queue->size(); ++next) {
    const std::uint32_t from = (*queue)[next];
    const int column = static_cast<int>(from) % kSide, row = static_cast<int>(from) / kSide;
    for (int y = std::max(0, row - kHop); y <= std::min(kSide - 1, row + kHop); ++y) {
      for (int x = std::max(0, column - kHop); x <= std::min(kSide - 1, column + kHop); ++x) {
        const auto to = static_cast<std::uint32_t>(y * kSide + x);
        if ((*found)[to] != 0 || may_join_[to] == 0) continue;
        const int away = std::max(std::abs(x - column), std::abs(y - row));
        const double steepest = climbs ? rise * away + kSlack : kSlack;
        const double step = static_cast<double>(grid_.cells[to].median) -
                            static_cast<double>(grid_.cells[from].median);
        if (!(std::fabs(step) < steepest)) continue;
        (*found)[to] = 1;
        queue->push_back(to);
      }
    }
  }
}

/// Low, wide, level groups of cells, and what lies on the platform of a step.
void FloorRelief::addPlatforms() {
  left_.clear();
  for (std::uint32_t c = 0; c < ReliefGrid::kCells; ++c) {
    const bool is_left =
        may_join_[c] != 0 && is_floor_[c] == 0 &&
        std::fabs(static_cast<double>(grid_.cells[c].median)) <= params_.max_step_height;
    may_join_[c] = is_left ? 1 : 0;
    if (is_left) left_.push_back(c);
  }
  is_taken_.assign(ReliefGrid::kCells, 0);
  for (const std::uint32_t start : left_) {
    if (is_taken_[start] != 0) continue;
    group_.assign(1, start);
    is_taken_[start] = 1;
    reach(&group_, &is_taken_, false);
    if (group_.size() < kPlatformCells && !(has_step_ && stepCarries(group_))) continue;
    for (const std::uint32_t c : group_) is_floor_[c] = 1;
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
