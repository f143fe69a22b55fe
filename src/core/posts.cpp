#include "smoke_ground_reconstruction/posts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "lanes.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"
#include "point_loops.hpp"
#include "sample.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::uint32_t kColumnShift = 16;  // a column's millimetres below it
constexpr double kMostMillimetres = (1U << kColumnShift) - 1;
constexpr std::size_t kRanked = 255;  // returns of a column that are ranked by counting
constexpr std::size_t kRankedAtOnce = 4 * kManyLanes;
constexpr std::int32_t kMiddle = 32768;     // millimetres (1 at least) less this have 16 bits
constexpr double kHalf = 25.0;              // a post's returns lie this near to each other [mm]
constexpr double kAround = 120.0;           // what lies this near counts as around [mm]
constexpr std::size_t kToldBy = 3;          // one column in so many tells the spread of walls
constexpr std::size_t kFewestTelling = 8;   // returns in it, and
constexpr std::size_t kFewestColumns = 10;  // columns that tell
constexpr std::size_t kTightest = 20;       // one in so many sees nothing but wall
constexpr double kUsualSpread = 0.025;      // up to which walls are found by the usual widths [m]
constexpr double kWidest = 3.0;             // times these
constexpr double kOnLine = 0.015;        // a post so little behind a line is part of its wall [m]
constexpr double kOnLineSpreads = 1.75;  // or three sigma of the mean of a post's six returns

constexpr double kSlotsPerMetre = 50.0;
constexpr int kSlots = 520;
constexpr int kMetre = 50;                // slots
constexpr std::size_t kLookedAt = 12000;  // returns among which the ceiling is sought, at least
constexpr std::size_t kCeilingPoints = 100;
constexpr double kCeilingShare = 0.2;
constexpr double kCeilingWidth = 0.5;  // it is so wide [m]
constexpr double kWideColumns = 0.25;  // in a share of its columns

constexpr float kNone = std::numeric_limits<float>::infinity();

// A slot below the lowest and one above the highest stay empty.
using Votes = std::array<double, kSlots + 2>;

double ceilingPlace(float height) {
  return (static_cast<double>(height) - CeilingFinder::kLowest) * kSlotsPerMetre;
}

int ceilingSlot(float height) { return static_cast<int>(ceilingPlace(height)); }

/// Which heights have a slot.
SMOKE_GROUND_MULTIVERSION
void markHigh(const float* height, std::size_t size, std::uint8_t* is_high) {
  for (std::size_t k = 0; k < size; ++k) {
    const double at = ceilingPlace(height[k]);
    is_high[k] = (at >= 0.0) & (at < kSlots) ? 1 : 0;
  }
}

/// Width of the narrowest half of some values in ascending order.
std::uint32_t narrowestHalf(const std::uint32_t* value, std::size_t size) {
  const std::size_t half = size / 2;
  std::uint32_t narrowest = value[size - 1] - value[0];
  for (std::size_t i = 0; i + half < size; ++i) {
    narrowest = std::min(narrowest, value[i + half] - value[i]);
  }
  return narrowest;
}

/// What to add to the `k`-th of some values before it is compared with the l-th, at
/// kRankedAtOnce - 1 + l - k: those that precede count as below if they are equal.
constexpr std::array<std::int16_t, 2 * kRankedAtOnce> kLessIfBefore = [] {
  std::array<std::int16_t, 2 * kRankedAtOnce> less{};
  for (std::size_t i = kRankedAtOnce; i < less.size(); ++i) less[i] = -1;
  return less;
}();

