#include "smoke_ground_reconstruction/wall_profile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kStrongPost = 6;  // returns that bound the floor without a line
constexpr double kBeyond = 0.25;          // returns this far beyond a bridge tear it down [m]
constexpr double kTorn = 0.1;             // in this share of its columns
constexpr double kWidestGap = 0.25;       // that is bridged along one wall, of the circle
constexpr double kMeeting = 0.05;         // [m]
constexpr double kChainStep = 0.04;       // from post to post of a chain [m]
constexpr double kChainSlope = 0.012;  // ... and per metre of range: a wall at 60 deg to the beam
constexpr double kCrossing = 0.06;     // lines so near to each other in a column cross there [m]
constexpr std::size_t kCurveColumns = 3;  // to either side, posts behind a line in which: a curve
constexpr double kLong = 0.8;            // a wall so long is bridged though its top is not seen [m]
constexpr double kOverFurniture = 2.1;   // people, cupboards and doors are lower [m]
constexpr double kSquare = 0.17;         // cosine between normals of walls at right angles, at most
constexpr double kAskew = 0.5;           // others are drawn on by so much of what those are
constexpr double kFarthestCorner = 1.6;  // times the farther place where its walls were seen last

/// How many of the three columns to either side go on at about a column's distance.
int likeNeighbors(const std::vector<double>& distance, std::size_t column, double widening) {
  const auto columns = static_cast<int>(distance.size());
  const double here = distance[column];
  int like = 0;
  for (const int shift : {-3, -2, -1, 1, 2, 3}) {
    const int other = (static_cast<int>(column) + shift + columns) % columns;
    const double step = std::fabs(distance[static_cast<std::size_t>(other)] - here);
    like += step < (0.05 * widening + 0.03 * here) * std::abs(shift) ? 1 : 0;
  }
  return like;
}

/// Distance of a wall's places in two columns [m].
double chord(const double* reach, std::size_t a, std::size_t b,
             const ColumnDirections& directions) {
  const double x = reach[a] * directions.middle[a].cosine - reach[b] * directions.middle[b].cosine;
  const double y = reach[a] * directions.middle[a].sine - reach[b] * directions.middle[b].sine;
  return std::sqrt(x * x + y * y);
}

/// The column where a wall was seen last, going from one by steps of 1 or columns - 1.
std::size_t endOf(const std::vector<std::int32_t>& line, std::size_t at, std::size_t step) {
  std::size_t end = at;
  std::size_t breaks = 0;
  std::size_t c = at;
  for (std::size_t k = 1; k < line.size(); ++k) {
    c = (c + step) % line.size();
    if (line[c] == line[at]) {
      end = c;
      breaks = 0;
    } else if (breaks > ColumnRuns::kBreak) {
      break;
    }
    ++breaks;
  }
  return end;
}

}  // namespace

void ProfileFinder::find(const Posts& posts, const WallSupport& support, const UpwardView& view,
                         const std::vector<double>& beyond, const LevelFloor& level_floor,
                         const ColumnDirections& directions, double max_bridge_ratio, double spread,
                         Profile* profile) {
  max_bridge_ratio_ = max_bridge_ratio;
  widening_ = wideningFor(spread);
  on_line_ = onLineFor(spread);
  const std::size_t columns = directions.count();
  profile->distance.assign(columns, 0.0);
  profile->kind.assign(columns, BoundaryKind::kLimitOfKnowledge);
  profile->line.assign(columns, -1);
  takeNearestWalls(support, profile);
  addFullPosts(posts, view, profile);
  findOutermost(posts, support);
  beyond_.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) beyond_[c] = std::max(beyond[c], outermost_[c]);
  follow(profile);
  bridge(support, directions, profile);
  takeOutermost(support, directions, profile);
  closeOpenings(support, view, level_floor, profile);
  bridge(support, directions, profile);
}

