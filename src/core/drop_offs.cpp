#include "smoke_ground_reconstruction/drop_offs.hpp"

#include <algorithm>
#include <cmath>

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kNeighbors = 2;   // columns to either side that share what they see
constexpr std::size_t kWidestGap = 12;  // columns between two that see a drop and then see it too
constexpr std::size_t kFloorAgain = 3;  // measured returns of floor beyond a drop
constexpr double kClose = 1.0;          // floor so near before an edge goes on up to it [m]
constexpr std::ptrdiff_t kSingleColumns = 9;  // that see a drop, though each by one return
constexpr double kMirror = 0.15;     // floor so near beyond a crossing: there is no drop [m]
constexpr double kFarEdge = 0.03;    // behind the first return beyond a drop floor begins [m]
constexpr double kBeyondEdge = 0.3;  // floor so far beyond an edge: the drop has ended [m]
constexpr double kNarrowest = 0.5;   // or so near to the wall that there is no room for one [m]
constexpr std::size_t kWidestSpread = 225;   // columns beside a drop that may belong to it
constexpr std::size_t kSpreadPastEdge = 40;  // and beyond the last ones of an edge
constexpr std::size_t kDrawnOnColumns = 25;  // so far an edge of any direction goes on
constexpr double kResumed = 0.15;            // floor so near behind an edge shows that it ended [m]
constexpr double kAcross = 0.15;       // least cosine between a column and the normal of an edge
constexpr double kDrawnOn = 0.3;       // beyond its seen ends an edge of any direction goes on [m]
constexpr double kDrawnOnShare = 0.5;  // and by a share of its seen length

}  // namespace

void DropOffFinder::find(const DropOffReturns& returns, double sensor_height,
                         const std::vector<Direction>& middle,
                         const std::vector<std::array<double, 2>>& walls, const WallFeet& feet,
                         const DropTolerances& by, DropOffs* drops) {
  by_ = by;
  const std::size_t columns = middle.size();
  drops->begin.assign(columns, kInfinity);
  drops->end.assign(columns, kInfinity);
  drops->floor_to.assign(columns, 0.0);
  drops->is_doubted.assign(columns, 0);
  collect(returns, sensor_height, columns);
  if (crossings_.isEmpty()) return;
  if (!findWitnessed(true)) findWitnessed(false);
  joinNeighbors();
  endSingleColumns(drops);
  is_open_.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    is_open_[c] = crossings_.begin(c) == crossings_.end(c) ? 0 : 1;
  }
  sealer_.find(feet, is_open_, sensor_height, &sealed_);
  FloorSealer::keepSteady(sealed_, &steady_);
  findColumns();
  findEdges(middle, walls);
  followEdges(middle, drops);
  no_room_.assign(columns, kInfinity);
  for (std::size_t c = 0; c < feet.distance.size(); ++c) {
    if (feet.distance[c] > 0.0) no_room_[c] = feet.distance[c] - kNarrowest;
  }
  place_ = drops->begin;
  for (std::size_t c = 0; edges_.empty() && c < columns; ++c) {
    place_[c] = std::min(columns_.after[c], first_[c]);
  }
  spread(is_alone_, kWidestSpread, drops);
  spread(is_end_, kSpreadPastEdge, drops);
}

/// Sorts measured floor, and where beams crossed the floor's plane, by column.
void DropOffFinder::collect(const DropOffReturns& returns, double sensor_height,
                            std::size_t columns) {
  floor_.clear(columns);
  crossings_.clear(columns);
  below_.clear();
  for (std::size_t i = 0; i < returns.column.size(); ++i) {
    const double planar = returns.planar[i], height = returns.height[i];
    if (returns.is_floor[i] != 0) floor_.add(returns.column[i], planar);
    if (by_.isBelow(planar, height, sensor_height)) below_.push_back(i);
  }
  if (below_.empty()) return;
  floor_.sort();
  for (const std::size_t i : below_) {
    const double height = returns.height[i];
    const double crossing = returns.planar[i] * (sensor_height / (sensor_height - height));
    if (!isMirrored(returns.column[i], crossing)) crossings_.add(returns.column[i], crossing);
  }
  if (!crossings_.isEmpty()) crossings_.sort();
}

/// Does a return from below only seem to have fallen through? Where floor is measured to either
/// side, and on, a glossy floor has mirrored what stands on it.
bool DropOffFinder::isMirrored(std::size_t column, double crossing) const {
  const std::size_t columns = floor_.columns();
  const auto goes_on = [&](std::size_t step) {
    for (std::size_t k = 0; k <= kNeighbors; ++k) {
      const auto beyond = floor_.beyond((column + k * step) % columns, crossing);
      if (beyond.nearest < crossing + kMirror) return true;
    }
    return false;
  };
  return goes_on(1) && goes_on(columns - 1);
}

