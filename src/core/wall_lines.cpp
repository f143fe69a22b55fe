#include "smoke_ground_reconstruction/wall_lines.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "multiversion.hpp"
#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kNowhere = std::numeric_limits<float>::infinity();
constexpr double kSlotsPerMetre = 25.0;
constexpr std::uint32_t kMostWeight = 12;  // of a post
constexpr std::array<double, 4> kHalves = {0.08, 0.05, kLineHalf, kLineHalf};
constexpr std::size_t kLineColumns = 6;      // least number of columns of a wall
constexpr double kLineLength = 0.2;          // least length of a wall [m]
constexpr double kPostSpacing = 0.1;         // of the densest stretch of a wall, at most [m]
constexpr double kNearest = 0.2;             // planar range [m]
constexpr double kAround = 4.0 * kLineHalf;  // what lies this near counts as around a wall [m]
constexpr std::size_t kMostLines = 40;
constexpr std::size_t kBlock = 32;  // slots that are searched at once, beyond the last, too
constexpr std::uint32_t kSupportPoints = 3;  // of a wall in one column
constexpr std::size_t kTopColumns = 4;       // that reach the ceiling make a wall of a stretch
constexpr double kTopShare = 0.2;
constexpr std::size_t kFootColumns = 12;  // to either side of those that see a wall: its foot
constexpr std::size_t kTallColumns = 2;   // that reach out of the view, at least: as high as a wall

/// Slots of the distances that lines of all normals through a place have.
template <std::size_t kAngles>
SMOKE_GROUND_MULTIVERSION void slotsOf(const std::array<Direction, kAngles>& normals, double x,
                                       double y, int first_slot, std::uint16_t* slots) {
  for (std::size_t a = 0; a < kAngles; ++a) {
    const double rho = x * normals[a].cosine + y * normals[a].sine;
    slots[a] = static_cast<std::uint16_t>(floorToInt(rho * kSlotsPerMetre) - first_slot);
  }
}

}  // namespace

ColumnDirections::ColumnDirections(std::size_t count) {
  const auto n = static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    edge.push_back(Direction::fromDegrees(static_cast<double>(i) * 360.0 / n));
    middle.push_back(Direction::fromDegrees((static_cast<double>(i) + 0.5) * 360.0 / n));
  }
}

void Lines::clear() {
  for (auto* values : {&nx, &ny, &rho}) values->clear();
}

SMOKE_GROUND_MULTIVERSION
void Lines::reach(std::size_t line, const std::vector<Direction>& directions, double* reach) const {
  const double x = nx[line], y = ny[line], distance = rho[line];
  const Direction* to = directions.data();
  for (std::size_t k = 0, size = directions.size(); k < size; ++k) {
    const double ahead = x * to[k].cosine + y * to[k].sine;
    const double range = distance / ahead;
    reach[k] = ahead > 1e-3 ? range : kInfinity;
  }
}

void LineWindows::find(const Lines& lines, const ColumnDirections& directions, double half) {
  columns_ = directions.count();
  ahead_.resize(columns_ + 1);
  lowest_.resize(lines.size() * columns_);
  highest_.resize(lowest_.size());
  for (std::size_t line = 0; line < lines.size(); ++line) findOf(lines, line, directions, half);
}

SMOKE_GROUND_MULTIVERSION
void LineWindows::findOf(const Lines& lines, std::size_t line, const ColumnDirections& directions,
                         double half) {
  constexpr double kMargin = 1e-5;  // beyond the rounding of directions and ranges
  const double nx = lines.nx[line], ny = lines.ny[line], rho = lines.rho[line];
  const Direction* edge = directions.edge.data();
  double* ahead = ahead_.data();
  for (std::size_t c = 0; c < columns_; ++c) ahead[c] = nx * edge[c].cosine + ny * edge[c].sine;
  ahead[columns_] = ahead[0];
  float* lowest = &lowest_[line * columns_];
  float* highest = &highest_[line * columns_];
  for (std::size_t c = 0; c < columns_; ++c) {
    const double larger = std::max(ahead[c], ahead[c + 1]) + kMargin;
    const double most = larger > 0.999 ? 1.0 + kMargin : larger;  // the normal may lie between
    const double least = std::min(ahead[c], ahead[c + 1]) - kMargin;
    const double nearest = (rho - half) / most - kMargin * rho;
    const double farthest = (rho + half) / least * (1.0 + kMargin);
    const float last = static_cast<float>(least > 0.0 ? farthest : kInfinity) + 1e-4F;
    lowest[c] = most > 0.0 ? static_cast<float>(nearest) - 1e-4F : kNowhere;
    highest[c] = most > 0.0 ? last : 0.0F;
  }
}