void ProfileFinder::takeNearestWalls(const WallSupport& support, Profile* profile) const {
  for (std::size_t line = 0; line < support.lines(); ++line) {
    for (std::size_t c = 0; c < support.columns(); ++c) {
      if (support.full(line)[c] == 0) continue;
      const double reach = support.reach(line)[c];
      if (profile->line[c] >= 0 && reach >= profile->distance[c]) continue;
      profile->distance[c] = reach;
      profile->kind[c] = BoundaryKind::kWallSeen;
      profile->line[c] = static_cast<std::int32_t>(line);
    }
  }
}

/// Walls that no straight line fits: posts up to the ceiling, with like neighbours.
void ProfileFinder::addFullPosts(const Posts& posts, const UpwardView& view, Profile* profile) {
  nearest_.assign(profile->columns(), kInfinity);
  tall_.assign(profile->columns(), kInfinity);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const double distance = posts.distance[i];
    if (posts.count[i] < kStrongPost || !view.isFull(posts.high[i], distance)) continue;
    double& tall = tall_[posts.column[i]];
    if (posts.high[i] > kOverFurniture) tall = std::min(tall, distance);
    if (!view.tells(distance)) continue;
    nearest_[posts.column[i]] = std::min(nearest_[posts.column[i]], distance);
  }
  for (std::size_t c = 0; c < nearest_.size(); ++c) {
    const bool is_new = profile->distance[c] == 0.0 && nearest_[c] < kInfinity;
    if (!is_new || likeNeighbors(nearest_, c, widening_) < 3) continue;
    profile->distance[c] = nearest_[c];
    profile->kind[c] = BoundaryKind::kWallSeen;
  }
}

/// The farthest vertical structure of each column; 0 where there is none. A line knows better than
/// the few returns of one column how far its wall is, unless the wall curves away behind it, in the
/// columns beside, too. Of lines that cross there the nearest bounds the floor: in a corner it is
/// the wall, elsewhere one of them only touches it.
void ProfileFinder::findOutermost(const Posts& posts, const WallSupport& support) {
  const std::size_t columns = support.columns();
  outermost_.assign(columns, 0.0);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    double& farthest = outermost_[posts.column[i]];
    if (posts.count[i] >= kStrongPost) farthest = std::max(farthest, posts.distance[i]);
  }
  nearest_.assign(columns, 0.0);
  for (std::size_t line = 0; line < support.lines(); ++line) {
    for (std::size_t c = 0; c < columns; ++c) {
      if (support.seen(line)[c] != 0) nearest_[c] = std::max(nearest_[c], support.reach(line)[c]);
    }
  }
  candidate_ = nearest_;
  for (std::size_t line = 0; line < support.lines(); ++line) {
    for (std::size_t c = 0; c < columns; ++c) {
      const double reach = support.reach(line)[c];
      const bool crosses =
          support.seen(line)[c] != 0 && reach > nearest_[c] - kCrossing * widening_;
      if (crosses) candidate_[c] = std::min(candidate_[c], reach);
    }
  }
  is_on_.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) is_on_[c] = outermost_[c] <= candidate_[c] ? 1 : 0;
  std::size_t on = 0;  // of a column and those to either side
  for (std::size_t k = 0; k <= 2 * kCurveColumns; ++k) {
    on += is_on_[(columns + k - kCurveColumns) % columns];
  }
  for (std::size_t c = 0; c < columns; ++c) {
    if (on > 0 && outermost_[c] <= candidate_[c] + on_line_) outermost_[c] = candidate_[c];
    on += is_on_[(c + kCurveColumns + 1) % columns];
    on -= is_on_[(c + columns - kCurveColumns) % columns];
  }
}

