#include "smoke_ground_reconstruction/window_counter.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "azimuth.hpp"
#include "multiversion.hpp"
#include "neighbor_screen.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "window_tallies.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kDegree = M_PI / 180.0;
// Buckets only propose candidates: windows are wider than any rounding of the points' directions,
// which are known in single precision.
constexpr double kAngleMargin = 2.0 * kAzimuthError + 1e-5;
constexpr double kRangeMargin = 1e-5;  // relative
constexpr int kPartsPerRow = 4;        // of the table of reaches

constexpr float kLeastSquaredRange = 1e-24F;  // nearer points have no direction [m^2]

constexpr std::uint32_t kPadding = 8;  // places before the first and after the last point
constexpr int kMostBuckets = 1 << 18;  // more cost more to clear than they save
constexpr int kColumnsPerRow = 2;      // a row of buckets is as high as so many are wide
constexpr int kWidestGroup = 2 * kColumnsPerRow;  // columns from first to last of eight queries

// Shells of range, each farther by the square root of 2: by the exponent of squared ranges.
constexpr int kMostShells = 20;
constexpr unsigned kExponentBit = 23;
constexpr int kFirstExponent = 127 - 4;  // the second shell begins at 2^-2 m

/// Where points lie as seen from the sensor, in rows and columns of buckets.
struct Raster {
  float rows_per_sine;
  float columns_per_radian;
  float rows;
  float columns;
  int shells;
};

Raster rasterOf(int rows, int columns, int shells) {
  return {static_cast<float>(rows) / 2.0F, static_cast<float>(columns / kTwoPi),
          static_cast<float>(rows), static_cast<float>(columns), shells};
}

inline float clampedFloor(float value, float below) {
  const float positive = value > 0.0F ? value : 0.0F;  // NaN becomes 0 as well
  const float inside = positive < below - 1.0F ? positive : below - 1.0F;
  return static_cast<float>(static_cast<std::int32_t>(inside));
}

inline std::int32_t shellOfSquare(float squared_range, std::int32_t shells) {
  std::int32_t bits;
  std::memcpy(&bits, &squared_range, sizeof(bits));
  const std::int32_t shell = (bits >> kExponentBit) - kFirstExponent + 1;
  const std::int32_t positive = shell > 0 ? shell : 0;
  return positive < shells ? positive : shells - 1;
}

inline float rowAt(float z, float squared_range, const Raster& raster) {
  return (z / std::sqrt(squared_range) + 1.0F) * raster.rows_per_sine;
}

/// Buckets of points, garbage ones included, as if all had a direction: numbers below 2^24, which
/// floats hold exactly. Returns whether some have none.
SMOKE_GROUND_MULTIVERSION
bool findBuckets(const float* x, const float* y, const float* z, std::size_t size, const Raster& to,
                 std::uint32_t* bucket) {
  const Raster raster = to;
  std::int32_t are_near = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const float squared_range = squaredRangeOf(x[i], y[i], z[i]);
    const float row = clampedFloor(rowAt(z[i], squared_range, raster), raster.rows);
    const float column =
        clampedFloor(azimuthOf(x[i], y[i]) * raster.columns_per_radian, raster.columns);
    const auto shell = static_cast<float>(shellOfSquare(squared_range, raster.shells));
    const float place = (shell * raster.rows + row) * raster.columns + column;
    bucket[i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(place));
    are_near |= squared_range < kLeastSquaredRange ? 1 : 0;
  }
  return are_near != 0;
}

}  // namespace

struct WindowCounter::Queries : LaneQueries {
  using LaneQueries::LaneQueries;
};

/// A point's place in the raster.
struct WindowCounter::Spot {
  float squared_range;
  float sine;    // of the elevation
  float row;     // not rounded
  float column;  // not rounded
  bool is_near;  // without direction
};

WindowCounter::WindowCounter(const Scan& scan, double radius_per_range)
    : NeighborCounter(scan), radius_per_range_(radius_per_range) {
  chooseBuckets();
  fillBuckets();
}

