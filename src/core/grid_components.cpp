#include <algorithm>
#include <cmath>
#include <numeric>

#include "lanes.hpp"
#include "multiversion.hpp"
#include "smoke_ground_reconstruction/bounding_box.hpp"
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
  CellGrid(const Scan& scan, const std::vector<std::uint32_t>& points, double edge)
      : points_(points.size()) {
    Recycled<std::uint32_t> column(points.size());
    Recycled<std::uint32_t> level(points.size());
    placePoints(scan, points, 1.0 / edge, &column, &level);
    sortPoints(column, level);
    formCells(scan, points, column, level);
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(level_.size()); }
  /// Points begin(cell) to begin(cell + 1) lie in a cell.
  std::uint32_t begin(std::uint32_t cell) const { return begin_[cell]; }
  const PointLanes& points() const { return points_; }
  std::array<float, 3> point(std::uint32_t sorted) const { return points_[sorted]; }
  /// Place of a point in the list of points.
  std::uint32_t entry(std::uint32_t sorted) const { return entry_[sorted]; }
  const BoundingBox& box(std::uint32_t cell) const { return box_[cell]; }

  /// Calls visit(a, b) once for each two cells at most `reach` cells apart on every axis.
  template <typename Visit>
  void forEachPair(int reach, const Visit& visit) const {
    const auto levels = static_cast<std::uint32_t>(reach);
    for (std::uint32_t column = 0; column < columns_.size(); ++column) {
      visitAbove(column, levels, visit);
      for (int dx = 0; dx <= reach; ++dx) {
        for (int dy = dx == 0 ? 1 : -reach; dy <= reach; ++dy) {
          const std::uint32_t other = columns_.find(columns_.key(column) + packed(dx, dy));
          if (other != KeyTable::kNone) visitBeside(column, other, levels, visit);
        }
      }
    }
  }

 private:
  static std::uint64_t packed(std::int64_t x, std::int64_t y) {
    return (static_cast<std::uint64_t>(x) << 32U) + static_cast<std::uint64_t>(y);
  }

  // Casts round towards zero: only positive numbers are cast.
  void placePoints(const Scan& scan, const std::vector<std::uint32_t>& points, double per_metre,
                   std::vector<std::uint32_t>* column, std::vector<std::uint32_t>* level) {
    constexpr double kHalf = 1 << 20;
    std::uint64_t last_key = 0;  // of no point: the casts are of numbers above zero
    std::uint32_t last_column = KeyTable::kNone;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto p = scan.point(points[k]);
      const std::uint64_t key = packed(static_cast<std::int64_t>(p[0] * per_metre + kHalf),
                                       static_cast<std::int64_t>(p[1] * per_metre + kHalf));
      if (key != last_key) last_column = columns_.findOrAdd(key);
      last_key = key;
      (*column)[k] = last_column;
      (*level)[k] = static_cast<std::uint32_t>(p[2] * per_metre + kHalf);
    }
  }

  void sortPoints(const std::vector<std::uint32_t>& column,
                  const std::vector<std::uint32_t>& level) {
    entry_.resize(column.size());
    std::iota(entry_.begin(), entry_.end(), 0U);
    if (entry_.empty()) return;
    const auto [lowest, highest] = std::minmax_element(level.begin(), level.end());
    sortEntries(
        *highest - *lowest, [&, low = *lowest](std::uint32_t e) { return level[e] - low; },
        &entry_);
    sortEntries(
        columns_.size() - 1, [&](std::uint32_t e) { return column[e]; }, &entry_);
  }

  void formCells(const Scan& scan, const std::vector<std::uint32_t>& points,
                 const std::vector<std::uint32_t>& column,
                 const std::vector<std::uint32_t>& level) {
    column_begin_.resize(columns_.size() + 1);
    for (std::uint32_t i = 0; i < entry_.size(); ++i) {
      const std::uint32_t e = entry_[i];
      const auto point = scan.point(points[e]);
      points_.put(i, point);
      const bool in_new_column = i == 0 || column[e] != column[entry_[i - 1]];
      if (in_new_column) column_begin_[column[e]] = size();
      if (in_new_column || level[e] != level_.back()) {
        level_.push_back(level[e]);
        begin_.push_back(i);
        box_.emplace_back();
      }
      box_.back().add(point);
    }
    column_begin_.back() = size();
    begin_.push_back(static_cast<std::uint32_t>(entry_.size()));
  }

  template <typename Visit>
  void visitAbove(std::uint32_t column, std::uint32_t reach, const Visit& visit) const {
    const std::uint32_t end = column_begin_[column + 1];
    for (std::uint32_t a = column_begin_[column]; a < end; ++a) {
      for (std::uint32_t b = a + 1; b < end && level_[b] <= level_[a] + reach; ++b) {
        visit(a, b);
      }
    }
  }

  template <typename Visit>
  void visitBeside(std::uint32_t column, std::uint32_t other, std::uint32_t reach,
                   const Visit& visit) const {
    const std::uint32_t end = column_begin_[other + 1];
    std::uint32_t first = column_begin_[other];
    for (std::uint32_t a = column_begin_[column]; a < column_begin_[column + 1]; ++a) {
      while (first < end && level_[first] + reach < level_[a]) ++first;
      for (std::uint32_t b = first; b < end && level_[b] <= level_[a] + reach; ++b) {
        visit(a, b);
      }
    }
  }

  KeyTable columns_;
  Recycled<std::uint32_t> column_begin_;  // the first cell, by column
  Recycled<std::uint32_t> level_;         // of a cell in its column
  Recycled<std::uint32_t> begin_;         // the first point, by cell
  Recycled<BoundingBox> box_;             // by cell
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
/// the first link found between two that are not yet in one component.
std::vector<std::uint32_t> componentsOfTightCells(const CellGrid& grid, double tolerance,
                                                  std::size_t point_count) {
  const double squared_tolerance = tolerance * tolerance;
  const Nearness nearness(squared_tolerance);
  const auto are_linked = [&](std::uint32_t a, std::uint32_t b) {
    if (grid.box(a).leastSquaredDistance(grid.box(b)) >= squared_tolerance) return false;
    const std::uint32_t pairs =
        (grid.begin(a + 1) - grid.begin(a)) * (grid.begin(b + 1) - grid.begin(b));
    if (pairs < kLanes) return haveLink(grid, a, b, squared_tolerance);
    const Link link = findLink(grid.points(), grid.begin(a), grid.begin(a + 1), grid.begin(b),
                               grid.begin(b + 1), nearness);
    return link == Link::kInDoubt ? haveLink(grid, a, b, squared_tolerance) : link == Link::kSure;
  };
  DisjointSets sets(grid.size());
  grid.forEachPair(2, [&](std::uint32_t a, std::uint32_t b) {
    if (sets.find(a) != sets.find(b) && are_linked(a, b)) sets.join(b, a);
  });
  std::vector<std::uint32_t> component(point_count);
  for (std::uint32_t cell = 0; cell < grid.size(); ++cell) {
    const std::uint32_t root = sets.find(cell);
    for (std::uint32_t i = grid.begin(cell); i < grid.begin(cell + 1); ++i) {
      component[grid.entry(i)] = root;
    }
  }
  return component;
}

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
  grid.forEachPair(1, join);
  std::vector<std::uint32_t> component(point_count);
  for (std::uint32_t k = 0; k < point_count; ++k) component[k] = sets.find(k);
  return component;
}

double largestCoordinate(const Scan& scan, const std::vector<std::uint32_t>& points) {
  float largest = 0.0F;
  for (const std::uint32_t i : points) {
    largest = std::max({largest, std::fabs(scan.x[i]), std::fabs(scan.y[i]), std::fabs(scan.z[i])});
  }
  return largest;
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
  const double least_edge = largestCoordinate(scan, points) / kMostCells;
  // A hair less than the cube whose diagonal is the tolerance, against the rounding into cells.
  const double tight_edge = params.cluster_tolerance / std::sqrt(3.0) * (1.0 - 1e-6);
  if (params.cluster_tolerance_per_range > 0.0 || tight_edge < least_edge) {
    const double wide_edge = longestLink(params, scan, points) * (1.0 + 1e-6);
    const CellGrid grid(scan, points, std::max(wide_edge, least_edge));
    return componentsInWideCells(params, grid, points.size());
  }
  const CellGrid grid(scan, points, tight_edge);
  return componentsOfTightCells(grid, params.cluster_tolerance, points.size());
}

}  // namespace smoke_ground_reconstruction