SMOKE_GROUND_MULTIVERSION
void LineWindows::findNearest(std::vector<float>* nearest) const {
  nearest->assign(columns_, kNowhere);
  float* const found = nearest->data();
  for (std::size_t begin = 0; begin < lowest_.size(); begin += columns_) {
    const float* const lowest = &lowest_[begin];
    for (std::size_t c = 0; c < columns_; ++c) found[c] = std::min(found[c], lowest[c]);
  }
}

LineFinder::LineFinder() : normals_() {
  for (std::size_t i = 0; i < kAngles; ++i) {
    normals_[i] = Direction::fromDegrees(static_cast<double>(i));
  }
}

void LineFinder::find(const Posts& posts, Lines* lines) {
  lines->clear();
  castVotes(posts);
  is_left_.assign(posts.size(), 1);
  is_skipped_.assign(posts.size(), 0);
  while (lines->size() < kMostLines) {
    use_.clear();
    for (std::uint32_t i = 0; i < posts.size(); ++i) {
      if (is_left_[i] != 0 && is_skipped_[i] == 0) use_.push_back(i);
    }
    if (use_.size() < kLineColumns) break;
    const Peak peak = strongest();
    const Line line = refined(posts, peak);
    collectNear(posts, line, kLineHalf);
    const bool is_wall = isWall(posts, line);
    if (!is_wall &&
        (static_cast<std::size_t>(peak.weight) < kLineColumns * kPostPoints || near_.empty())) {
      break;
    }
    for (const std::uint32_t post : near_) {
      (is_wall ? is_left_[post] = 0 : is_skipped_[post] = 1);
      vote(post, -1);
    }
    if (!is_wall) continue;
    lines->nx.push_back(line.nx);
    lines->ny.push_back(line.ny);
    lines->rho.push_back(line.rho);
    for (std::uint32_t i = 0; i < posts.size(); ++i) {
      if (is_left_[i] != 0 && is_skipped_[i] != 0) vote(i, 1);
      is_skipped_[i] = 0;
    }
  }
}

void LineFinder::castVotes(const Posts& posts) {
  double farthest = 0.0;
  for (std::size_t i = 0; i < posts.size(); ++i) {
    farthest = std::max(farthest, std::fabs(posts.x[i]) + std::fabs(posts.y[i]));
  }
  first_slot_ = -floorToInt(farthest * kSlotsPerMetre) - 2;
  width_ = static_cast<std::size_t>(2 - 2 * first_slot_);
  votes_.assign(kAngles * width_ + kBlock, 0);
  slots_.resize(posts.size() * kAngles);
  weight_.resize(posts.size());
  for (std::size_t i = 0; i < posts.size(); ++i) {
    weight_[i] = static_cast<int>(std::min(posts.count[i], kMostWeight));
    slotsOf(normals_, posts.x[i], posts.y[i], first_slot_, &slots_[i * kAngles]);
    vote(i, 1);
  }
}

void LineFinder::vote(std::size_t post, int sign) {
  const int weight = sign * weight_[post];
  const std::uint16_t* slots = &slots_[post * kAngles];
  int* row = votes_.data();
  for (std::size_t a = 0; a < kAngles; ++a, row += width_) row[slots[a]] += weight;
  // What is taken away elsewhere leaves a row's best as it is.
  const std::uint8_t adds = sign > 0 ? 1 : 0;
  for (std::size_t a = 0; a < kAngles; ++a) {
    const auto beside = static_cast<std::uint16_t>(slots[a] - row_at_[a]);
    row_is_stale_[a] |= adds | static_cast<std::uint8_t>(beside <= 1);
  }
}

SMOKE_GROUND_MULTIVERSION
void LineFinder::searchRow(std::size_t angle) {
  const int* votes = &votes_[angle * width_];
  int best = -1;
  for (std::size_t s = 0; s + 1 < width_; ++s) best = std::max(best, votes[s] + votes[s + 1]);
  const auto is_in = [&](std::size_t begin) {
    int found = 0;
    for (std::size_t s = begin; s < begin + kBlock; ++s) found |= votes[s] + votes[s + 1] == best;
    return found != 0;
  };
  std::size_t at = 0;
  while (!is_in(at)) at += kBlock;
  while (votes[at] + votes[at + 1] != best) ++at;
  row_best_[angle] = best;
  row_at_[angle] = static_cast<std::uint16_t>(at);
  row_is_stale_[angle] = 0;
}