/// Rows a third of the window's half angle high, and a hair more, so that a window reaches three
/// beyond its own and not four: few empty looks, few candidates outside the radius. Not less than
/// some points high, so that those beside each other in a row are neighbours, too.
void WindowCounter::chooseBuckets() {
  const double half_angle = std::asin(std::min(radius_per_range_, 1.0)) + 2.0 * kAngleMargin;
  const double angle = std::clamp(half_angle / 3.0, 1.25 * kDegree, 10.0 * kDegree);
  rows_ = static_cast<int>(2.0 / (angle + 2.0 * kSineMargin));
  columns_ = static_cast<int>(kColumnsPerRow * kTwoPi / angle);
  shells_ = kMostShells * rows_ * columns_ <= kMostBuckets ? kMostShells : 1;
  const int parts = kPartsPerRow * rows_;
  reaches_.reserve(static_cast<std::size_t>(parts));
  for (int part = 0; part < parts; ++part) {
    reaches_.push_back(
        reachOf(2.0 * part / parts - 1.0, 2.0 * (part + 1) / parts - 1.0, radius_per_range_));
  }
}

void WindowCounter::fillBuckets() {
  const Raster raster = rasterOf(rows_, columns_, shells_);
  Recycled<std::uint32_t> bucket(scan_.size());
  const bool are_near = findBuckets(scan_.x.data(), scan_.y.data(), scan_.z.data(), scan_.size(),
                                    raster, bucket.data());
  const auto buckets = static_cast<std::size_t>(shells_) * static_cast<std::size_t>(rows_) *
                       static_cast<std::size_t>(columns_);
  bucket_begin_.assign(buckets + 2, 0);  // one more for the points without direction
  for (std::size_t i = 0; are_near && i < scan_.size(); ++i) {
    const float squared_range = squaredRangeOf(scan_.x[i], scan_.y[i], scan_.z[i]);
    if (squared_range < kLeastSquaredRange) bucket[i] = static_cast<std::uint32_t>(buckets);
  }
  for (std::size_t i = 0; i < scan_.size(); ++i) {
    // What is no return comes behind all others, where nobody looks: no branches.
    bucket[i] = scan_.valid[i] != 0 ? bucket[i] : static_cast<std::uint32_t>(buckets + 1);
    ++bucket_begin_[bucket[i]];
  }
  std::uint32_t end = kPadding;
  for (std::uint32_t& begin : bucket_begin_) begin = end += begin;  // now each one's end
  sortPoints(bucket);
}

void WindowCounter::sortPoints(const std::vector<std::uint32_t>& bucket) {
  const std::size_t size = scan_.size();
  for (auto* values : {&x_, &y_, &z_}) values->resize(size + 2 * kPadding + kLanes);
  place_.resize(size);
  for (std::size_t i = size; i-- > 0;) {  // backwards: the end moves to the begin
    const std::uint32_t place = --bucket_begin_[bucket[i]];
    place_[i] = place;
    x_[place] = scan_.x[i];
    y_[place] = scan_.y[i];
    z_[place] = scan_.z[i];
  }
  for (auto* values : {&x_, &y_, &z_}) {
    std::fill_n(values->begin(), kPadding, NAN);
    std::fill(values->begin() + bucket_begin_.back(), values->end(), NAN);
  }
}

const std::uint32_t* WindowCounter::rowBegin(int shell, int row) const {
  return &bucket_begin_[static_cast<std::size_t>(shell * rows_ + row) *
                        static_cast<std::size_t>(columns_)];
}

/// \param radius_per_range  sine of the window's half angle; 1 or more: every direction.
WindowCounter::Reach WindowCounter::reachOf(double lowest_sine, double highest_sine,
                                            double radius_per_range) const {
  const auto all_columns = static_cast<float>(columns_);
  if (radius_per_range >= 1.0) return {0, rows_ - 1, all_columns};
  const auto row_of = [&](double sine) {
    return std::clamp(static_cast<int>((sine + 1.0) / 2.0 * rows_), 0, rows_ - 1);
  };
  constexpr double kUpright = M_PI / 2.0;
  const double angle = std::asin(radius_per_range) + kAngleMargin;
  const double lowest = std::asin(std::max(-1.0, lowest_sine - kSineMargin));
  const double highest = std::asin(std::min(1.0, highest_sine + kSineMargin));
  const double steepest = std::max(-lowest, highest);
  Reach reach{0, rows_ - 1, all_columns};
  if (lowest - angle > -kUpright) {
    reach.first_row = row_of(std::sin(lowest - angle) - kSineMargin);
  }
  if (highest + angle < kUpright) reach.last_row = row_of(std::sin(highest + angle) + kSineMargin);
  if (steepest + angle < kUpright - 1e-3) {  // no pole inside
    const double to_the_side = std::asin(std::sin(angle) / std::cos(steepest)) + kAngleMargin;
    reach.columns = static_cast<float>(to_the_side * columns_ / kTwoPi);
  }
  return reach;
}