/// Second nearest and second farthest crossing of each column and its neighbours, or the first ones
/// if one return is witness enough. Is there any?
bool DropOffFinder::findWitnessed(bool twice) {
  bool is_any = false;
  const std::size_t columns = crossings_.columns();
  first_.assign(columns, kInfinity);
  last_.assign(columns, -kInfinity);
  for (std::size_t c = 0; c < columns; ++c) {
    double nearest = kInfinity, farthest = -kInfinity;
    double near = kInfinity, far = -kInfinity;  // the second of each
    for (std::size_t k = 0; k <= 2 * kNeighbors; ++k) {
      const std::size_t at = (c + columns + k - kNeighbors) % columns;
      for (const double* range = crossings_.begin(at); range != crossings_.end(at); ++range) {
        near = std::min(near, std::max(nearest, *range));
        nearest = std::min(nearest, *range);
        far = std::max(far, std::min(farthest, *range));
        farthest = std::max(farthest, *range);
      }
    }
    if (nearest == kInfinity || (twice && near == kInfinity)) continue;
    is_any = true;
    first_[c] = twice ? near : nearest;
    last_[c] = twice ? std::max(near, far) : farthest;
  }
  return is_any;
}

/// Columns between two that see a drop see the wider of both.
void DropOffFinder::joinNeighbors() {
  const std::size_t columns = first_.size();
  seen_.clear();
  for (std::size_t c = 0; c < columns; ++c) {
    if (first_[c] < kInfinity) seen_.push_back(c);
  }
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const std::size_t a = seen_[i], b = seen_[(i + 1) % seen_.size()];
    const std::size_t gap = (b + columns - a - 1) % columns;
    for (std::size_t k = 1; gap <= kWidestGap && k <= gap; ++k) {
      first_[(a + k) % columns] = std::min(first_[a], first_[b]);
      last_[(a + k) % columns] = std::max(last_[a], last_[b]);
    }
  }
}

/// The farthest floor of a column and some beside it nearer than a distance.
double DropOffFinder::lastAround(std::size_t column, std::size_t beside, double distance) const {
  const std::size_t columns = floor_.columns();
  double last = 0.0;
  for (std::size_t k = 0; k <= 2 * beside; ++k) {
    const std::size_t at = (column + columns + k - beside) % columns;
    last = std::max(last, floor_.lastBefore(at, distance));
  }
  return last;
}

/// Begin and end of the drop in each column that sees one, with its neighbours.
void DropOffFinder::endSingleColumns(DropOffs* drops) {
  const std::size_t columns = first_.size();
  again_.assign(columns, 0.0);
  for (std::size_t c = 0; c < columns; ++c) {
    if (first_[c] == kInfinity) continue;
    drops->begin[c] = std::max(0.0, lastAround(c, kNeighbors, first_[c]) - by_.edge);
    ColumnRanges::Beyond beyond;
    for (std::size_t k = 0; k <= 2 * kNeighbors; ++k) {
      const auto more = floor_.beyond((c + columns + k - kNeighbors) % columns, last_[c]);
      beyond.count += more.count;
      beyond.nearest = std::min(beyond.nearest, more.nearest);
    }
    if (beyond.count >= kFloorAgain) again_[c] = beyond.nearest + kFarEdge;
  }
  // An edge that runs aslant lies farther in the column itself than in some beside it.
  for (std::size_t c = 0; c < columns; ++c) {
    double end = 0.0;
    for (std::size_t k = 0; k <= 2 * kNeighbors; ++k) {
      end = std::max(end, again_[(c + columns + k - kNeighbors) % columns]);
    }
    if (again_[c] > 0.0) drops->end[c] = end;
  }
}

/// What each column sees of a drop; not all rings fire in each column, so it takes in two others.
void DropOffFinder::findColumns() {
  const std::size_t columns = first_.size();
  columns_.before.resize(columns);
  columns_.after.assign(columns, kInfinity);
  columns_.sees.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    for (const std::size_t at : {(c + columns - 1) % columns, c, (c + 1) % columns}) {
      for (const double* range = crossings_.begin(at); range != crossings_.end(at); ++range) {
        columns_.after[c] = std::min(columns_.after[c], *range);
      }
    }
    columns_.before[c] = lastAround(c, 1, std::min(columns_.after[c], first_[c]));
    columns_.sees[c] = columns_.after[c] < kInfinity && first_[c] < kInfinity ? 1 : 0;
    if (columns_.sees[c] == 0) columns_.before[c] = std::max(columns_.before[c], steady_[c]);
  }
}

