#include "smoke_ground_reconstruction/window_counter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "turn.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kDegree = M_PI / 180.0;
// Buckets only propose candidates: windows are wider than any rounding. Where sine or cosine come
// near to 1, the other one is known to 1e-8 only.
constexpr double kMargin = 1e-6;
constexpr double kRangeMargin = 1e-9;

constexpr int kShells = 10;         // of ranges, each twice as far as the one before
constexpr int kFirstExponent = -2;  // the first shell ends at 2^-2 m, the last begins at 64 m
constexpr std::size_t kChunk = 64;  // points counted before asking whether they are enough

/// Half the window's half angle: few empty looks, few candidates outside the radius.
double bucketAngle(double radius_per_range) {
  const double reach = std::asin(std::min(radius_per_range, 1.0));
  return std::clamp(reach / 2.0, 0.4 * kDegree, 10.0 * kDegree);
}

/// Shell of a range >= 0, which may be infinite.
int shellOf(double range) {
  std::uint64_t bits;
  std::memcpy(&bits, &range, sizeof(bits));
  const int exponent = static_cast<int>(bits >> 52U) - 1023;
  return std::clamp(exponent - kFirstExponent + 1, 0, kShells - 1);
}

int clampedFloor(double value, int below) {
  return static_cast<int>(std::clamp(std::floor(value), 0.0, static_cast<double>(below - 1)));
}

/// How many of the values lie below the limit. Counts in doubles: compilers vectorize that.
std::size_t countBelow(double limit, const double* values, std::size_t size) {
  double below = 0.0;
  for (std::size_t i = 0; i < size; ++i) below += values[i] < limit ? 1.0 : 0.0;
  return static_cast<std::size_t>(below);
}

/// Columns [begin, end) of a row.
struct Columns {
  int begin;
  int end;
};

}  // namespace

/// Where a point lies as seen from the sensor.
struct WindowCounter::Place {
  double range;
  double sine, cosine;  // of the elevation
  double x, y;          // unit vector of the azimuth
  double turn;          // of the azimuth
};

/// The buckets that can hold neighbours of one point.
struct WindowCounter::Window {
  float x, y, z;
  double squared_radius;
  int shell, first_shell, last_shell;
  int row, first_row, last_row;
  std::array<Columns, 3> columns;  // from the point's own on, before it, and across +x
};

WindowCounter::WindowCounter(const Scan& scan, double radius_per_range) : scan_(scan) {
  const double angle = bucketAngle(radius_per_range);
  rows_ = static_cast<int>(std::ceil(2.0 / angle));
  columns_ = static_cast<int>(std::ceil(2.0 * M_PI / angle));
  fillBuckets(bucketOfEachPoint());
}

std::vector<std::uint32_t> WindowCounter::bucketOfEachPoint() const {
  std::vector<std::uint32_t> bucket_of(scan_.size());
  for (std::size_t i = 0; i < scan_.size(); ++i) {
    if (scan_.valid[i] == 0) continue;
    const Place place = placeOf(i);
    const int row = shellOf(place.range) * rows_ + rowOf(place.sine);
    bucket_of[i] = static_cast<std::uint32_t>(row * columns_ + columnOf(place.turn));
  }
  return bucket_of;
}

void WindowCounter::fillBuckets(const std::vector<std::uint32_t>& bucket_of) {
  const auto buckets =
      static_cast<std::size_t>(kShells * rows_) * static_cast<std::size_t>(columns_);
  bucket_begin_.assign(buckets + 1, 0);
  for (std::size_t i = 0; i < scan_.size(); ++i) {
    if (scan_.valid[i] != 0) ++bucket_begin_[bucket_of[i]];
  }
  std::uint32_t points = 0;
  for (std::uint32_t& bucket : bucket_begin_) points = bucket += points;  // now each one's end
  x_.resize(points);
  y_.resize(points);
  z_.resize(points);
  for (std::size_t i = scan_.size(); i-- > 0;) {  // backwards: the end moves to the begin
    if (scan_.valid[i] == 0) continue;
    const std::uint32_t place = --bucket_begin_[bucket_of[i]];
    x_[place] = scan_.x[i];
    y_[place] = scan_.y[i];
    z_[place] = scan_.z[i];
  }
}

int WindowCounter::rowOf(double sine) const {
  return clampedFloor((sine + 1.0) / 2.0 * rows_, rows_);
}

int WindowCounter::columnOf(double turn) const {
  return clampedFloor(turn / kOnceAround * columns_, columns_);
}

const std::uint32_t* WindowCounter::rowBegin(int shell, int row) const {
  return &bucket_begin_[static_cast<std::size_t>(shell * rows_ + row) *
                        static_cast<std::size_t>(columns_)];
}

WindowCounter::Place WindowCounter::placeOf(std::size_t index) const {
  const double x = scan_.x[index];
  const double y = scan_.y[index];
  const double z = scan_.z[index];
  const double planar = planarRange(scan_.x[index], scan_.y[index]);
  const double r = range(scan_.x[index], scan_.y[index], scan_.z[index]);
  if (planar == 0.0) return {r, z / r, 0.0, 1.0, 0.0, 0.0};
  return {r, z / r, planar / r, x / planar, y / planar, turnOf(x, y)};
}

WindowCounter::Window WindowCounter::windowOf(std::size_t index, double squared_radius) const {
  const Place place = placeOf(index);
  const double radius = std::sqrt(squared_radius);
  const double margin = kRangeMargin * (place.range + radius);
  Window window;
  window.x = scan_.x[index];
  window.y = scan_.y[index];
  window.z = scan_.z[index];
  window.squared_radius = squared_radius;
  window.shell = shellOf(place.range);
  window.first_shell = shellOf(std::max(0.0, place.range - radius - margin));
  window.last_shell = shellOf(place.range + radius + margin);
  window.row = rowOf(place.sine);
  limitRows(place, radius / place.range, &window);
  limitColumns(place, radius / place.range, &window);
  return window;
}