/// Ranks of as many values from `begin` on as so many vectors hold.
template <std::size_t kParts>
SMOKE_GROUND_PART void rankPart(const std::int16_t* value, std::size_t size, std::size_t begin,
                                std::uint32_t* rank) {
  std::array<ManyShorts, kParts> at, below{};
  std::memcpy(&at, value + begin, sizeof(at));
  for (std::size_t k = 0; k < size; ++k) {
    const std::size_t lane = std::min(k - std::min(k, begin), kRankedAtOnce - 1);
    const std::size_t from = k < begin ? kRankedAtOnce : kRankedAtOnce - 1 - lane;
    for (std::size_t part = 0; part < kParts; ++part) {
      ManyShorts less;
      std::memcpy(&less, &kLessIfBefore[from + part * kManyLanes], sizeof(less));
      below[part] -= less + value[k] < at[part];
    }
  }
  std::array<std::int16_t, kParts * kManyLanes> places;
  std::memcpy(places.data(), &below, sizeof(below));
  for (const std::int16_t place : places) rank[begin++] = static_cast<std::uint32_t>(place);
}

/// Places of some values in ascending order, equal ones as they follow each other. Each is compared
/// with each: of so few that takes less time than to sort them.
/// \param value, rank  with room for kRankedAtOnce more.
SMOKE_GROUND_MULTIVERSION
void rankFew(const std::int16_t* value, std::size_t size, std::uint32_t* rank) {
  for (std::size_t begin = 0; begin < size; begin += kRankedAtOnce) {
    if (size - begin <= 2 * kManyLanes) {
      rankPart<2>(value, size, begin, rank);
    } else if (size - begin <= 3 * kManyLanes) {
      rankPart<3>(value, size, begin, rank);
    } else {
      rankPart<4>(value, size, begin, rank);
    }
  }
}

/// End of a stretch of keys, each near to the last.
std::size_t endOfStretch(const std::vector<std::uint32_t>& key, std::size_t begin,
                         std::uint32_t half) {
  std::size_t end = begin + 1;
  while (end < key.size() && key[end] - key[end - 1] <= half) ++end;
  return end;
}

/// How many returns near to one of a post there are at least, itself counted, among so many around.
std::size_t fewestNear(std::size_t around) {
  const double share = kPostShare * static_cast<double>(around);
  const auto whole = static_cast<std::size_t>(share);
  return std::max(kPostPoints, whole + (static_cast<double>(whole) < share ? 1 : 0));
}

std::uint32_t keyOf(std::size_t column, float planar) {
  const double millimetres = std::min(std::max(planar * 1000.0, 0.0), kMostMillimetres);
  return static_cast<std::uint32_t>(column << kColumnShift) +
         static_cast<std::uint32_t>(millimetres);
}

int strongestSlot(const Votes& votes, double* around) {
  int strongest = 0;
  *around = -1.0;
  for (int s = 0; s < kSlots; ++s) {
    const auto i = static_cast<std::size_t>(s);
    const double sum = (votes[i] + votes[i + 1]) + votes[i + 2];
    if (sum <= *around) continue;
    *around = sum;
    strongest = s;
  }
  return strongest;
}

}  // namespace

void WallReturns::take(const UprightReturns& returns, const std::vector<std::uint32_t>& chosen,
                       std::size_t columns) {
  of = &returns;
  divide(chosen, columns);
  key.resize(chosen.size());
  index.resize(chosen.size());
  for (std::size_t c = 0; c < columns; ++c) sort(c);
}

std::size_t WallReturns::firstIn(std::size_t of_column, const RangeWindow& window) const {
  const auto begin = key.begin() + column_begin[of_column];
  const auto end = key.begin() + column_begin[of_column + 1];
  const std::uint32_t lowest = firstKeyIn(of_column, window);
  return static_cast<std::size_t>(std::lower_bound(begin, end, lowest) - key.begin());
}

std::uint32_t WallReturns::firstKeyIn(std::size_t of_column, const RangeWindow& window) {
  return keyOf(of_column, window.lowest);
}

std::uint32_t WallReturns::lastKeyIn(std::size_t of_column, const RangeWindow& window) {
  return keyOf(of_column, window.highest);
}