WindowCounter::Reach WindowCounter::reachOf(const Spot& spot, double radius_per_range) const {
  if (radius_per_range > radius_per_range_) return reachOf(spot.sine, spot.sine, radius_per_range);
  const int parts = kPartsPerRow * rows_;
  const int part = std::clamp(static_cast<int>(kPartsPerRow * spot.row), 0, parts - 1);
  return reaches_[static_cast<std::size_t>(part)];
}

WindowCounter::Spot WindowCounter::spotOf(std::size_t index) const {
  const float x = scan_.x[index];
  const float y = scan_.y[index];
  const float z = scan_.z[index];
  const Raster raster = rasterOf(rows_, columns_, shells_);
  const float squared_range = squaredRangeOf(x, y, z);
  const float sine = z / std::sqrt(squared_range);
  const float column = azimuthOf(x, y) * raster.columns_per_radian;
  return {squared_range, sine, rowAt(z, squared_range, raster),
          column >= 0.0F ? column : 0.0F,  // on the axis it is no number
          squared_range < kLeastSquaredRange};
}

/// Shell of a point that is some times as far as one of that squared range.
int WindowCounter::shellAt(float squared_range, double times) const {
  return shellOfSquare(static_cast<float>(squared_range * times * times), shells_);
}

/// Runs of places that can hold neighbours: the own shell and row first, then outwards.
void WindowCounter::collectRuns(std::size_t index, double radius_per_range,
                                std::vector<Run>* runs) const {
  runs->clear();
  const Spot spot = spotOf(index);
  const auto last_bucket = bucket_begin_.end() - 2;
  if (spot.is_near) {
    runs->push_back({bucket_begin_.front(), bucket_begin_.back()});
    return;
  }
  const Reach reach = reachOf(spot, radius_per_range);
  const int own = shellAt(spot.squared_range, 1.0);
  const int first =
      shellAt(spot.squared_range, std::max(0.0, 1.0 - radius_per_range) * (1.0 - kRangeMargin));
  const int last = shellAt(spot.squared_range, (1.0 + radius_per_range) * (1.0 + kRangeMargin));
  const int row = static_cast<int>(spot.row);
  collectShell(own, row, spot.column, reach, runs);
  for (int shell = first; shell <= last; ++shell) {
    if (shell != own) collectShell(shell, row, spot.column, reach, runs);
  }
  if (last_bucket[0] < last_bucket[1]) runs->push_back({last_bucket[0], last_bucket[1]});
}

/// Runs of places that can hold neighbours of queries of one row of buckets.
void WindowCounter::collectRuns(const Queries& queries, const Reach& reach, double radius_per_range,
                                std::vector<Run>* runs) const {
  runs->clear();
  const double nearest = std::max(0.0, 1.0 - radius_per_range) * (1.0 - kRangeMargin);
  const double farthest = (1.0 + radius_per_range) * (1.0 + kRangeMargin);
  const int first = shellAt(queries.least_square, nearest);
  const int last = shellAt(queries.greatest_square, farthest);
  const float middle = 0.5F * static_cast<float>(queries.first_column + queries.last_column + 1);
  const float to_the_side =
      reach.columns + 0.5F * static_cast<float>(queries.last_column + 1 - queries.first_column);
  collectShell(queries.shell, queries.row, middle, {reach.first_row, reach.last_row, to_the_side},
               runs);
  for (int shell = first; shell <= last; ++shell) {
    if (shell == queries.shell) continue;
    collectShell(shell, queries.row, middle, {reach.first_row, reach.last_row, to_the_side}, runs);
  }
  const auto last_bucket = bucket_begin_.end() - 2;
  if (last_bucket[0] < last_bucket[1]) runs->push_back({last_bucket[0], last_bucket[1]});
}

void WindowCounter::collectShell(int shell, int row, float column, const Reach& reach,
                                 std::vector<Run>* runs) const {
  const int own = std::clamp(row, reach.first_row, reach.last_row);
  collectRow(shell, own, column, reach.columns, runs);
  const int farthest = std::max(own - reach.first_row, reach.last_row - own);
  for (int step = 1; step <= farthest; ++step) {
    if (own - step >= reach.first_row) collectRow(shell, own - step, column, reach.columns, runs);
    if (own + step <= reach.last_row) collectRow(shell, own + step, column, reach.columns, runs);
  }
}

/// Calls part(first, end) for the columns around one, across +x as well.
template <typename Part>
void WindowCounter::forEachPart(float column, float to_the_side, const Part& part) const {
  if (2.0F * to_the_side + 2.0F >= static_cast<float>(columns_)) return part(0, columns_);
  // From one turn further: casts round towards zero.
  const int first =
      static_cast<int>(column - to_the_side + static_cast<float>(columns_)) - columns_;
  const int last = static_cast<int>(column + to_the_side);
  part(std::max(first, 0), std::min(last + 1, columns_));
  if (first < 0) part(first + columns_, columns_);
  if (last >= columns_) part(0, last + 1 - columns_);
}