void ProfileFinder::takeOutermost(const WallSupport& support, const ColumnDirections& directions,
                                  Profile* profile) {
  const std::size_t columns = profile->columns();
  candidate_.resize(columns);
  is_rest_.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    candidate_[c] = profile->distance[c] > 0.0 ? profile->distance[c] : outermost_[c];
  }
  for (std::size_t c = 0; c < columns; ++c) {
    // A lone column is a look through a crack: no place to claim floor in.
    const bool is_rest = profile->distance[c] == 0.0 && outermost_[c] > 0.0 &&
                         likeNeighbors(candidate_, c, widening_) >= 2;
    is_rest_[c] = is_rest ? 1 : 0;
  }
  for (std::size_t c = 0; c < columns; ++c) {
    if (is_rest_[c] == 0) continue;
    profile->distance[c] = outermost_[c];
    profile->kind[c] = BoundaryKind::kWallSeen;
  }
  takeLines(support, directions, profile);
}

/// Walls of which no top is seen, long enough in all to be bridged along.
void ProfileFinder::takeLines(const WallSupport& support, const ColumnDirections& directions,
                              Profile* profile) {
  is_on_.resize(support.columns());
  for (std::size_t line = 0; line < support.lines(); ++line) {
    const double* reach = support.reach(line);
    for (std::size_t c = 0; c < support.columns(); ++c) {
      const bool is_on = support.seen(line)[c] != 0 && is_rest_[c] != 0 &&
                         std::fabs(reach[c] - profile->distance[c]) < kLineHalf * widening_;
      is_on_[c] = is_on ? 1 : 0;
    }
    runs_.find(is_on_.data(), is_on_.size());
    double length = 0.0;
    for (std::size_t run = 0; run < runs_.count(); ++run) {
      length += chord(reach, *runs_.begin(run), *(runs_.end(run) - 1), directions);
    }
    for (std::size_t c = 0; length > kLong && c < is_on_.size(); ++c) {
      if (is_on_[c] != 0) profile->line[c] = static_cast<std::int32_t>(line);
    }
  }
}

/// Walls go on across openings whose upper edge lies out of view.
///
/// Where the ceiling is in view a lintel shows, or shows to be missing. Where it is not, a wall
/// farther away between two stretches of one line is seen through a door or a window: floor goes on
/// to it only if some is measured there. Desks in line, lower than the view, are no such wall.
void ProfileFinder::closeOpenings(const WallSupport& support, const UpwardView& view,
                                  const LevelFloor& level_floor, Profile* profile) {
  const std::size_t columns = profile->columns();
  const double widest = kWidestGap * static_cast<double>(columns);
  is_on_.resize(columns);
  for (std::size_t number = 0; number < support.lines(); ++number) {
    const auto line = static_cast<std::int32_t>(number);
    if (!support.isTall(number)) continue;
    for (std::size_t c = 0; c < columns; ++c) is_on_[c] = profile->line[c] == line ? 1 : 0;
    runs_.find(is_on_.data(), columns);
    for (std::size_t run = 0; run < runs_.count(); ++run) {
      const std::size_t last = *(runs_.end(run) - 1);
      const std::size_t next = *runs_.begin((run + 1) % runs_.count());
      const std::size_t length = (next + columns - last - 1) % columns;
      if (length == 0 || static_cast<double>(length) > widest) continue;
      gap_.resize(length);
      for (std::size_t k = 0; k < length; ++k) gap_[k] = (last + 1 + k) % columns;
      closeOpening(support.reach(number), view, level_floor, line, profile);
    }
  }
}

/// Closes the gap, if it is an opening, by a line of which this is the reach.
void ProfileFinder::closeOpening(const double* reach, const UpwardView& view,
                                 const LevelFloor& level_floor, std::int32_t line,
                                 Profile* profile) {
  std::size_t torn = 0;
  for (const std::size_t c : gap_) {
    if (view.tells(reach[c])) return;
    torn += level_floor()[c] > reach[c] + kBeyond ? 1U : 0U;
  }
  if (static_cast<double>(torn) > kTorn * static_cast<double>(gap_.size())) return;
  for (const std::size_t c : gap_) {
    if (!(profile->distance[c] > reach[c])) continue;
    profile->distance[c] = reach[c];
    profile->kind[c] = BoundaryKind::kWallInferred;
    profile->line[c] = line;
  }
}