/// The edges that several returns show, or else one that single ones do beyond doubt.
void DropOffFinder::findEdges(const std::vector<Direction>& middle,
                              const std::vector<std::array<double, 2>>& walls) {
  const auto is_sure = [](const DropEdge& edge) { return edge.is_sure; };
  edge_finder_.find(columns_, middle, walls, by_.place, &edges_);
  if (std::any_of(edges_.begin(), edges_.end(), is_sure)) return;
  for (std::size_t c = 0; c < columns_.sees.size(); ++c) {
    columns_.sees[c] = columns_.after[c] < kInfinity ? 1 : 0;
  }
  if (std::count(columns_.sees.begin(), columns_.sees.end(), 1) < kSingleColumns) return;
  edge_finder_.find(columns_, middle, walls, by_.place, &sure_edges_);
  if (std::any_of(sure_edges_.begin(), sure_edges_.end(), is_sure)) edges_.swap(sure_edges_);
}

void DropOffFinder::followEdges(const std::vector<Direction>& middle, DropOffs* drops) {
  const std::size_t columns = middle.size();
  is_taken_.assign(columns, 0);
  for (const DropEdge& edge : edges_) {
    for (std::size_t k = 0; k < edge.count; ++k) is_taken_[(edge.first + k) % columns] = 1;
  }
  is_explained_ = is_taken_;
  is_end_.assign(columns, 0);
  is_drawn_in_doubt_.assign(columns, 0);
  past_ends_.clear();
  for (const DropEdge& edge : edges_) {
    drawOn(edge, middle);
    const double rho = place(edge, middle, drops);
    if (edge.is_aligned) tell(edge, rho, middle, drops);
    const std::array<std::size_t, 2> seen = {edge.first, (edge.first + edge.count - 1) % columns};
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t last = drawn_[side].empty() ? seen[side] : drawn_[side].back();
      is_end_[last] = 1;
      if (edge.isInDoubt()) {
        for (const std::size_t c : drawn_[side]) is_drawn_in_doubt_[c] = 1;
        past_ends_.push_back({last, side == 0 ? columns - 1 : 1});
      }
      for (const std::size_t c : drawn_[side]) {
        const auto behind = floorBehind(edge, c, middle);
        if (first_[c] == kInfinity && behind.count >= kFloorAgain) {
          drops->end[c] = behind.nearest / edge.across(middle[c]) + kFarEdge;
        }
        is_explained_[c] = 1;
      }
    }
  }
  doubtPastEnds(columns, drops);
  is_alone_.resize(columns);
  is_known_.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    is_alone_[c] = first_[c] < kInfinity && is_explained_[c] == 0 ? 1 : 0;
    is_known_[c] = is_alone_[c] | is_explained_[c];
  }
}

/// Past the ends of edges in doubt, as long as others are drawn on there and tell of no floor.
void DropOffFinder::doubtPastEnds(std::size_t columns, DropOffs* drops) const {
  for (const PastEnd& end : past_ends_) {
    std::size_t at = (end.last + end.step) % columns;
    while (is_drawn_in_doubt_[at] != 0 && drops->floor_to[at] == 0.0 &&
           drops->is_doubted[at] == 0) {
      drops->is_doubted[at] = 1;
      at = (at + end.step) % columns;
    }
  }
}

/// Columns into which an edge goes on beyond its ends, until floor is measured right behind it. One
/// that may run otherwise goes no farther than to where no drop reaches the wall, either.
void DropOffFinder::drawOn(const DropEdge& edge, const std::vector<Direction>& middle) {
  const std::size_t columns = middle.size();
  const std::array<std::size_t, 2> ends = {edge.first, (edge.first + edge.count - 1) % columns};
  const std::array<double, 2> along = {edge.along(middle[ends[0]]), edge.along(middle[ends[1]])};
  const double farthest = kDrawnOn + kDrawnOnShare * std::fabs(along[1] - along[0]);
  for (std::size_t side = 0; side < 2; ++side) {
    drawn_[side].clear();
    for (std::size_t k = 1; k < columns; ++k) {
      const std::size_t c = (side == 0 ? ends[0] + columns - k : ends[1] + k) % columns;
      const double across = edge.across(middle[c]);
      const bool is_sealed = !edge.is_sure && steady_[c] * across > edge.rho + by_.clear();
      if (is_taken_[c] != 0 || across <= kAcross || is_sealed) break;
      const bool is_far =
          !edge.is_aligned && std::fabs(edge.along(middle[c]) - along[side]) > farthest;
      const double resumes = floorBehind(edge, c, middle).nearest;
      if ((is_far && k > kDrawnOnColumns) || resumes < edge.rho + by_.clear() + kResumed) break;
      drawn_[side].push_back(c);
    }
  }
}