void WindowCounter::collectRow(int shell, int row, float column, float columns,
                               std::vector<Run>* runs) const {
  const std::uint32_t* begin = rowBegin(shell, row);
  forEachPart(column, columns, [&](int from, int to) {
    if (begin[from] < begin[to]) runs->push_back({begin[from], begin[to]});
  });
}

std::size_t WindowCounter::countRuns(std::size_t index, double squared_radius,
                                     const std::vector<Run>& runs, std::size_t limit) const {
  const std::size_t enough = limit + 1 == 0 ? limit : limit + 1;  // the point finds itself
  const float x = scan_.x[index];
  const float y = scan_.y[index];
  const float z = scan_.z[index];
  const BallScreen screen = screenOf(x, y, z, squared_radius);
  const Tally found =
      tally(x_.data(), y_.data(), z_.data(), runs.data(), runs.size(), screen, enough);
  if (found.surely >= enough) return limit;
  if (found.surely == found.possibly) return found.surely - 1;
  std::size_t exactly = 0;
  for (const Run& run : runs) {
    for (std::uint32_t at = run.begin; at < run.end && exactly < enough; ++at) {
      exactly += squaredDistance(x_[at], y_[at], z_[at], x, y, z) < squared_radius ? 1U : 0U;
    }
  }
  return exactly - 1;
}

std::size_t WindowCounter::count(std::size_t index, double squared_radius,
                                 std::size_t limit) const {
  if (!(squared_radius > 0.0)) return 0;
  Recycled<Run> runs;
  collectRuns(index, radiusPerRange(index, squared_radius), &runs);
  return countRuns(index, squared_radius, runs, limit);
}

bool WindowCounter::isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                              std::size_t at_most) const {
  if (!(squared_radius > 0.0)) return false;
  Recycled<Run> runs;
  collectRuns(index, radiusPerRange(index, squared_radius), &runs);
  return isBetween(index, squared_radius, more_than, at_most, runs);
}

double WindowCounter::radiusPerRange(std::size_t index, double squared_radius) const {
  const double r = range(scan_.x[index], scan_.y[index], scan_.z[index]);
  return std::sqrt(squared_radius) / r * (1.0 + 1e-9);
}

bool WindowCounter::isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                              std::size_t at_most, const std::vector<Run>& runs) const {
  std::size_t candidates = 0;
  for (const Run& run : runs) candidates += run.end - run.begin;
  const std::size_t most = candidates - 1;  // without the point itself
  if (most <= more_than) return false;
  if (most <= at_most) return countRuns(index, squared_radius, runs, more_than + 1) > more_than;
  const std::size_t neighbors = countRuns(index, squared_radius, runs, at_most + 1);
  return neighbors > more_than && neighbors <= at_most;
}

/// Points that find enough neighbours beside them are not asked; the others of a row of buckets are
/// answered eight at a time, and the few that single precision cannot answer one by one.
void WindowCounter::findOutsiders(const std::vector<std::uint32_t>& points, const Crowd& crowd,
                                  std::vector<std::uint32_t>* outsiders) const {
  outsiders->clear();
  Recycled<Answer> answers;
  const bool are_all = points.size() == bucket_begin_.back() - kPadding;
  answers.assign(bucket_begin_.back(), are_all ? Answer::kAsked : Answer::kInside);
  for (std::size_t k = 0; !are_all && k < points.size(); ++k) {
    answers[place_[points[k]]] = Answer::kAsked;
  }
  answerBeside(crowd, &answers);
  answerAsked(crowd, &answers);
  const auto is_outside = [&](std::uint32_t i) {
    return !isBetween(i, squaredRadius(i, crowd.radius_per_range), crowd.more_than, crowd.at_most);
  };
  outsiders->resize(points.size());
  std::uint32_t* next = outsiders->data();
  for (const std::uint32_t i : points) {  // no branches but for few
    const Answer answer = answers[place_[i]];
    *next = i;
    next += answer == Answer::kOutside || (answer == Answer::kAsked && is_outside(i)) ? 1 : 0;
  }
  outsiders->resize(static_cast<std::size_t>(next - outsiders->data()));
}

