#include "smoke_ground_reconstruction/window_counter.hpp"

#include <algorithm>
#include <cmath>

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kHalfTurn = M_PI;
constexpr double kTurn = 2.0 * M_PI;
constexpr double kDegree = M_PI / 180.0;
// Buckets only propose candidates: windows are a hair wider than the rounding of atan2 and asin.
constexpr double kAngleMargin = 1e-6;
constexpr double kRangeMargin = 1e-9;

/// A third of the window's half angle: few empty looks, few candidates outside the radius.
double bucketAngle(double radius_per_range) {
  const double reach = std::asin(std::min(radius_per_range, 1.0));
  return std::clamp(reach / 3.0, 0.4 * kDegree, 10.0 * kDegree);
}

int clampedFloor(double value, int below) {
  return std::clamp(static_cast<int>(std::floor(value)), 0, below - 1);
}

}  // namespace

/// The buckets and ranges that can hold neighbours of one point.
struct WindowCounter::Window {
  float x, y, z;
  double squared_radius;
  double nearest, farthest;  // range [m]
  int row, column;           // of the point
  int first_row, last_row;
  int first_column, last_column;  // unwrapped; may lie outside [0, columns)
};

WindowCounter::WindowCounter(const Scan& scan, double radius_per_range)
    : scan_(scan), elevation_(scan.size()), azimuth_(scan.size()) {
  const double angle = bucketAngle(radius_per_range);
  rows_ = static_cast<int>(std::ceil(kHalfTurn / angle));
  columns_ = static_cast<int>(std::ceil(kTurn / angle));
  fillBuckets(rangesAndDirections());
}

std::vector<double> WindowCounter::rangesAndDirections() {
  std::vector<double> ranges(scan_.size());
  for (std::size_t i = 0; i < scan_.size(); ++i) {
    if (scan_.valid[i] == 0) continue;
    const float x = scan_.x[i];
    const float y = scan_.y[i];
    const float z = scan_.z[i];
    ranges[i] = range(x, y, z);
    elevation_[i] = std::atan2(static_cast<double>(z), planarRange(x, y));
    const double azimuth = std::atan2(static_cast<double>(y), static_cast<double>(x));
    azimuth_[i] = azimuth < 0.0 ? azimuth + kTurn : azimuth;
  }
  return ranges;
}

void WindowCounter::fillBuckets(const std::vector<double>& ranges) {
  const auto buckets = static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_);
  bucket_begin_.assign(buckets + 1, 0);
  std::vector<std::uint32_t> bucket_of(scan_.size());
  for (std::size_t i = 0; i < scan_.size(); ++i) {
    if (scan_.valid[i] == 0) continue;
    bucket_of[i] =
        static_cast<std::uint32_t>(rowOf(elevation_[i]) * columns_ + columnOf(azimuth_[i]));
    ++bucket_begin_[bucket_of[i] + 1];
  }
  for (std::size_t b = 0; b < buckets; ++b) bucket_begin_[b + 1] += bucket_begin_[b];
  std::vector<std::uint32_t> next(bucket_begin_.begin(), bucket_begin_.end() - 1);
  std::vector<std::uint32_t> points(bucket_begin_.back());
  for (std::uint32_t i = 0; i < scan_.size(); ++i) {
    if (scan_.valid[i] != 0) points[next[bucket_of[i]]++] = i;
  }
  sortBucketsByRange(ranges, &points);
  copySorted(ranges, points);
}

void WindowCounter::sortBucketsByRange(const std::vector<double>& ranges,
                                       std::vector<std::uint32_t>* points) const {
  for (std::size_t b = 0; b + 1 < bucket_begin_.size(); ++b) {
    std::sort(points->begin() + bucket_begin_[b], points->begin() + bucket_begin_[b + 1],
              [&](std::uint32_t a, std::uint32_t c) { return ranges[a] < ranges[c]; });
  }
}

void WindowCounter::copySorted(const std::vector<double>& ranges,
                               const std::vector<std::uint32_t>& points) {
  x_.reserve(points.size());
  y_.reserve(points.size());
  z_.reserve(points.size());
  range_.reserve(points.size());
  for (const std::uint32_t i : points) {
    x_.push_back(scan_.x[i]);
    y_.push_back(scan_.y[i]);
    z_.push_back(scan_.z[i]);
    range_.push_back(ranges[i]);
  }
}

int WindowCounter::rowOf(double elevation) const {
  return clampedFloor((elevation + kHalfTurn / 2.0) / kHalfTurn * rows_, rows_);
}