/// \param reach  sine of the window's half angle; 1 or more: every direction.
void WindowCounter::limitRows(const Place& place, double reach, Window* window) const {
  window->first_row = 0;
  window->last_row = rows_ - 1;
  if (reach >= 1.0) return;
  const double reach_cosine = std::sqrt(1.0 - reach * reach);
  const bool holds_pole = place.cosine <= reach + kMargin;
  const double middle = place.sine * reach_cosine;
  const double side = place.cosine * reach + kMargin;
  if (!(holds_pole && place.sine <= 0.0)) window->first_row = rowOf(middle - side);
  if (!(holds_pole && place.sine >= 0.0)) window->last_row = rowOf(middle + side);
}

void WindowCounter::limitColumns(const Place& place, double reach, Window* window) const {
  const int own = columnOf(place.turn);
  window->columns = {Columns{own, columns_}, Columns{0, own}, Columns{0, 0}};
  if (place.cosine <= reach + kMargin) return;  // a pole is inside: every azimuth
  const double sine = reach / place.cosine;
  const double cosine = std::sqrt(1.0 - sine * sine);
  double right = turnOf(place.x * cosine + place.y * sine, place.y * cosine - place.x * sine);
  double left = turnOf(place.x * cosine - place.y * sine, place.y * cosine + place.x * sine);
  right -= kMargin;
  left += kMargin;
  if (right > place.turn) right -= kOnceAround;
  if (left < place.turn) left += kOnceAround;
  const double columns_per_turn = columns_ / kOnceAround;
  const int first = static_cast<int>(std::floor(right * columns_per_turn));
  const int last = static_cast<int>(std::floor(left * columns_per_turn));
  if (last - first + 1 >= columns_) return;
  window->columns[0] = {own, std::min(last + 1, columns_)};
  window->columns[1] = {std::max(first, 0), own};
  if (first < 0) window->columns[2] = {first + columns_, columns_};
  if (last >= columns_) window->columns[2] = {0, last + 1 - columns_};
}

std::size_t WindowCounter::count(std::size_t index, double squared_radius,
                                 std::size_t limit) const {
  if (!(squared_radius > 0.0)) return 0;
  return countInWindow(windowOf(index, squared_radius), limit);
}

bool WindowCounter::isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                              std::size_t at_most) const {
  if (!(squared_radius > 0.0)) return false;
  const Window window = windowOf(index, squared_radius);
  const std::size_t most = candidatesIn(window) - 1;  // without the point itself
  if (most <= more_than) return false;
  if (most <= at_most) return countInWindow(window, more_than + 1) > more_than;
  const std::size_t neighbors = countInWindow(window, at_most + 1);
  return neighbors > more_than && neighbors <= at_most;
}

std::size_t WindowCounter::candidatesIn(const Window& window) const {
  std::size_t sum = 0;
  for (int shell = window.first_shell; shell <= window.last_shell; ++shell) {
    for (int row = window.first_row; row <= window.last_row; ++row) {
      const std::uint32_t* begin = rowBegin(shell, row);
      for (const Columns& part : window.columns) sum += begin[part.end] - begin[part.begin];
    }
  }
  return sum;
}

// From the point's own shell and row outwards: the nearest candidates settle most questions.
std::size_t WindowCounter::countInWindow(const Window& window, std::size_t limit) const {
  const std::size_t enough = limit + 1 == 0 ? limit : limit + 1;  // the point finds itself
  std::size_t found = countInShell(window.shell, window, enough);
  for (int shell = window.first_shell; shell <= window.last_shell && found < enough; ++shell) {
    if (shell != window.shell) found += countInShell(shell, window, enough - found);
  }
  return std::min(found - 1, limit);
}

std::size_t WindowCounter::countInShell(int shell, const Window& window, std::size_t enough) const {
  std::size_t found = countInRow(shell, window.row, window, enough);
  const int farthest = std::max(window.row - window.first_row, window.last_row - window.row);
  for (int step = 1; step <= farthest && found < enough; ++step) {
    const int below = window.row - step;
    const int above = window.row + step;
    if (below >= window.first_row) found += countInRow(shell, below, window, enough - found);
    if (above <= window.last_row && found < enough) {
      found += countInRow(shell, above, window, enough - found);
    }
  }
  return found;
}

std::size_t WindowCounter::countInRow(int shell, int row, const Window& window,
                                      std::size_t enough) const {
  const std::uint32_t* begin = rowBegin(shell, row);
  std::size_t found = 0;
  for (const Columns& part : window.columns) {
    if (found >= enough) break;
    found += countInRun(begin[part.begin], begin[part.end], window, enough - found);
  }
  return found;
}

/// Stops soon after `enough`, so the answer may exceed it.
std::size_t WindowCounter::countInRun(std::size_t begin, std::size_t end, const Window& window,
                                      std::size_t enough) const {
  std::array<double, kChunk> d2;
  std::size_t found = 0;
  while (begin < end && found < enough) {
    const std::size_t size = std::min(kChunk, end - begin);
    for (std::size_t i = 0; i < size; ++i) {
      d2[i] = squaredDistance(x_[begin + i], y_[begin + i], z_[begin + i], window.x, window.y,
                              window.z);
    }
    found += countBelow(window.squared_radius, d2.data(), size);
    begin += size;
  }
  return found;
}

}  // namespace smoke_ground_reconstruction