/// Floor behind an edge in a column and its two neighbours; the distance is that across the edge.
ColumnRanges::Beyond DropOffFinder::floorBehind(const DropEdge& edge, std::size_t column,
                                                const std::vector<Direction>& middle) const {
  const std::size_t columns = middle.size();
  ColumnRanges::Beyond found;
  for (const std::size_t c : {(column + columns - 1) % columns, column, (column + 1) % columns}) {
    const double across = edge.across(middle[c]);
    if (!(across > 0.0)) continue;
    const auto more = floor_.beyond(c, (edge.rho + by_.clear()) / across);
    found.count += more.count;
    found.nearest = std::min(found.nearest, more.nearest * across);
  }
  return found;
}

/// Ends the floor where the farthest floor before an edge was measured: that distance.
double DropOffFinder::place(const DropEdge& edge, const std::vector<Direction>& middle,
                            DropOffs* drops) {
  at_.clear();
  for (std::size_t k = 0; k < edge.count; ++k) at_.push_back((edge.first + k) % middle.size());
  for (const auto& side : drawn_) at_.insert(at_.end(), side.begin(), side.end());
  double nearest = 0.0;
  for (const std::size_t c : at_) {
    const double floor = columns_.before[c] * edge.across(middle[c]);
    if (floor <= edge.rho + by_.place) nearest = std::max(nearest, floor);
  }
  const double rho = std::min(nearest, 0.5 * (nearest + edge.drop) - by_.edge);
  for (const std::size_t c : at_) {
    const double reach = rho / edge.across(middle[c]);
    drops->begin[c] = edge.is_sure ? reach : std::min(drops->begin[c], reach);
  }
  return rho;
}

/// Tells of floor that was not measured, from the columns that see the drop to the last ones that
/// measure floor close to the edge.
void DropOffFinder::tell(const DropEdge& edge, double rho, const std::vector<Direction>& middle,
                         DropOffs* drops) const {
  const std::size_t columns = middle.size();
  for (std::size_t k = 0; k < edge.count; ++k) {
    const std::size_t c = (edge.first + k) % columns;
    tellOne(edge, rho, c, middle[c], drops);
  }
  for (const auto& side : drawn_) {
    std::size_t told = 0;
    for (std::size_t k = 0; k < side.size(); ++k) {
      const double across = edge.across(middle[side[k]]);
      const double before = columns_.before[side[k]];
      const bool is_close =
          edge.rho / across - kClose < before && before * across < edge.rho + by_.place;
      if (is_close) told = k + 1;
    }
    for (std::size_t k = 0; k < told; ++k) tellOne(edge, rho, side[k], middle[side[k]], drops);
  }
}

/// Floor up to an edge, in doubt no farther than up to the others that may stand for it.
void DropOffFinder::tellOne(const DropEdge& edge, double rho, std::size_t column,
                            const Direction& to, DropOffs* drops) const {
  double reach = rho / edge.across(to);
  double& floor_to = drops->floor_to[column];
  if (edge.is_sure) {
    floor_to = reach;
    return;
  }
  for (const DropEdge& other : edges_) {
    const double across = other.across(to);
    if (&other == &edge || !other.isInDoubt() || !(across > kAcross)) continue;
    reach = std::min(reach, other.rho / across);
  }
  floor_to = floor_to > 0.0 ? std::min(floor_to, reach) : reach;
}

/// A drop goes on sideways until floor is measured well beyond it: where it ends is not seen.
/// Beyond the place where it is seen, that is: nearer floor goes on up to there. Where a wall
/// stands nearer, or leaves no room behind the floor, it ends as well.
void DropOffFinder::spread(const std::vector<std::uint8_t>& starts, std::size_t widest,
                           DropOffs* drops) const {
  const std::size_t columns = first_.size();
  for (const std::size_t step : {std::size_t{1}, columns - 1}) {
    for (std::size_t c = 0; c < columns; ++c) {
      if (starts[c] == 0) continue;
      double edge = drops->begin[c];
      for (std::size_t k = 1; k <= widest; ++k) {
        const std::size_t at = (c + step * k) % columns;
        if (is_known_[at] != 0) break;
        const double farthest = std::max(lastAround(at, kNeighbors, kInfinity), sealed_[at]);
        double past = edge + kBeyondEdge;
        if (k <= kSpreadPastEdge) {
          past = std::max(past, std::min(place_[c] + kBeyondEdge, no_room_[at]));
        }
        if (farthest > past) break;
        edge = std::max(edge, farthest - by_.edge);
        drops->begin[at] = std::min(drops->begin[at], edge);
      }
    }
  }
}

}  // namespace smoke_ground_reconstruction