int WindowCounter::columnOf(double azimuth) const {
  return clampedFloor(azimuth / kTurn * columns_, columns_);
}

WindowCounter::Window WindowCounter::windowOf(std::size_t index, double squared_radius) const {
  const float x = scan_.x[index];
  const float y = scan_.y[index];
  const float z = scan_.z[index];
  const double r = range(x, y, z);
  const double radius = std::sqrt(squared_radius);
  const double margin = kRangeMargin * (r + radius);
  Window window{x,
                y,
                z,
                squared_radius,
                r - radius - margin,
                r + radius + margin,
                rowOf(elevation_[index]),
                columnOf(azimuth_[index]),
                0,
                rows_ - 1,
                0,
                columns_ - 1};
  if (radius >= r) return window;  // the sensor's origin is inside: every direction
  const double reach = std::asin(radius / r) + kAngleMargin;
  const double elevation = elevation_[index];
  window.first_row = rowOf(elevation - reach);
  window.last_row = rowOf(elevation + reach);
  if (std::fabs(elevation) + reach >= kHalfTurn / 2.0) return window;  // a pole: every azimuth
  const double side =
      std::asin(std::min(1.0, std::sin(reach) / std::cos(elevation))) + kAngleMargin;
  const double columns_per_radian = columns_ / kTurn;
  const int first = static_cast<int>(std::floor((azimuth_[index] - side) * columns_per_radian));
  const int last = static_cast<int>(std::floor((azimuth_[index] + side) * columns_per_radian));
  if (last - first + 1 >= columns_) return window;
  window.first_column = first;
  window.last_column = last;
  return window;
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
  for (int row = window.first_row; row <= window.last_row; ++row) {
    const std::uint32_t* begin = &bucket_begin_[static_cast<std::size_t>(row * columns_)];
    const int wrapped_left = std::min(window.first_column, 0);
    const int wrapped_right = std::max(window.last_column - columns_ + 1, 0);
    const int first = std::max(window.first_column, 0);
    const int last = std::min(window.last_column, columns_ - 1);
    sum += begin[last + 1] - begin[first];
    sum += begin[columns_] - begin[columns_ + wrapped_left];
    sum += begin[wrapped_right] - begin[0];
  }
  return sum;
}

// Rows and columns from the middle outwards: the nearest candidates settle most questions.
std::size_t WindowCounter::countInWindow(const Window& window, std::size_t limit) const {
  const std::size_t enough = limit + 1 == 0 ? limit : limit + 1;  // the point finds itself
  std::size_t found = 0;
  const int farthest_row = std::max(window.row - window.first_row, window.last_row - window.row);
  for (int step = 0; step <= farthest_row && found < enough; ++step) {
    const int below = window.row - step;
    const int above = window.row + step;
    if (below >= window.first_row) found += countInRow(below, window, enough - found);
    if (step > 0 && above <= window.last_row && found < enough) {
      found += countInRow(above, window, enough - found);
    }
  }
  return std::min(found - 1, limit);
}

std::size_t WindowCounter::countInRow(int row, const Window& window, std::size_t enough) const {
  std::size_t found = 0;
  const int farthest =
      std::max(window.column - window.first_column, window.last_column - window.column);
  for (int step = 0; step <= farthest && found < enough; ++step) {
    const int left = window.column - step;
    const int right = window.column + step;
    if (left >= window.first_column) found += countInBucket(row, left, window, enough - found);
    if (step > 0 && right <= window.last_column && found < enough) {
      found += countInBucket(row, right, window, enough - found);
    }
  }
  return found;
}

std::size_t WindowCounter::countInBucket(int row, int column, const Window& window,
                                         std::size_t enough) const {
  const int wrapped =
      column < 0 ? column + columns_ : (column >= columns_ ? column - columns_ : column);
  const auto bucket = static_cast<std::size_t>(row * columns_ + wrapped);
  const std::uint32_t end = bucket_begin_[bucket + 1];
  const auto first = std::lower_bound(range_.begin() + bucket_begin_[bucket], range_.begin() + end,
                                      window.nearest);
  std::size_t found = 0;
  for (auto i = static_cast<std::size_t>(first - range_.begin()); i < end; ++i) {
    if (range_[i] > window.farthest) break;
    const double d2 = squaredDistance(x_[i], y_[i], z_[i], window.x, window.y, window.z);
    if (d2 < window.squared_radius && ++found == enough) break;
  }
  return found;
}

}  // namespace smoke_ground_reconstruction