/// By column, in order within each. Of many in a row the column is the same, or of none.
void WallReturns::divide(const std::vector<std::uint32_t>& chosen, std::size_t columns) {
  column_begin.assign(columns + 1, 0);
  const std::uint16_t* const column_of = of->column.data();
  for (std::size_t k = 0; k < chosen.size();) {
    const std::uint16_t column = column_of[chosen[k]];
    std::uint32_t count = 0;
    for (; k < chosen.size() && column_of[chosen[k]] == column; ++k) ++count;
    column_begin[column + 1U] += count;
  }
  const std::uint32_t most = *std::max_element(column_begin.begin(), column_begin.end());
  rank_.resize(most + kRankedAtOnce);
  std::partial_sum(column_begin.begin(), column_begin.end(), column_begin.begin());
  next_.assign(column_begin.begin(), column_begin.end());
  chosen_.resize(chosen.size());
  millimetres_.resize(chosen.size() + kRankedAtOnce);
  placeEach(chosen);
}

/// Each at the next place of its column.
void WallReturns::placeEach(const std::vector<std::uint32_t>& chosen) {
  const std::uint16_t* const column_of = of->column.data();
  const float* const planar = of->planar.data();
  std::uint32_t* const to_chosen = chosen_.data();
  std::int16_t* const to_millimetres = millimetres_.data();
  for (std::size_t k = 0; k < chosen.size();) {
    const std::uint16_t column = column_of[chosen[k]];
    std::uint32_t at = next_[column];
    for (; k < chosen.size() && column_of[chosen[k]] == column; ++k, ++at) {
      const auto millimetres = static_cast<std::int32_t>(planar[chosen[k]] * 1000.0);
      to_chosen[at] = chosen[k];
      to_millimetres[at] = static_cast<std::int16_t>(millimetres - kMiddle);
    }
    next_[column] = at;
  }
}

/// A column by millimetres, then by their order.
void WallReturns::sort(std::size_t column) {
  const std::uint32_t begin = column_begin[column], size = column_begin[column + 1] - begin;
  const std::int16_t* const millimetres = millimetres_.data() + begin;
  std::uint32_t* const rank = rank_.data();
  if (size <= kRanked) {
    rankFew(millimetres, size, rank);
  } else {
    rankMany(millimetres, size);
  }
  const auto base = static_cast<std::uint32_t>((column << kColumnShift) + kMiddle);
  const std::uint32_t* const chosen = chosen_.data() + begin;
  std::uint32_t *const to_key = key.data() + begin, *const to_index = index.data() + begin;
  for (std::uint32_t k = 0; k < size; ++k) {
    to_key[rank[k]] = base + static_cast<std::uint32_t>(std::int32_t{millimetres[k]});
    to_index[rank[k]] = chosen[k];
  }
}

void WallReturns::rankMany(const std::int16_t* millimetres, std::size_t size) {
  order_.resize(size);
  std::iota(order_.begin(), order_.end(), 0U);
  std::sort(order_.begin(), order_.end(), [millimetres](std::uint32_t a, std::uint32_t b) {
    return millimetres[a] != millimetres[b] ? millimetres[a] < millimetres[b] : a < b;
  });
  for (std::uint32_t k = 0; k < size; ++k) rank_[order_[k]] = k;
}

void Posts::clear() {
  column.clear();
  count.clear();
  for (auto* values : {&distance, &low, &high, &x, &y}) values->clear();
}

double SpreadFinder::find(const WallReturns& returns) {
  widths_.clear();
  for (std::size_t c = 0; c + 1 < returns.column_begin.size(); c += kToldBy) {
    const std::size_t begin = returns.column_begin[c];
    const std::size_t count = returns.column_begin[c + 1] - begin;
    if (count < kFewestTelling) continue;
    widths_.push_back(narrowestHalf(returns.key.data() + begin, count));
  }
  if (widths_.size() < kFewestColumns) return 0.0;
  const auto tight = widths_.begin() + static_cast<std::ptrdiff_t>(widths_.size() / kTightest);
  std::nth_element(widths_.begin(), tight, widths_.end());
  return static_cast<double>(*tight) * 0.001;
}

