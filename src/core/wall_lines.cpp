#include "smoke_ground_reconstruction/wall_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "multiversion.hpp"
#include "ordered.hpp"
#include "point_loops.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kNowhere = std::numeric_limits<float>::infinity();
constexpr double kSlotsPerMetre = 25.0;
constexpr std::uint32_t kMostWeight = 12;  // of a post
constexpr std::array<double, 4> kHalves = {0.08, 0.05, kLineHalf, kLineHalf};
constexpr std::size_t kLineColumns = 6;  // least number of columns of a wall
constexpr double kLineLength = 0.2;      // least length of a wall [m]
constexpr double kPostSpacing = 0.1;     // of the densest stretch of a wall, at most [m]
constexpr double kNearest = 0.2;         // planar range [m]
constexpr double kAround = 4.0;          // what lies so many times as near counts as around it
constexpr std::size_t kMostLines = 40;
constexpr std::size_t kBlock = 32;           // slots that are searched at once
constexpr std::uint32_t kSupportPoints = 3;  // of a wall in one column
constexpr std::size_t kTopColumns = 4;       // that reach the ceiling make a wall of a stretch
constexpr double kTopShare = 0.2;
constexpr std::size_t kFootColumns = 12;  // to either side of those that see a wall: its foot
constexpr std::size_t kTallColumns = 2;   // that reach out of the view, at least: as high as a wall

/// Slots of the distances that lines of a normal through some places have.
SMOKE_GROUND_MULTIVERSION
void slotsOf(const Direction& normal, const double* x, const double* y, std::size_t size,
             int first_slot, std::uint16_t* slots) {
  const double cosine = normal.cosine, sine = normal.sine;
  for (std::size_t k = 0; k < size; ++k) {
    const double rho = x[k] * cosine + y[k] * sine;
    slots[k] = static_cast<std::uint16_t>(floorToInt(rho * kSlotsPerMetre) - first_slot);
  }
}

SMOKE_GROUND_PART std::uint16_t votesOfPair(const std::uint16_t* votes) {
  return static_cast<std::uint16_t>(votes[0] + votes[1]);
}

/// The most votes of two slots side by side.
SMOKE_GROUND_MULTIVERSION
std::uint16_t mostOfPairs(const std::uint16_t* votes, std::size_t pairs) {
  std::uint16_t most = 0;
  for (std::size_t s = 0; s < pairs; ++s) most = std::max(most, votesOfPair(votes + s));
  return most;
}

/// The first of two slots side by side that have so many votes; surely two have.
SMOKE_GROUND_MULTIVERSION
std::size_t firstPairOf(const std::uint16_t* votes, std::uint16_t wanted) {
  std::size_t block = 0;
  for (int is_in = 0; is_in == 0; block += kBlock) {
    for (std::size_t s = block; s < block + kBlock; ++s) {
      is_in |= votesOfPair(votes + s) == wanted ? 1 : 0;
    }
  }
  std::size_t s = block - kBlock;
  while (votesOfPair(votes + s) != wanted) ++s;
  return s;
}

/// The most votes of some slots side by side.
int mostOfSlots(const std::vector<std::uint16_t>& votes, std::size_t slots) {
  int sum = 0;
  int most = 0;
  for (std::size_t s = 0; s < votes.size(); ++s) {
    sum += votes[s];
    if (s >= slots) sum -= votes[s - slots];
    most = std::max(most, sum);
  }
  return most;
}

/// The first of the largest.
template <std::size_t kSize>
SMOKE_GROUND_MULTIVERSION std::size_t placeOfMost(const std::array<int, kSize>& values) {
  int most = values[0];
  for (std::size_t k = 0; k < kSize; ++k) most = std::max(most, values[k]);
  std::size_t place = 0;
  while (values[place] != most) ++place;
  return place;
}