/// Closes gaps between known walls along a chain of posts that leads from one to the other: a
/// curved wall of which the top is hidden, mostly. Furniture stands before the walls' ends.
void ProfileFinder::follow(Profile* profile) {
  const std::size_t columns = profile->columns();
  known_.clear();
  for (std::size_t c = 0; c < columns; ++c) {
    if (profile->distance[c] > 0.0) known_.push_back(c);
  }
  for (std::size_t k = 0; k < known_.size(); ++k) {
    const std::size_t first = known_[k];
    const std::size_t after = known_[(k + 1) % known_.size()];
    const std::size_t length = (after + columns - first - 1) % columns;
    if (length == 0 || !findChain(*profile, first, after, length)) continue;
    std::size_t link = 0;
    for (std::size_t i = 1; i <= length; ++i) {
      while (chain_[link + 1].place <= i) ++link;
      const auto& from = chain_[link];
      const auto& to = chain_[link + 1];
      const double slope = (to.planar - from.planar) / static_cast<double>(to.place - from.place);
      const std::size_t c = (first + i) % columns;
      profile->distance[c] = slope * static_cast<double>(i - from.place) + from.planar;
      profile->kind[c] =
          outermost_[c] > 0.0 ? BoundaryKind::kWallSeen : BoundaryKind::kWallInferred;
    }
  }
}

/// Do posts lead from a known column over `length` unknown ones to the next known one?
bool ProfileFinder::findChain(const Profile& profile, std::size_t first, std::size_t after,
                              std::size_t length) {
  chain_.assign(1, {0, profile.distance[first]});
  for (std::size_t i = 1; i <= length; ++i) {
    const double planar = outermost_[(first + i) % profile.columns()];
    if (planar > 0.0) chain_.push_back({i, planar});
  }
  if (chain_.size() == 1) return false;
  chain_.push_back({length + 1, profile.distance[after]});
  for (std::size_t k = 1; k < chain_.size(); ++k) {
    const std::size_t turn = chain_[k].place - chain_[k - 1].place;
    const double nearer = std::min(chain_[k].planar, chain_[k - 1].planar);
    const double step = (kChainStep * widening_ + kChainSlope * nearer) * static_cast<double>(turn);
    if (turn > ColumnRuns::kBreak) return false;
    if (std::fabs(chain_[k].planar - chain_[k - 1].planar) > step) return false;
  }
  return true;
}

/// Bridges the gaps between known walls, along one wall or round the corner of two.
///
/// Along one wall nothing but a wall on both sides is asked for: the floor ends at the line of a
/// wall whether a door in it is open or not. A corner must lie in the gap, no farther along either
/// wall than it was seen to be long, and no floor, ceiling or wall may be seen beyond it. Walls
/// that do not meet at right angles may as well be chords of a round one, and are drawn on by less.
void ProfileFinder::bridge(const WallSupport& support, const ColumnDirections& directions,
                           Profile* profile) {
  known_.clear();
  for (std::size_t c = 0; c < profile->columns(); ++c) {
    if (profile->line[c] >= 0) known_.push_back(c);
  }
  for (std::size_t k = 0; k < known_.size(); ++k) {
    const std::size_t first = known_[k];
    const std::size_t after = known_[(k + 1) % known_.size()];
    if (after == first + 1) continue;
    const std::int32_t first_line = profile->line[first];
    const std::int32_t after_line = profile->line[after];
    const auto a = static_cast<std::size_t>(first_line);
    const auto b = static_cast<std::size_t>(after_line);
    const bool is_square = std::fabs(support.cosine(a, b)) < kSquare;
    const double ratio = is_square ? max_bridge_ratio_ : kAskew * max_bridge_ratio_;
    const Bridge bridge{first, after, support.reach(a), support.reach(b), ratio};
    collectGap(bridge, *profile);
    if (!isBridged(bridge, directions, *profile)) continue;
    for (const std::size_t c : gap_) {
      profile->distance[c] = std::min(bridge.a[c], bridge.b[c]);
      profile->kind[c] = BoundaryKind::kWallInferred;
      profile->line[c] = bridge.a[c] <= bridge.b[c] ? first_line : after_line;
    }
  }
}

