#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numeric>

#include "lanes.hpp"
#include "multiversion.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {

namespace {

// Cells from the origin to the farthest point, at most: 21 bits an axis hold them and a step more.
constexpr double kMostCells = (1 << 20) - 8;

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t find(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

 private:
  Recycled<std::uint32_t> parent_;
};

/// Numbers 0, 1, 2 ... for keys: open addressing, at most a quarter full.
class KeyTable {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  KeyTable() { slots_.assign(1024, kNone); }

  std::uint32_t size() const { return static_cast<std::uint32_t>(keys_.size()); }
  std::uint64_t key(std::uint32_t number) const { return keys_[number]; }

  std::uint32_t find(std::uint64_t key) const { return slots_[slotOf(key)]; }

  std::uint32_t findOrAdd(std::uint64_t key) {
    const std::size_t slot = slotOf(key);
    if (slots_[slot] != kNone) return slots_[slot];
    const std::uint32_t number = size();
    slots_[slot] = number;
    keys_.push_back(key);
    if (4 * keys_.size() > slots_.size()) grow();
    return number;
  }

 private:
  std::size_t slotOf(std::uint64_t key) const {
    const std::size_t last = slots_.size() - 1;
    std::size_t slot = static_cast<std::size_t>((key * 0x9E3779B97F4A7C15U) >> 32U) & last;
    while (slots_[slot] != kNone && keys_[slots_[slot]] != key) slot = (slot + 1) & last;
    return slot;
  }

  void grow() {
    slots_.assign(4 * slots_.size(), kNone);
    for (std::uint32_t number = 0; number < size(); ++number) {
      slots_[slotOf(keys_[number])] = number;
    }
  }

  Recycled<std::uint32_t> slots_;
  Recycled<std::uint64_t> keys_;  // by number
};

/// Stable sort of entries by a key of few bits, eleven of them at a time.
template <typename Key>
void sortEntries(std::uint32_t largest_key, const Key& key, std::vector<std::uint32_t>* entries) {
  constexpr std::uint32_t kDigits = 1U << 11U;
  Recycled<std::uint32_t> sorted(entries->size());
  for (std::uint32_t shift = 0; shift < 32 && (largest_key >> shift) != 0; shift += 11) {
    std::array<std::uint32_t, kDigits + 1> begin{};
    for (const std::uint32_t e : *entries) ++begin[(key(e) >> shift) % kDigits + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const std::uint32_t e : *entries) sorted[begin[(key(e) >> shift) % kDigits]++] = e;
    entries->swap(sorted);
  }
}

/// The same by a key of which there are not many more than entries; the entries are all below that
/// many.
template <typename Key>
void sortAtOnce(std::uint32_t keys, const Key& key, std::vector<std::uint32_t>* entries) {
  Recycled<std::uint32_t> begin;
  begin.assign(keys + 1U, 0);
  const auto size = static_cast<std::uint32_t>(entries->size());
  for (std::uint32_t e = 0; e < size; ++e) ++begin[key(e) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (std::uint32_t e = 0; e < size; ++e) (*entries)[begin[key(e)]++] = e;
}

constexpr std::size_t kAtOnce = 1024;            // points
constexpr std::uint64_t kMostCellsPerPoint = 8;  // more are mostly empty

/// Numbers of cells along an axis. Casts round towards zero: only positive numbers are cast.
SMOKE_GROUND_MULTIVERSION
void numberCells(const float* values, std::size_t size, double per_metre, std::uint32_t* cells) {
  constexpr double kHalf = 1 << 20;
  for (std::size_t k = 0; k < size; ++k) {
    const double cell = static_cast<double>(values[k]) * per_metre + kHalf;
    cells[k] = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell));
  }
}

/// Points one behind the other, and some to fill the last lanes.
struct PointLanes {
  Recycled<float> x, y, z;