SMOKE_GROUND_MULTIVERSION
void markNear(const Line& line, const double* x, const double* y, std::size_t size, double half,
              std::uint8_t* is_near) {
  const Line to = line;
  for (std::size_t k = 0; k < size; ++k) is_near[k] = to.distance(x[k], y[k]) < half ? 1 : 0;
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

/// With c the cosine between a line's normal and a direction, returns in that direction lie within
/// some distance d of the line from (rho - d) / c to (rho + d) / c. So a window reaches from
/// (rho - half) / most to (rho + half) / least, and what is sure from (rho - sure) / least to
/// (rho + sure) / most.
void LineWindows::find(const Lines& lines, const ColumnDirections& directions, double half,
                       double sure) {
  columns_ = directions.count();
  ahead_.resize(columns_ + 1);
  lowest_.resize(lines.size() * columns_);
  highest_.resize(lowest_.size());
  sure_.assign(lines.size(), {std::numeric_limits<float>::max(), 0.0F});
  for (std::size_t line = 0; line < lines.size(); ++line) {
    findOf(lines, line, directions, half);
    const double rho = lines.rho[line];
    if (!(rho > half)) continue;
    sure_[line] = {static_cast<float>((rho - sure) / (rho + half)),
                   static_cast<float>((rho + sure) / (rho - half))};
  }
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
void LineWindows::findNearest(const WallSupport& support, std::vector<float>* nearest) const {
  nearest->assign(columns_, kNowhere);
  float* const found = nearest->data();
  for (std::size_t line = 0; line < support.lines(); ++line) {
    const float* const lowest = &lowest_[line * columns_];
    const std::uint8_t* const is_seen = support.seenNear(line);
    for (std::size_t c = 0; c < columns_; ++c) {
      found[c] = std::min(found[c], is_seen[c] != 0 ? lowest[c] : kNowhere);
    }
  }
}

LineFinder::LineFinder() : normals_(), bests_(), unskipped_() {
  for (std::size_t i = 0; i < kAngles; ++i) {
    normals_[i] = Direction::fromDegrees(static_cast<double>(i));
  }
}

void LineFinder::find(const Posts& posts, double widening, Lines* lines) {
  widening_ = widening;
  lines->clear();
  start(posts);
  while (lines->size() < kMostLines && used_.size() >= kLineColumns) {
    const Peak peak = strongest();
    const Line line = refined(peak);
    collectNear(line, kLineHalf * widening_);
    if (isWall(posts, line)) {
      lines->nx.push_back(line.nx);
      lines->ny.push_back(line.ny);
      lines->rho.push_back(line.rho);
      takeOut(Use::kNone);
      giveBackSkipped();
    } else {
      const bool is_weak = static_cast<std::size_t>(peak.weight) < kLineColumns * kPostPoints;
      if (is_weak || near_.empty()) break;
      takeOut(Use::kSkipped);
    }
    gatherUsed(posts);
  }
}

void LineFinder::start(const Posts& posts) {
  use_.assign(posts.size(), Use::kYes);
  are_skipped_ = false;
  gatherUsed(posts);
  double square = 0.0;
  for (std::size_t k = 0; k < x_.size(); ++k) {
    square = std::max(square, x_[k] * x_[k] + y_[k] * y_[k]);
  }
  const double farthest = std::sqrt(square);
  first_slot_ = -floorToInt(farthest * kSlotsPerMetre) - 2;
  votes_.resize(static_cast<std::size_t>(2 - 2 * first_slot_) + kBlock);
  boundVotes(farthest);
}

/// Counts the votes of one angle in five. What lies in a pair of slots of an angle beside lies in
/// some more slots of that one.
void LineFinder::boundVotes(double farthest) {
  constexpr std::size_t kBeside = 2, kStep = 2 * kBeside + 1;
  static_assert(kAngles % kStep == 0, "each angle belongs to one that is counted");
  const double turn = normals_[kBeside].sine;
  const auto more = static_cast<std::size_t>(2.0 * farthest * turn * kSlotsPerMetre);
  for (std::size_t angle = kBeside; angle < kAngles; angle += kStep) {
    search(angle);
    const int bound = mostOfSlots(votes_, more + 5);
    for (std::size_t k = 1; k <= kBeside; ++k) {
      for (const std::size_t beside : {angle - k, angle + k}) {
        bests_.most[beside] = bound;
        bests_.is_new[beside] = false;
      }
    }
  }
}

void LineFinder::gatherUsed(const Posts& posts) {
  used_.clear();
  for (std::uint32_t i = 0; i < posts.size(); ++i) {
    if (use_[i] == Use::kYes) used_.push_back(i);
  }
  for (auto* values : {&x_, &y_}) values->resize(used_.size());
  for (auto* values : {&weight_, &slot_}) values->resize(used_.size());
  for (std::size_t k = 0; k < used_.size(); ++k) {
    x_[k] = posts.x[used_[k]];
    y_[k] = posts.y[used_[k]];
    weight_[k] = static_cast<std::uint16_t>(std::min(posts.count[used_[k]], kMostWeight));
  }
}

/// The strongest pair of slots side by side; among equals the smallest angle, then distance.
LineFinder::Peak LineFinder::strongest() {
  while (true) {
    const std::size_t angle = placeOfMost(bests_.most);
    if (!bests_.is_new[angle]) {
      search(angle);
      continue;
    }
    const int slot = static_cast<int>(bests_.slot[angle]) + first_slot_ + 1;
    return {angle, slot / kSlotsPerMetre, bests_.most[angle]};
  }
}

/// Counts an angle's votes and takes their best.
void LineFinder::search(std::size_t angle) {
  slotsOf(normals_[angle], x_.data(), y_.data(), used_.size(), first_slot_, slot_.data());
  std::fill(votes_.begin(), votes_.end(), std::uint16_t{0});
  for (std::size_t k = 0; k < used_.size(); ++k) {
    std::uint16_t& votes = votes_[slot_[k]];
    votes = static_cast<std::uint16_t>(votes + weight_[k]);
  }
  const std::uint16_t most = mostOfPairs(votes_.data(), votes_.size() - 1);
  bests_.most[angle] = most;
  bests_.slot[angle] = firstPairOf(votes_.data(), most);
  bests_.is_new[angle] = true;
}

void LineFinder::takeOut(Use use) {
  if (use == Use::kSkipped && !are_skipped_) {
    unskipped_ = bests_;
    are_skipped_ = true;
  }
  for (const std::uint32_t k : near_) use_[used_[k]] = use;
  bests_.is_new.fill(false);
}

void LineFinder::giveBackSkipped() {
  if (!are_skipped_) return;
  std::replace(use_.begin(), use_.end(), Use::kSkipped, Use::kYes);
  bests_.most = unskipped_.most;
  are_skipped_ = false;
}

/// Reweighted total least squares about a peak.
Line LineFinder::refined(const Peak& peak) {
  Line line{normals_[peak.angle].cosine, normals_[peak.angle].sine, peak.rho};
  for (const double half : kHalves) {
    collectNear(line, half * widening_);
    if (near_.size() < 2) break;
    OrderedSum total, sum_x, sum_y;
    for (const std::uint32_t k : near_) {
      total.add(weight_[k]);
      sum_x.add(weight_[k] * x_[k]);
      sum_y.add(weight_[k] * y_[k]);
    }
    const double mean_x = sum_x.value() / total.value();
    const double mean_y = sum_y.value() / total.value();
    OrderedSum xx, xy, yy;
    for (const std::uint32_t k : near_) {
      const double x = x_[k] - mean_x;
      const double y = y_[k] - mean_y;
      xx.add(weight_[k] * x * x);
      xy.add(weight_[k] * x * y);
      yy.add(weight_[k] * y * y);
    }
    const LeastAxis axis = leastAxis(xx.value(), xy.value(), yy.value());
    line = {axis.x, axis.y, axis.x * mean_x + axis.y * mean_y};
  }
  return line.rho < 0.0 ? Line{-line.nx, -line.ny, -line.rho} : line;
}

/// Posts in use that lie near to a line, in their order.
void LineFinder::collectNear(const Line& line, double half) {
  is_near_.resize(used_.size());
  markNear(line, x_.data(), y_.data(), used_.size(), half, is_near_.data());
  listWhere(is_near_, 1, 1, &near_);
}

/// Enough columns, and somewhere a dense enough stretch of them.
bool LineFinder::isWall(const Posts& posts, const Line& line) {
  std::size_t columns = 0;
  along_.clear();
  for (std::size_t k = 0; k < near_.size(); ++k) {
    const std::size_t at = near_[k];
    const auto column = [&](std::size_t of) { return posts.column[used_[near_[of]]]; };
    columns += k == 0 || column(k) != column(k - 1) ? 1U : 0U;
    along_.push_back(line.nx * y_[at] - line.ny * x_[at]);
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
                       const ColumnDirections& directions, const UpwardView& view,
                       double widening) {
  lines_ = lines.size();
  half_ = kLineHalf * widening;
  columns_ = directions.count();
  seen_.assign(lines_ * columns_, 0);
  near_.assign(lines_ * columns_, 0);
  full_.assign(lines_ * columns_, 0);
  tall_.assign(lines_, 0);
  reach_.resize(lines_ * columns_);
  nx_ = lines.nx;
  ny_ = lines.ny;
  windows_.find(lines, directions, kAround * half_, half_);
  for (std::size_t line = 0; line < lines_; ++line) {
    lines.reach(line, directions.middle, &reach_[line * columns_]);
    countReturns(returns, lines[line], line);
    judge(line);
    markNear(line);
    markFull(line, view);
    markTall(line, view);
  }
}

void WallSupport::countReturns(const WallReturns& returns, const Line& line, std::size_t number) {
  own_.assign(columns_, 0);
  around_.assign(columns_, 0);
  low_.assign(columns_, kNowhere);
  high_.assign(columns_, -kNowhere);
  const std::uint32_t *const key = returns.key.data(), *const index = returns.index.data();
  const float *const x = returns.of->points->x.data(), *const y = returns.of->points->y.data();
  const float* const height = returns.of->height.data();
  const Line to = line;
  const double half = half_, around_half = kAround * half_;
  for (std::size_t c = 0; c < columns_; ++c) {
    const RangeWindow window = windows_.of(number, c);
    if (window.isEmpty()) continue;
    const std::size_t end = returns.column_begin[c + 1];
    std::uint32_t own = 0, around = 0;
    float low = kNowhere, high = -kNowhere;
    const std::uint32_t last = WallReturns::lastKeyIn(c, window);
    for (std::size_t k = returns.firstIn(c, window); k < end && key[k] <= last; ++k) {
      const std::uint32_t i = index[k];
      const double off = to.distance(x[i], y[i]);
      around += off < around_half ? 1U : 0U;
      if (!(off < half)) continue;
      ++own;
      low = std::min(low, height[i]);
      high = std::max(high, height[i]);
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

/// Marks the columns in which a line is seen and some to either side of each.
void WallSupport::markNear(std::size_t line) {
  wide_.assign(columns_ + 2 * kFootColumns, 0);
  const std::uint8_t* const is_seen = seen(line);
  for (std::size_t c = 0; c < columns_; ++c) {
    if (is_seen[c] == 0) continue;
    const std::size_t first = c;
    while (c < columns_ && is_seen[c] != 0) ++c;
    std::memset(&wide_[first], 1, c - first + 2 * kFootColumns);
  }
  std::uint8_t* const near = &near_[line * columns_];
  std::memcpy(near, &wide_[kFootColumns], columns_);
  for (std::size_t k = 0; k < kFootColumns; ++k) {
    near[columns_ - kFootColumns + k] |= wide_[k];
    near[k] |= wide_[columns_ + kFootColumns + k];
  }
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