double wideningFor(double spread) {
  return std::min(std::max(1.0, spread / kUsualSpread), kWidest);
}

double onLineFor(double spread) { return std::max(kOnLine, kOnLineSpreads * spread); }

void PostFinder::find(const WallReturns& returns, double widening, Posts* posts) {
  posts->clear();
  half_ = static_cast<std::uint32_t>(kHalf * widening);
  around_ = static_cast<std::uint32_t>(kAround * widening);
  const std::vector<std::uint32_t>& key = returns.key;
  for (std::size_t begin = 0, end = 0; begin < key.size(); begin = end) {
    end = endOfStretch(key, begin, half_);
    if (end - begin < kPostPoints) continue;
    findDense(key, begin, end);
    addPosts(returns, posts);
  }
}

/// Returns of a stretch, each near to the last, that have enough others near and most of those
/// around.
void PostFinder::findDense(const std::vector<std::uint32_t>& key, std::size_t begin,
                           std::size_t end) {
  std::size_t around_begin = begin, around_end = end;
  while (around_begin > 0 && key[begin] - key[around_begin - 1] <= around_) --around_begin;
  while (around_end < key.size() && key[around_end] - key[end - 1] <= around_) ++around_end;
  const bool is_all_around = key[around_end - 1] - key[around_begin] <= around_;
  std::size_t fewest = fewestNear(around_end - around_begin);
  if (is_all_around && key[end - 1] - key[begin] <= 2 * half_) {
    keepMiddle(key, begin, end, fewest);
    return;
  }
  dense_.resize(end - begin);
  std::size_t near_begin = begin, last_around = begin, count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    while (key[i] - key[near_begin] > half_) ++near_begin;
    if (!is_all_around) {
      while (key[i] - key[around_begin] > around_) ++around_begin;
      while (last_around < around_end && key[last_around] <= key[i] + around_) ++last_around;
      fewest = fewestNear(last_around - around_begin);
    }
    // Enough are near if the last of so many is.
    const std::size_t last = near_begin + fewest - 1;
    dense_[count] = static_cast<std::uint32_t>(i);
    count += last < end && key[last] <= key[i] + half_ ? 1U : 0U;
  }
  dense_.resize(count);
}

/// Where the same lies around all of a stretch, and the nearer half of it near to its ends: between
/// the first and the last return that have `fewest` near.
void PostFinder::keepMiddle(const std::vector<std::uint32_t>& key, std::size_t begin,
                            std::size_t end, std::size_t fewest) {
  dense_.clear();
  if (end - begin < fewest) return;
  const std::uint32_t first = key[begin + fewest - 1], last = key[end - fewest];
  while (begin < end && key[begin] + half_ < first) ++begin;
  while (begin < end && key[end - 1] > last + half_) --end;
  dense_.resize(end - begin);
  std::iota(dense_.begin(), dense_.end(), static_cast<std::uint32_t>(begin));
}

/// Posts are stretches of dense returns each near to the last.
void PostFinder::addPosts(const WallReturns& returns, Posts* posts) const {
  if (dense_.empty()) return;
  const bool is_whole = dense_.back() - dense_.front() < dense_.size();  // of one stretch
  if (is_whole) return addPost(returns, 0, dense_.size(), posts);
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= dense_.size(); ++i) {
    const bool goes_on =
        i < dense_.size() && returns.key[dense_[i]] - returns.key[dense_[i - 1]] <= half_;
    if (goes_on) continue;
    addPost(returns, begin, i, posts);
    begin = i;
  }
}

