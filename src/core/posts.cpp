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
constexpr std::size_t kRanked = 255;        // returns of a column that are ranked by counting
constexpr std::size_t kRankedAtOnce = 4 * kManyLanes;
constexpr std::int32_t kMiddle = 32768;     // millimetres less this are signed numbers of 16 bits
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

/// Places of some values in ascending order, equal ones as they follow each other. Each is compared
/// with each: of so few that takes less time than to sort them.
/// \param value, rank  with room for some more.
SMOKE_GROUND_MULTIVERSION
void rankFew(const std::int16_t* value, std::size_t size, std::uint32_t* rank) {
  std::array<std::uint8_t, kRanked> equal;  // of those so far, by rank
  std::fill_n(equal.begin(), size, std::uint8_t{0});
  for (std::size_t begin = 0; begin < size; begin += kRankedAtOnce) {
    std::array<ManyShorts, kRankedAtOnce / kManyLanes> at, below{};
    std::memcpy(&at, value + begin, sizeof(at));
    for (std::size_t k = 0; k < size; ++k) {
      const ManyShorts other = ManyShorts{} + value[k];
      for (std::size_t part = 0; part < at.size(); ++part) below[part] -= other < at[part];
    }
    std::array<std::int16_t, kRankedAtOnce> first;
    std::memcpy(first.data(), &below, sizeof(below));
    const std::size_t count = std::min(kRankedAtOnce, size - begin);
    for (std::size_t k = 0; k < count; ++k) {
      const auto place = static_cast<std::size_t>(first[k]);
      rank[begin + k] = static_cast<std::uint32_t>(place + equal[place]++);
    }
  }
}

/// Which of some keys in ascending order have kPostPoints others near, themselves counted.
SMOKE_GROUND_MULTIVERSION
void markNear(const std::uint32_t* key, std::size_t size, std::uint32_t half,
              std::uint8_t* has_near) {
  static_assert(kPostPoints == 4, "written out");
  std::fill_n(has_near, size, std::uint8_t{0});
  // Four in a row lie around one of them if it is near to the first and the last.
  for (std::size_t i = 3; i < size; ++i) has_near[i] |= key[i] - key[i - 3] <= half ? 1 : 0;
  for (std::size_t i = 2; i + 1 < size; ++i) {
    const bool is_near = (key[i] - key[i - 2] <= half) & (key[i + 1] - key[i] <= half);
    has_near[i] |= is_near ? 1 : 0;
  }
  for (std::size_t i = 1; i + 2 < size; ++i) {
    const bool is_near = (key[i] - key[i - 1] <= half) & (key[i + 2] - key[i] <= half);
    has_near[i] |= is_near ? 1 : 0;
  }
  for (std::size_t i = 0; i + 3 < size; ++i) {
    has_near[i] |= key[i + 3] - key[i] <= half ? 1 : 0;
  }
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
  divide(returns, chosen, columns);
  index.resize(chosen.size());
  key.resize(chosen.size());
  for (std::size_t c = 0; c < columns; ++c) sort(c);
  gather(returns);
}

std::size_t WallReturns::firstIn(std::size_t of_column, const RangeWindow& window) const {
  const float* begin = planar.data() + column_begin[of_column];
  const float* end = planar.data() + column_begin[of_column + 1];
  const float* first = std::lower_bound(begin, end, window.lowest - 0.001F);
  return static_cast<std::size_t>(first - planar.data());
}

/// By column, in order within each. Of many in a row the column is the same, or of none.
void WallReturns::divide(const UprightReturns& returns, const std::vector<std::uint32_t>& chosen,
                         std::size_t columns) {
  column_begin.assign(columns + 1, 0);
  const std::uint16_t* const column_of = returns.column.data();
  for (std::size_t k = 0; k < chosen.size();) {
    const std::uint16_t column = column_of[chosen[k]];
    std::uint32_t count = 0;
    for (; k < chosen.size() && column_of[chosen[k]] == column; ++k) ++count;
    column_begin[column + 1U] += count;
  }
  std::partial_sum(column_begin.begin(), column_begin.end(), column_begin.begin());
  next_.assign(column_begin.begin(), column_begin.end());
  chosen_.resize(chosen.size());
  millimetres_.resize(chosen.size() + kRankedAtOnce);
  for (std::size_t k = 0; k < chosen.size();) {
    const std::uint16_t column = column_of[chosen[k]];
    std::uint32_t place = next_[column];
    for (; k < chosen.size() && column_of[chosen[k]] == column; ++k, ++place) {
      chosen_[place] = chosen[k];
      const auto millimetres = static_cast<std::int32_t>(returns.planar[chosen[k]] * 1000.0);
      millimetres_[place] = static_cast<std::int16_t>(millimetres - kMiddle);
    }
    next_[column] = place;
  }
}