/// Columns between the two of which nothing is known.
void ProfileFinder::collectGap(const Bridge& bridge, const Profile& profile) {
  gap_.clear();
  const std::size_t columns = profile.columns();
  const std::size_t length = (bridge.after + columns - bridge.first - 1) % columns;
  for (std::size_t k = 0; k < length; ++k) {
    const std::size_t c = (bridge.first + 1 + k) % columns;
    if (profile.distance[c] == 0.0) gap_.push_back(c);
  }
}

bool ProfileFinder::isBridged(const Bridge& bridge, const ColumnDirections& directions,
                              const Profile& profile) const {
  const double widest = kWidestGap * static_cast<double>(profile.columns());
  if (gap_.empty() || static_cast<double>(gap_.size()) > widest) return false;
  double farthest = 0.0;
  for (const std::size_t c : gap_)
    farthest = std::max(farthest, std::min(bridge.a[c], bridge.b[c]));
  const double seen = std::max(profile.distance[bridge.first], profile.distance[bridge.after]);
  if (farthest > kFarthestCorner * seen) return false;
  if (profile.line[bridge.first] == profile.line[bridge.after]) return true;
  return !isTorn(bridge) && !passesWall(bridge) && isCorner(bridge, directions, profile);
}

bool ProfileFinder::isTorn(const Bridge& bridge) const {
  std::size_t torn = 0;
  for (const std::size_t c : gap_) {
    torn += beyond_[c] > std::min(bridge.a[c], bridge.b[c]) + kBeyond ? 1U : 0U;
  }
  return static_cast<double>(torn) > kTorn * static_cast<double>(gap_.size());
}

/// Does something before a bridge reach out of the view, higher than furniture? Walls are not drawn
/// on behind a wall.
bool ProfileFinder::passesWall(const Bridge& bridge) const {
  const std::size_t columns = tall_.size();
  for (std::size_t c = (bridge.first + 1) % columns; c != bridge.after; c = (c + 1) % columns) {
    if (tall_[c] < std::min(bridge.a[c], bridge.b[c]) - kBeyond) return true;
  }
  return false;
}

/// Do two walls meet in the gap, each seen along enough of its length to be drawn on so far?
bool ProfileFinder::isCorner(const Bridge& bridge, const ColumnDirections& directions,
                             const Profile& profile) const {
  const double* a = bridge.a;
  const double* b = bridge.b;
  const double meeting = kMeeting * widening_;
  const bool meets =
      a[bridge.first] <= b[bridge.first] + meeting && b[bridge.after] <= a[bridge.after] + meeting;
  if (!meets) return false;
  const auto is_on_first = [&](std::size_t c) { return a[c] <= b[c]; };
  const auto last_of_first = std::find_if(gap_.rbegin(), gap_.rend(), is_on_first);
  const auto first_of_after = std::find_if_not(gap_.begin(), gap_.end(), is_on_first);
  const auto extends = [&](const double* reach, std::size_t at, std::size_t step, std::size_t far) {
    const double seen = chord(reach, at, endOf(profile.line, at, step), directions);
    return chord(reach, at, far, directions) <= bridge.ratio * seen;
  };
  const std::size_t backward = profile.columns() - 1;
  return (last_of_first == gap_.rend() || extends(a, bridge.first, backward, *last_of_first)) &&
         (first_of_after == gap_.end() || extends(b, bridge.after, 1, *first_of_after));
}

}  // namespace smoke_ground_reconstruction