/// The strongest pair of slots side by side; among equals the smallest angle, then distance.
LineFinder::Peak LineFinder::strongest() {
  std::size_t best = 0;
  for (std::size_t a = 0; a < kAngles; ++a) {
    if (row_is_stale_[a] != 0) searchRow(a);
    if (row_best_[a] > row_best_[best]) best = a;
  }
  const int slot = row_at_[best] + first_slot_ + 1;
  return {best, slot / kSlotsPerMetre, row_best_[best]};
}

/// Reweighted total least squares about a peak.
Line LineFinder::refined(const Posts& posts, const Peak& peak) {
  Line line{normals_[peak.angle].cosine, normals_[peak.angle].sine, peak.rho};
  for (const double half : kHalves) {
    collectNear(posts, line, half);
    if (near_.size() < 2) break;
    OrderedSum total, sum_x, sum_y;
    for (const std::uint32_t i : near_) {
      total.add(weight_[i]);
      sum_x.add(weight_[i] * posts.x[i]);
      sum_y.add(weight_[i] * posts.y[i]);
    }
    const double mean_x = sum_x.value() / total.value();
    const double mean_y = sum_y.value() / total.value();
    OrderedSum xx, xy, yy;
    for (const std::uint32_t i : near_) {
      const double x = posts.x[i] - mean_x;
      const double y = posts.y[i] - mean_y;
      xx.add(weight_[i] * x * x);
      xy.add(weight_[i] * x * y);
      yy.add(weight_[i] * y * y);
    }
    const LeastAxis axis = leastAxis(xx.value(), xy.value(), yy.value());
    line = {axis.x, axis.y, axis.x * mean_x + axis.y * mean_y};
  }
  return line.rho < 0.0 ? Line{-line.nx, -line.ny, -line.rho} : line;
}

/// Posts in use that lie near to a line, in their order.
void LineFinder::collectNear(const Posts& posts, const Line& line, double half) {
  near_.clear();
  for (const std::uint32_t i : use_) {
    if (line.distance(posts.x[i], posts.y[i]) < half) near_.push_back(i);
  }
}

/// Enough columns, and somewhere a dense enough stretch of them.
bool LineFinder::isWall(const Posts& posts, const Line& line) {
  std::size_t columns = 0;
  along_.clear();
  for (std::size_t k = 0; k < near_.size(); ++k) {
    const std::size_t i = near_[k];
    columns += k == 0 || posts.column[i] != posts.column[near_[k - 1]] ? 1U : 0U;
    along_.push_back(line.nx * posts.y[i] - line.ny * posts.x[i]);
  }
  if (columns < kLineColumns || line.rho < kNearest) return false;
  std::sort(along_.begin(), along_.end());
  double densest = kInfinity;
  for (std::size_t k = kLineColumns - 1; k < along_.size(); ++k) {
    densest = std::min(densest, along_[k] - along_[k - (kLineColumns - 1)]);
  }
  return along_.back() - along_.front() >= kLineLength &&
         densest < kPostSpacing * static_cast<double>(kLineColumns);
}

bool UpwardView::isFull(double high, double planar) const {
  const double top = std::min(ceiling, sensor_height + steepest * planar);
  return high > top - (0.1 + 0.05 * planar);
}

bool UpwardView::tells(double planar) const {
  return sensor_height + steepest * planar > std::min(ceiling, furniture_height);
}

void ColumnRuns::find(const std::uint8_t* is_in, std::size_t columns) {
  columns_.clear();
  end_.clear();
  for (std::uint32_t c = 0; c < columns; ++c) {
    if (is_in[c] != 0) columns_.push_back(c);
  }
  const std::size_t n = columns_.size();
  if (n == 0) return;
  const auto ends_here = [&](std::size_t i) {
    const std::size_t next = i + 1 < n ? columns_[i + 1] : columns_[0] + columns;
    return next - columns_[i] > kBreak;
  };
  for (std::size_t i = 0; i < n; ++i) {
    if (ends_here(i)) end_.push_back(i + 1);
  }
  if (end_.empty()) {
    end_.push_back(n);
    return;
  }
  // The stretch that begins after the last break comes first, across the seam.
  const std::size_t first = end_.back();
  std::rotate(columns_.begin(), columns_.begin() + static_cast<std::ptrdiff_t>(first % n),
              columns_.end());
  for (std::size_t& end : end_) end += n - first;
}