/// A column by millimetres, then by their order.
void WallReturns::sort(std::size_t column) {
  const std::size_t begin = column_begin[column], size = column_begin[column + 1] - begin;
  const std::int16_t* const millimetres = millimetres_.data() + begin;
  rank_.resize(size);
  if (size <= kRanked) {
    rankFew(millimetres, size, rank_.data());
  } else {
    rankMany(millimetres, size);
  }
  const auto base = static_cast<std::uint32_t>(column << kColumnShift);
  for (std::size_t k = 0; k < size; ++k) {
    const std::size_t place = begin + rank_[k];
    index[place] = chosen_[begin + k];
    key[place] = base + static_cast<std::uint32_t>(millimetres[k] + kMiddle);
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

void WallReturns::gather(const UprightReturns& returns) {
  const std::size_t n = index.size();
  for (auto* values : {&planar, &height, &x, &y}) values->resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::uint32_t i = index[k];
    planar[k] = returns.planar[i];
    height[k] = returns.height[i];
    x[k] = returns.points->x[i];
    y[k] = returns.points->y[i];
  }
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
  has_near_.resize(key.size());
  markNear(key.data(), key.size(), half_, has_near_.data());
  std::size_t end = 0;
  while (true) {
    const auto first = std::find(has_near_.begin() + static_cast<std::ptrdiff_t>(end),
                                 has_near_.end(), std::uint8_t{1});
    if (first == has_near_.end()) return;
    std::size_t begin = static_cast<std::size_t>(first - has_near_.begin());
    end = begin + 1;
    while (begin > 0 && key[begin] - key[begin - 1] <= half_) --begin;
    while (end < key.size() && key[end] - key[end - 1] <= half_) ++end;
    findDense(key, begin, end);
    addPosts(returns, posts);
  }
}

/// Returns of a stretch, each near to the last, that have enough others near and most of those
/// around.
void PostFinder::findDense(const std::vector<std::uint32_t>& key, std::size_t begin,
                           std::size_t end) {
  dense_.clear();
  std::size_t around_begin = begin, most_end = end;
  while (around_begin > 0 && key[begin] - key[around_begin - 1] <= around_) --around_begin;
  while (most_end < key.size() && key[most_end] - key[end - 1] <= around_) ++most_end;
  const auto is_most = [](std::size_t near, std::size_t around) {
    return static_cast<double>(near) >= kPostShare * static_cast<double>(around);
  };
  const std::size_t most_around = most_end - around_begin;
  if (key[end - 1] - key[begin] <= half_ && is_most(end - begin, most_around)) {
    for (std::size_t i = begin; i < end; ++i) dense_.push_back(static_cast<std::uint32_t>(i));
    return;
  }
  countBefore(key, around_begin, most_end);
  for (std::size_t i = begin; i < end; ++i) {
    const std::size_t near = countWithin(key[i], half_);
    if (near < kPostPoints || !is_most(near, countWithin(key[i], around_))) continue;
    dense_.push_back(static_cast<std::uint32_t>(i));
  }
}

/// How many of some keys lie before each millimetre from the first to the last.
void PostFinder::countBefore(const std::vector<std::uint32_t>& key, std::size_t begin,
                             std::size_t end) {
  first_ = key[begin];
  last_ = key[end - 1];
  before_.assign(last_ - first_ + 2, 0);
  for (std::size_t i = begin; i < end; ++i) ++before_[key[i] - first_ + 1];
  std::partial_sum(before_.begin(), before_.end(), before_.begin());
}

/// How many of these lie so near to one of them.
std::size_t PostFinder::countWithin(std::uint32_t key, std::uint32_t half) const {
  const std::uint32_t up_to = std::min(last_ - key, half), from = std::min(key - first_, half);
  return before_[key + up_to - first_ + 1] - before_[key - from - first_];
}

/// Posts are stretches of dense returns each near to the last.
void PostFinder::addPosts(const WallReturns& returns, Posts* posts) const {
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
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double x = 0.0, y = 0.0, distance = 0.0;
  for (std::size_t k = begin; k < end; ++k) {
    const std::size_t i = dense_[k];
    low = std::min(low, static_cast<double>(returns.height[i]));
    high = std::max(high, static_cast<double>(returns.height[i]));
    x += returns.x[i];
    y += returns.y[i];
    distance += returns.planar[i];
  }
  if (high - low < kPostExtent) return;
  const auto n = static_cast<double>(count);
  posts->column.push_back(static_cast<std::uint16_t>(returns.key[dense_[begin]] >> kColumnShift));
  posts->count.push_back(static_cast<std::uint32_t>(count));
  posts->distance.push_back(distance / n);
  posts->low.push_back(low);
  posts->high.push_back(high);
  posts->x.push_back(x / n);
  posts->y.push_back(y / n);
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