/// Answers the queries of points that find more than enough beside them.
void WindowCounter::answerBeside(const Crowd& crowd, std::vector<Answer>* answers) const {
  const std::uint32_t end = bucket_begin_.back();
  if (crowd.more_than >= 2 * kAlongRow || crowd.at_most < end) return;
  const double squared = crowd.radius_per_range * crowd.radius_per_range;
  Recycled<std::int32_t> is_crowded(end + kLanes);
  findCrowded(x_.data(), y_.data(), z_.data(), kPadding, end,
              static_cast<float>(squared * (1.0 - 4.0 * kScreenMargin)),
              static_cast<std::int32_t>(crowd.more_than), is_crowded.data());
  for (std::uint32_t at = kPadding; at < end; ++at) {
    (*answers)[at] = is_crowded[at] != 0 ? Answer::kInside : (*answers)[at];
  }
}

void WindowCounter::answerAsked(const Crowd& crowd, std::vector<Answer>* answers) const {
  Recycled<Reach> reaches;  // by row
  for (int row = 0; row < rows_; ++row) {
    reaches.push_back(
        reachOf(2.0 * row / rows_ - 1.0, 2.0 * (row + 1) / rows_ - 1.0, crowd.radius_per_range));
  }
  Recycled<std::uint32_t> asked;
  listAsked(*answers, &asked);
  const std::uint32_t* next = asked.data();
  for (int shell = 0; shell < shells_; ++shell) {
    for (int row = 0; row < rows_; ++row) {
      const Reach& reach = reaches[static_cast<std::size_t>(row)];
      next = answerRow(shell, row, reach, crowd, next, answers);
    }
  }
}

/// The asked places in their order, and a last one behind all. No branches: smoke decides which.
void WindowCounter::listAsked(const std::vector<Answer>& answers,
                              std::vector<std::uint32_t>* asked) const {
  asked->resize(answers.size() + 1);
  std::uint32_t* next = asked->data();
  const auto end = static_cast<std::uint32_t>(answers.size());
  for (std::uint32_t at = kPadding; at < end; ++at) {
    *next = at;
    next += answers[at] == Answer::kAsked ? 1 : 0;
  }
  *next = end;
}

/// \param asked  the first asked place of the row, or behind it.
/// \return the first one behind the row.
const std::uint32_t* WindowCounter::answerRow(int shell, int row, const Reach& reach,
                                              const Crowd& crowd, const std::uint32_t* asked,
                                              std::vector<Answer>* answers) const {
  const double squared = crowd.radius_per_range * crowd.radius_per_range;
  const std::uint32_t* begin = rowBegin(shell, row);
  Queries queries(shell, row);
  Recycled<Run> runs;
  int column = 0;
  for (; *asked < begin[columns_]; ++asked) {
    while (begin[column + 1] <= *asked) ++column;
    const bool is_far = queries.size > 0 && column - queries.first_column > kWidestGroup;
    if (is_far) answer(reach, crowd, &runs, &queries, answers);
    queries.add(*asked, column, x_.data(), y_.data(), z_.data(), squared);
    if (queries.size == kLanes) answer(reach, crowd, &runs, &queries, answers);
  }
  if (queries.size > 0) answer(reach, crowd, &runs, &queries, answers);
  return asked;
}

void WindowCounter::answer(const Reach& reach, const Crowd& crowd, std::vector<Run>* runs,
                           Queries* queries, std::vector<Answer>* answers) const {
  collectRuns(*queries, reach, crowd.radius_per_range, runs);
  std::size_t candidates = 0;
  for (const Run& run : *runs) candidates += run.end - run.begin;
  // A point finds itself, too.
  const std::size_t enough = std::min(crowd.more_than, candidates) + 2;
  const std::size_t most = std::min(crowd.at_most, candidates) + 1;
  Tallies tallies;
  const bool are_inside =
      tallyTogether(x_.data(), y_.data(), z_.data(), runs->data(), runs->size(), *queries,
                    static_cast<std::int32_t>(enough), static_cast<std::int32_t>(most),
                    static_cast<std::int32_t>(candidates), &tallies);
  for (std::uint32_t lane = 0; lane < queries->size; ++lane) {
    Answer& answer = (*answers)[queries->place[lane]];
    const auto surely = static_cast<std::size_t>(tallies[0][lane]);
    const auto possibly = static_cast<std::size_t>(tallies[1][lane]);
    if (are_inside || (surely >= enough && possibly <= most)) {
      answer = Answer::kInside;
    } else if (possibly < enough || surely > most) {
      answer = Answer::kOutside;
    }
  }
  queries->size = 0;
}

}  // namespace smoke_ground_reconstruction