  explicit PointLanes(std::size_t size) : x(size + kLanes), y(size + kLanes), z(size + kLanes) {
    for (auto* values : {&x, &y, &z}) std::fill_n(values->end() - kLanes, kLanes, 0.0F);
  }
  std::array<float, 3> operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  void put(std::size_t i, const std::array<float, 3>& point) {
    x[i] = point[0];
    y[i] = point[1];
    z[i] = point[2];
  }
};

/// A squared tolerance in single precision, which errs by 3e-7 of a squared distance as long as
/// nothing under- or overflows; the margins make it certain.
struct Nearness {
  float surely_below = -1.0F;
  float possibly_below = INFINITY;

  explicit Nearness(double squared_tolerance) {
    if (squared_tolerance < 1e-20 || squared_tolerance > 1e30) return;
    surely_below = static_cast<float>(squared_tolerance * (1.0 - 1e-6));
    possibly_below = static_cast<float>(squared_tolerance * (1.0 + 1e-6));
  }
};

enum class Link { kNone, kInDoubt, kSure };

/// Is one of the points [a, a_end) near one of [b, b_end)?
SMOKE_GROUND_MULTIVERSION
Link findLink(const PointLanes& points, std::uint32_t a, std::uint32_t a_end, std::uint32_t b,
              std::uint32_t b_end, const Nearness& nearness) {
  const float *const x = points.x.data(), *const y = points.y.data(), *const z = points.z.data();
  const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
  Ints is_possible = {};
  for (; a < a_end; ++a) {
    Ints is_sure = {};
    for (std::uint32_t i = b; i < b_end; i += kLanes) {
      const Floats dx = loadLanes(x + i) - x[a];
      const Floats dy = loadLanes(y + i) - y[a];
      const Floats dz = loadLanes(z + i) - z[a];
      const Floats d2 = (dx * dx + dy * dy) + dz * dz;
      const Ints is_asked = lane < static_cast<std::int32_t>(b_end - i);
      is_sure |= (d2 < nearness.surely_below) & is_asked;
      is_possible |= (d2 < nearness.possibly_below) & is_asked;
    }
    if (!isNone(is_sure)) return Link::kSure;
  }
  return isNone(is_possible) ? Link::kNone : Link::kInDoubt;
}

/// Points sorted into cubic cells, of which only those exist that hold any. Cells of a vertical
/// column lie side by side from the lowest to the highest: walls are made of such columns.
class CellGrid {
 public:
  CellGrid(const PointLanes& points, std::size_t point_count, double edge) : points_(point_count) {
    Recycled<std::uint32_t> column(point_count);
    Recycled<std::uint32_t> level(point_count);
    placePoints(points, 1.0 / edge, &column, &level);
    sortPoints(column, level);
    formCells(points, column, level);
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(level_.size()); }
  /// Points begin(cell) to begin(cell + 1) lie in a cell.
  std::uint32_t begin(std::uint32_t cell) const { return begin_[cell]; }
  const PointLanes& points() const { return points_; }
  std::array<float, 3> point(std::uint32_t sorted) const { return points_[sorted]; }
  /// Place of a point in the list of points.
  std::uint32_t entry(std::uint32_t sorted) const { return entry_[sorted]; }
  std::uint32_t columns() const { return columns_.size(); }
  /// Cells firstOf(column) to firstOf(column + 1) lie in a column.
  std::uint32_t firstOf(std::uint32_t column) const { return column_begin_[column]; }

  /// Calls visit(a, b) once for each two cells of a column at most `reach` apart.
  template <typename Visit>
  void forEachPairIn(std::uint32_t column, std::uint32_t reach, const Visit& visit) const {
    const std::uint32_t end = column_begin_[column + 1];
    for (std::uint32_t a = column_begin_[column]; a < end; ++a) {
      for (std::uint32_t b = a + 1; b < end && level_[b] <= level_[a] + reach; ++b) visit(a, b);
    }
  }