void WallSupport::find(const WallReturns& returns, const Lines& lines,
                       const ColumnDirections& directions, const UpwardView& view) {
  lines_ = lines.size();
  columns_ = directions.count();
  seen_.assign(lines_ * columns_, 0);
  full_.assign(lines_ * columns_, 0);
  tall_.assign(lines_, 0);
  reach_.resize(lines_ * columns_);
  nx_ = lines.nx;
  ny_ = lines.ny;
  windows_.find(lines, directions, kAround);
  for (std::size_t line = 0; line < lines_; ++line) {
    lines.reach(line, directions.middle, &reach_[line * columns_]);
    countReturns(returns, lines[line], line);
    judge(line);
    markFull(line, view);
    markTall(line, view);
  }
}

void WallSupport::countReturns(const WallReturns& returns, const Line& line, std::size_t number) {
  own_.assign(columns_, 0);
  around_.assign(columns_, 0);
  low_.assign(columns_, kNowhere);
  high_.assign(columns_, -kNowhere);
  for (std::size_t c = 0; c < columns_; ++c) {
    const RangeWindow window = windows_.of(number, c);
    if (window.isEmpty()) continue;
    const std::size_t end = returns.column_begin[c + 1];
    std::uint32_t own = 0, around = 0;
    float low = kNowhere, high = -kNowhere;
    std::size_t i = returns.firstIn(c, window);
    for (; i < end && !WallReturns::isBeyond(returns.planar[i], window); ++i) {
      const double off = line.distance(returns.x[i], returns.y[i]);
      around += off < kAround ? 1U : 0U;
      if (!(off < kLineHalf)) continue;
      ++own;
      low = std::min(low, returns.height[i]);
      high = std::max(high, returns.height[i]);
    }
    own_[c] = own;
    around_[c] = around;
    low_[c] = low;
    high_[c] = high;
  }
}

void WallSupport::judge(std::size_t line) {
  highest_.resize(columns_);
  for (std::size_t c = 0; c < columns_; ++c) {
    const std::size_t before = c == 0 ? columns_ - 1 : c - 1;
    const std::size_t after = c + 1 == columns_ ? 0 : c + 1;
    const std::uint32_t near = own_[before] + own_[c] + own_[after];
    const std::uint32_t total = around_[before] + around_[c] + around_[after];
    const double low = std::min({low_[before], low_[c], low_[after]});
    const double high = highest_[c] = std::max({high_[before], high_[c], high_[after]});
    const bool is_most = static_cast<double>(near) >= kPostShare * static_cast<double>(total);
    const bool is_seen = own_[c] > 0 && near >= kSupportPoints && is_most &&
                         high - low >= kPostExtent && reach(line)[c] < kInfinity;
    seen_[line * columns_ + c] = is_seen ? 1 : 0;
  }
}

/// A wall is a wall all along once a fifth of its columns, four at least, reach the ceiling.
/// Columns too near to tell count neither way; breaks in what is seen divide a line into walls, so
/// that a cupboard in line with a wall is none.
void WallSupport::markFull(std::size_t line, const UpwardView& view) {
  runs_.find(seen(line), columns_);
  for (std::size_t run = 0; run < runs_.count(); ++run) {
    std::size_t tells = 0;
    std::size_t tops = 0;
    for (const auto* c = runs_.begin(run); c != runs_.end(run); ++c) {
      const double planar = reach(line)[*c];
      if (!view.tells(planar)) continue;
      ++tells;
      if (view.isFull(highest_[*c], planar)) ++tops;
    }
    const double enough =
        std::max(static_cast<double>(kTopColumns), kTopShare * static_cast<double>(tells));
    if (static_cast<double>(tops) < enough) continue;
    for (const auto* c = runs_.begin(run); c != runs_.end(run); ++c) {
      full_[line * columns_ + *c] = 1;
    }
  }
}

bool WallSupport::isSeenNear(std::size_t line, std::size_t column) const {
  for (std::size_t k = 0; k <= 2 * kFootColumns; ++k) {
    if (seen(line)[(column + columns_ + k - kFootColumns) % columns_] != 0) return true;
  }
  return false;
}

void WallSupport::markTall(std::size_t line, const UpwardView& view) {
  std::size_t tops = 0;
  for (std::size_t c = 0; c < columns_; ++c) {
    if (seen(line)[c] == 0) continue;
    tops += view.isFull(highest_[c], reach(line)[c]) ? 1U : 0U;
  }
  tall_[line] = tops >= kTallColumns ? 1 : 0;
}

}  // namespace smoke_ground_reconstruction