void PostFinder::addPost(const WallReturns& returns, std::size_t begin, std::size_t end,
                         Posts* posts) const {
  const std::size_t count = end - begin;
  if (count < kPostPoints) return;
  const float *const x = returns.of->points->x.data(), *const y = returns.of->points->y.data();
  const float *const planar = returns.of->planar.data(), *const height = returns.of->height.data();
  float low = kNone, high = -kNone;
  double sum_x = 0.0, sum_y = 0.0, distance = 0.0;
  for (std::size_t k = begin; k < end; ++k) {
    const std::uint32_t i = returns.index[dense_[k]];
    low = std::min(low, height[i]);
    high = std::max(high, height[i]);
    sum_x += x[i];
    sum_y += y[i];
    distance += planar[i];
  }
  if (static_cast<double>(high) - static_cast<double>(low) < kPostExtent) return;
  const auto n = static_cast<double>(count);
  posts->column.push_back(static_cast<std::uint16_t>(returns.key[dense_[begin]] >> kColumnShift));
  posts->count.push_back(static_cast<std::uint32_t>(count));
  posts->distance.push_back(distance / n);
  posts->low.push_back(low);
  posts->high.push_back(high);
  posts->x.push_back(sum_x / n);
  posts->y.push_back(sum_y / n);
}

double CeilingFinder::find(const UprightReturns& returns, std::size_t columns) {
  const Sample some(returns.size(), kLookedAt), all(returns.size(), returns.size());
  const double found = findAmong(returns, some, columns);
  if (found < kNone || some.size() == all.size()) return found;
  return findAmong(returns, all, columns);  // a ceiling of which little is seen
}

double CeilingFinder::findAmong(const UprightReturns& returns, const Sample& sample,
                                std::size_t columns) {
  collectHigh(returns, sample);
  const std::size_t count = high_.size();
  Votes votes{};
  for (std::size_t k = 0; k < count; ++k) {
    votes[static_cast<std::size_t>(slot_[k]) + 1] += returns.planar[high_[k]];
  }
  if (count < kCeilingPoints) return kNone;
  double around = 0.0;
  const int at = strongestSlot(votes, &around);
  OrderedSum above;
  for (auto s = static_cast<std::size_t>(std::max(0, at - kMetre) + 1); s < votes.size(); ++s) {
    above.add(votes[s]);
  }
  if (around < kCeilingShare * above.value()) return kNone;
  nearest_.assign(columns, kNone);
  farthest_.assign(columns, 0.0F);
  OrderedSum sum;
  for (std::size_t k = 0; k < count; ++k) {
    if (std::abs(slot_[k] - at) >= 2) continue;
    const std::uint32_t i = high_[k];
    const std::uint16_t column = returns.column[i];
    sum.add(returns.height[i]);
    nearest_[column] = std::min(nearest_[column], returns.planar[i]);
    farthest_[column] = std::max(farthest_[column], returns.planar[i]);
  }
  if (sum.count() < kCeilingPoints || !isWide()) return kNone;
  return sum.value() / static_cast<double>(sum.count());
}

/// Returns of a sample that are high enough to be ceiling.
void CeilingFinder::collectHigh(const UprightReturns& returns, const Sample& sample) {
  const std::size_t size = sample.size();
  height_.resize(size);
  is_high_.resize(size);
  for (std::size_t k = 0; k < size; ++k) height_[k] = returns.height[sample[k]];
  markHigh(height_.data(), size, is_high_.data());
  listWhere(is_high_, 1, 1, &high_);
  slot_.resize(high_.size());
  for (std::size_t k = 0; k < high_.size(); ++k) {
    slot_[k] = ceilingSlot(height_[high_[k]]);
    high_[k] = static_cast<std::uint32_t>(sample[high_[k]]);
  }
}

/// Do a share of the columns show the level over some width?
bool CeilingFinder::isWide() const {
  std::size_t wide = 0;
  std::size_t seen = 0;
  for (std::size_t c = 0; c < farthest_.size(); ++c) {
    const double width = static_cast<double>(farthest_[c]) - static_cast<double>(nearest_[c]);
    wide += width >= kCeilingWidth ? 1U : 0U;
    seen += farthest_[c] > 0.0F ? 1U : 0U;
  }
  return static_cast<double>(wide) >= kWideColumns * static_cast<double>(seen);
}

}  // namespace smoke_ground_reconstruction