  /// The same of a cell of one column and one of another, until visit() returns true.
  template <typename Visit>
  void forEachPairOf(std::uint32_t column, std::uint32_t other, std::uint32_t reach,
                     const Visit& visit) const {
    const std::uint32_t end = column_begin_[other + 1];
    std::uint32_t first = column_begin_[other];
    for (std::uint32_t a = column_begin_[column]; a < column_begin_[column + 1]; ++a) {
      while (first < end && level_[first] + reach < level_[a]) ++first;
      for (std::uint32_t b = first; b < end && level_[b] <= level_[a] + reach; ++b) {
        if (visit(a, b)) return;
      }
    }
  }

  /// Calls visit(column, other) once for each two columns `from` to `reach` apart on the axis on
  /// which they are farther apart.
  template <typename Visit>
  void forEachTwoColumns(int from, int reach, const Visit& visit) const {
    for (std::uint32_t column = 0; column < columns_.size(); ++column) {
      for (int dx = 0; dx <= reach; ++dx) {
        for (int dy = dx == 0 ? 1 : -reach; dy <= reach; ++dy) {
          if (std::max(dx, std::abs(dy)) < from) continue;
          const std::uint32_t other = columns_.find(columns_.key(column) + packed(dx, dy));
          if (other != KeyTable::kNone) visit(column, other);
        }
      }
    }
  }

 private:
  static std::uint64_t packed(std::int64_t x, std::int64_t y) {
    return (static_cast<std::uint64_t>(x) << 32U) + static_cast<std::uint64_t>(y);
  }

  void placePoints(const PointLanes& points, double per_metre, std::vector<std::uint32_t>* column,
                   std::vector<std::uint32_t>* level) {
    std::array<std::uint32_t, kAtOnce> x, y;
    std::uint64_t last_key = 0;  // of no point: numbers of cells are above zero
    std::uint32_t last_column = KeyTable::kNone;
    for (std::size_t begin = 0; begin < column->size(); begin += kAtOnce) {
      const std::size_t size = std::min(kAtOnce, column->size() - begin);
      numberCells(&points.x[begin], size, per_metre, x.data());
      numberCells(&points.y[begin], size, per_metre, y.data());
      numberCells(&points.z[begin], size, per_metre, &(*level)[begin]);
      for (std::size_t k = 0; k < size; ++k) {
        const std::uint64_t key = packed(x[k], y[k]);
        if (key != last_key) last_column = columns_.findOrAdd(key);
        last_key = key;
        (*column)[begin + k] = last_column;
      }
    }
  }

  void sortPoints(const std::vector<std::uint32_t>& column,
                  const std::vector<std::uint32_t>& level) {
    entry_.resize(column.size());
    if (entry_.empty()) return;
    const auto [least, most] = std::minmax_element(level.begin(), level.end());
    const std::uint32_t lowest = *least, levels = *most - *least + 1;
    const std::uint64_t cells = std::uint64_t{levels} * columns_.size();
    if (cells <= kMostCellsPerPoint * column.size()) {
      sortAtOnce(
          static_cast<std::uint32_t>(cells),
          [&](std::uint32_t e) { return column[e] * levels + level[e] - lowest; }, &entry_);
      return;
    }
    std::iota(entry_.begin(), entry_.end(), 0U);
    sortEntries(
        levels - 1, [&](std::uint32_t e) { return level[e] - lowest; }, &entry_);
    sortEntries(
        columns_.size() - 1, [&](std::uint32_t e) { return column[e]; }, &entry_);
  }

  void formCells(const PointLanes& points, const std::vector<std::uint32_t>& column,
                 const std::vector<std::uint32_t>& level) {
    column_begin_.resize(columns_.size() + 1);
    std::uint32_t last_column = KeyTable::kNone;
    for (std::uint32_t i = 0; i < entry_.size(); ++i) {
      const std::uint32_t e = entry_[i];
      points_.put(i, points[e]);
      const bool in_new_column = column[e] != last_column;
      if (in_new_column) column_begin_[column[e]] = size();
      last_column = column[e];
      if (in_new_column || level[e] != level_.back()) {
        level_.push_back(level[e]);
        begin_.push_back(i);
      }
    }
    column_begin_.back() = size();
    begin_.push_back(static_cast<std::uint32_t>(entry_.size()));
  }

  KeyTable columns_;
  Recycled<std::uint32_t> column_begin_;  // the first cell, by column
  Recycled<std::uint32_t> level_;         // of a cell in its column
  Recycled<std::uint32_t> begin_;         // the first point, by cell
  PointLanes points_;                     // cell by cell
  Recycled<std::uint32_t> entry_;
};

/// Has one of the points of a cell one of another cell within a tolerance?
bool haveLink(const CellGrid& grid, std::uint32_t a, std::uint32_t b, double squared_tolerance) {
  for (std::uint32_t i = grid.begin(a); i < grid.begin(a + 1); ++i) {
    const auto p = grid.point(i);
    for (std::uint32_t j = grid.begin(b); j < grid.begin(b + 1); ++j) {
      const auto q = grid.point(j);
      if (squaredDistance(p[0], p[1], p[2], q[0], q[1], q[2]) < squared_tolerance) return true;
    }
  }
  return false;
}

/// One tolerance for all, cells so small that whatever shares one is linked: cells are joined, by
/// the first link found between two that are not yet in one component. Columns that are in one
/// component from bottom to top are joined as a whole.
class TightCells {
 public:
  TightCells(const CellGrid& grid, double tolerance)
      : grid_(grid),
        squared_tolerance_(tolerance * tolerance),
        nearness_(squared_tolerance_),
        sets_(grid.size()),
        is_whole_(grid.columns()) {
    for (std::uint32_t column = 0; column < grid.columns(); ++column) {
      grid.forEachPairIn(column, kReach, [&](std::uint32_t a, std::uint32_t b) { join(a, b); });
    }
    joinColumns(1, 1);  // the nearest first: then most others are in one component
    joinColumns(2, kReach);
  }

  std::vector<std::uint32_t> components(std::size_t point_count) {
    std::vector<std::uint32_t> component(point_count);
    for (std::uint32_t cell = 0; cell < grid_.size(); ++cell) {
      const std::uint32_t root = sets_.find(cell);
      for (std::uint32_t i = grid_.begin(cell); i < grid_.begin(cell + 1); ++i) {
        component[grid_.entry(i)] = root;
      }
    }
    return component;
  }

 private:
  static constexpr int kReach = 2;

  /// Returns whether they are in one component.
  bool join(std::uint32_t a, std::uint32_t b) {
    if (sets_.find(a) == sets_.find(b)) return true;
    if (!areLinked(a, b)) return false;
    sets_.join(b, a);
    return true;
  }

  bool areLinked(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t pairs =
        (grid_.begin(a + 1) - grid_.begin(a)) * (grid_.begin(b + 1) - grid_.begin(b));
    if (pairs < kLanes) return haveLink(grid_, a, b, squared_tolerance_);
    const Link link = findLink(grid_.points(), grid_.begin(a), grid_.begin(a + 1), grid_.begin(b),
                               grid_.begin(b + 1), nearness_);
    return link == Link::kInDoubt ? haveLink(grid_, a, b, squared_tolerance_) : link == Link::kSure;
  }

  void joinColumns(int from, int reach) {
    for (std::uint32_t column = 0; column < grid_.columns(); ++column) findWhole(column);
    grid_.forEachTwoColumns(from, reach, [&](std::uint32_t column, std::uint32_t other) {
      const bool are_whole = is_whole_[column] != 0 && is_whole_[other] != 0;
      if (are_whole && sets_.find(grid_.firstOf(column)) == sets_.find(grid_.firstOf(other)))
        return;
      grid_.forEachPairOf(column, other, kReach, [&](std::uint32_t a, std::uint32_t b) {
        return join(a, b) && are_whole;
      });
    });
  }

  void findWhole(std::uint32_t column) {
    const std::uint32_t first = grid_.firstOf(column), root = sets_.find(first);
    bool is_whole = true;
    for (std::uint32_t cell = first + 1; cell < grid_.firstOf(column + 1); ++cell) {
      is_whole &= sets_.find(cell) == root;
    }
    is_whole_[column] = is_whole ? 1 : 0;
  }

  const CellGrid& grid_;
  const double squared_tolerance_;
  const Nearness nearness_;
  DisjointSets sets_;
  Recycled<std::uint8_t> is_whole_;  // by column: in one component
};

/// Cells as wide as the longest link: each point with those of its own cell and the adjacent ones.
std::vector<std::uint32_t> componentsInWideCells(const WallClusteringParams& params,
                                                 const CellGrid& grid, std::size_t point_count) {
  DisjointSets sets(point_count);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    for (std::uint32_t i = grid.begin(a); i < grid.begin(a + 1); ++i) {
      for (std::uint32_t j = grid.begin(b); j < grid.begin(b + 1); ++j) {
        if (sets.find(grid.entry(i)) == sets.find(grid.entry(j))) continue;
        if (areLinked(params, grid.point(i), grid.point(j))) {
          sets.join(grid.entry(i), grid.entry(j));
        }
      }
    }
  };
  for (std::uint32_t cell = 0; cell < grid.size(); ++cell) join(cell, cell);
  for (std::uint32_t column = 0; column < grid.columns(); ++column) {
    grid.forEachPairIn(column, 1, join);
  }
  grid.forEachTwoColumns(1, 1, [&](std::uint32_t column, std::uint32_t other) {
    grid.forEachPairOf(column, other, 1, [&](std::uint32_t a, std::uint32_t b) {
      join(a, b);
      return false;
    });
  });
  std::vector<std::uint32_t> component(point_count);
  for (std::uint32_t k = 0; k < point_count; ++k) component[k] = sets.find(k);
  return component;
}

PointLanes selected(const Scan& scan, const std::vector<std::uint32_t>& points) {
  PointLanes selected(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) selected.put(k, scan.point(points[k]));
  return selected;
}

/// By their bits, which vectors compare at once.
SMOKE_GROUND_MULTIVERSION
float largestOf(const float* values, std::size_t size) {
  std::int32_t largest = 0;
  for (std::size_t k = 0; k < size; ++k) {
    std::int32_t bits;
    std::memcpy(&bits, values + k, sizeof(bits));
    largest = std::max(largest, bits & std::numeric_limits<std::int32_t>::max());
  }
  float value;
  std::memcpy(&value, &largest, sizeof(value));
  return value;
}

double largestCoordinate(const PointLanes& points) {
  return std::max({largestOf(points.x.data(), points.x.size()),
                   largestOf(points.y.data(), points.y.size()),
                   largestOf(points.z.data(), points.z.size())});
}

double longestLink(const WallClusteringParams& params, const Scan& scan,
                   const std::vector<std::uint32_t>& points) {
  double farthest = 0.0;
  for (const std::uint32_t i : points) {
    farthest = std::max(farthest, range(scan.x[i], scan.y[i], scan.z[i]));
  }
  return params.cluster_tolerance + params.cluster_tolerance_per_range * farthest;
}

}  // namespace

std::vector<std::uint32_t> findComponentsOnGrid(const WallClusteringParams& params,
                                                const Scan& scan,
                                                const std::vector<std::uint32_t>& points) {
  const PointLanes lanes = selected(scan, points);
  const double least_edge = largestCoordinate(lanes) / kMostCells;
  // A hair less than the cube whose diagonal is the tolerance, against the rounding into cells.
  const double tight_edge = params.cluster_tolerance / std::sqrt(3.0) * (1.0 - 1e-6);
  if (params.cluster_tolerance_per_range > 0.0 || tight_edge < least_edge) {
    const double wide_edge = longestLink(params, scan, points) * (1.0 + 1e-6);
    const CellGrid grid(lanes, points.size(), std::max(wide_edge, least_edge));
    return componentsInWideCells(params, grid, points.size());
  }
  const CellGrid grid(lanes, points.size(), tight_edge);
  return TightCells(grid, params.cluster_tolerance).components(points.size());
}

}  // namespace smoke_ground_reconstruction
