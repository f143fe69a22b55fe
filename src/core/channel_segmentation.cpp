#include "smoke_ground_reconstruction/channel_segmentation.hpp"

#include <cmath>
#include <limits>

#include "multiversion.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// A point, in the precision of the decisions, and what two of its coordinates make.
struct Point {
  double x, y, z;
  double planar_range;
  double range;
};

/// What Algorithm 4 looks at in two consecutive points of a column.
struct Pair {
  double height_step;      // dz [m]
  double horizontal_step;  // [m], with the sign of the change of planar range
  double first_range;      // [m]
  double range_step;       // [m]

  Pair(const Point& a, const Point& b)
      : height_step(b.z - a.z), first_range(a.range), range_step(b.range - a.range) {
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    const double step = std::sqrt(dx * dx + dy * dy);
    horizontal_step = b.planar_range < a.planar_range ? -step : step;
  }
};

/// One surface's tests, put together from the parameters; those that are off hold for every pair.
struct PairTest {
  AngleWindow angles;
  double max_height_step;
  double min_range_step;
  double relative_margin;

  bool accepts(const Pair& pair) const {
    const bool is_in_window = angles.contains(pair.horizontal_step, pair.height_step);
    const bool is_low = std::fabs(pair.height_step) <= max_height_step;
    const bool recedes = pair.range_step >= min_range_step;
    const bool is_near = std::fabs(pair.range_step) <= relative_margin * pair.first_range;
    return is_in_window & is_low & recedes & is_near;  // no branches: the loop vectorizes
  }
};

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

double leastRangeStep(RangeStepRule rule, double min_range_step) {
  if (rule == RangeStepRule::kMinimum) return min_range_step;
  return rule == RangeStepRule::kAny ? -kUnlimited : std::numeric_limits<double>::denorm_min();
}

PairTest groundTest(const ChannelSegmentationParams& p) {
  return {AngleWindow::fromDegrees(p.min_ground_angle_deg, p.max_ground_angle_deg),
          p.max_ground_step_height == 0.0 ? kUnlimited : p.max_ground_step_height,
          leastRangeStep(p.ground_range_step, p.min_range_step),
          p.ground_relative_margin ? p.relative_distance_margin : kUnlimited};
}

PairTest wallTest(const ChannelSegmentationParams& p) {
  return {AngleWindow::fromDegrees(p.min_wall_angle_deg, p.max_wall_angle_deg),
          p.max_wall_step_height == 0.0 ? kUnlimited : p.max_wall_step_height,
          leastRangeStep(p.wall_range_step, p.min_range_step),
          p.wall_relative_margin ? p.relative_distance_margin : kUnlimited};
}

/// What a pair says: numbers that loops can compute without branches.
constexpr std::int32_t kSaysGround = 1;
constexpr std::int32_t kSaysWall = 2;

struct PairTests {
  PairTest ground;
  PairTest wall;

  std::int32_t judge(const Point& a, const Point& b) const {
    const Pair pair(a, b);
    return (ground.accepts(pair) ? kSaysGround : 0) | (wall.accepts(pair) ? kSaysWall : 0);
  }
};

/// The points of the columns in their order.
struct Sorted {
  Recycled<float> x, y, z;
  Recycled<double> planar_range, range;
  Recycled<std::int32_t> says;  ///< what each point and the next one say

  Sorted(const Scan& scan, const std::vector<std::uint32_t>& order)
      : x(order.size()),
        y(order.size()),
        z(order.size()),
        planar_range(order.size()),
        range(order.size()),
        says(order.size()) {
    for (std::size_t k = 0; k < order.size(); ++k) {
      x[k] = scan.x[order[k]];
      y[k] = scan.y[order[k]];
      z[k] = scan.z[order[k]];
    }
  }
  Point point(std::size_t k) const { return {x[k], y[k], z[k], planar_range[k], range[k]}; }
};

SMOKE_GROUND_MULTIVERSION
void findRanges(const float* x, const float* y, const float* z, std::size_t size,
                double* planar_range, double* whole_range) {
  for (std::size_t k = 0; k < size; ++k) {
    planar_range[k] = planarRange(x[k], y[k]);
    whole_range[k] = range(x[k], y[k], z[k]);
  }
}

SMOKE_GROUND_MULTIVERSION
void judgeNeighbors(const float* x, const float* y, const float* z, const double* planar_range,
                    const double* whole_range, std::size_t size, const PairTests& given,
                    std::int32_t* says) {
  const PairTests tests = given;
  for (std::size_t k = 0; k < size; ++k) {
    says[k] = tests.judge({x[k], y[k], z[k], planar_range[k], whole_range[k]},
                          {x[k + 1], y[k + 1], z[k + 1], planar_range[k + 1], whole_range[k + 1]});
  }
}

Sorted sortedPoints(const Scan& scan, const ScanColumns& columns, const PairTests& tests) {
  Sorted points(scan, columns.order);
  const std::size_t size = points.x.size();
  findRanges(points.x.data(), points.y.data(), points.z.data(), size, points.planar_range.data(),
             points.range.data());
  judgeNeighbors(points.x.data(), points.y.data(), points.z.data(), points.planar_range.data(),
                 points.range.data(), size == 0 ? 0 : size - 1, tests, points.says.data());
  return points;
}

/// Of the points [begin, end) the one nearest to a point; ties: the first, which has the lower
/// index in the scan.
std::size_t nearest(const Sorted& points, std::size_t point, std::size_t begin, std::size_t end) {
  std::size_t best = begin;
  double best_d2 = INFINITY;
  for (std::size_t k = begin; k < end; ++k) {
    const double d2 = squaredDistance(points.x[point], points.y[point], points.z[point],
                                      points.x[k], points.y[k], points.z[k]);
    if (d2 < best_d2) {
      best_d2 = d2;
      best = k;
    }
  }
  return best;
}

std::size_t endOfRing(const ScanColumns& columns, std::size_t begin, std::size_t end) {
  std::size_t k = begin + 1;
  while (k < end && columns.rank[k] == columns.rank[begin]) ++k;
  return k;
}

/// Calls visit(first, second) for each pair of a column, the lower ring first.
template <typename Visit>
void forEachPair(const Sorted& points, const ScanColumns& columns, std::size_t column,
                 Visit visit) {
  const std::size_t column_end = columns.column_begin[column + 1];
  std::size_t begin = columns.column_begin[column];
  if (begin == column_end) return;
  std::size_t middle = endOfRing(columns, begin, column_end);
  while (middle < column_end) {
    const std::size_t end = endOfRing(columns, middle, column_end);
    for (std::size_t k = begin; k < middle; ++k) {
      visit(k, end == middle + 1 ? middle : nearest(points, k, middle, end));
    }
    begin = middle;
    middle = end;
  }
}

void requireWindow(const std::string& name, double from_deg, double to_deg) {
  require(from_deg >= -180.0 && from_deg <= to_deg, "min_" + name,
          "at least -180 and at most max_" + name, from_deg);
  require(to_deg <= 180.0 && to_deg - from_deg < 180.0, "max_" + name,
          "at most 180 and less than 180 above min_" + name, to_deg);
}

}  // namespace

void ChannelSegmentationParams::validate() const {
  require(dividesCircle(column_width_deg), "column_width_deg", kCircleDivisor, column_width_deg);
  requireWindow("ground_angle_deg", min_ground_angle_deg, max_ground_angle_deg);
  requireWindow("wall_angle_deg", min_wall_angle_deg, max_wall_angle_deg);
  require(max_ground_step_height >= 0.0, "max_ground_step_height", ">= 0", max_ground_step_height);
  require(max_wall_step_height >= 0.0, "max_wall_step_height", ">= 0", max_wall_step_height);
  require(min_range_step >= 0.0, "min_range_step", ">= 0", min_range_step);
  require(relative_distance_margin > 0.0, "relative_distance_margin", "> 0",
          relative_distance_margin);
}

ChannelSegmentation::ChannelSegmentation(const ChannelSegmentationParams& params)
    : params_(validated(params)), columns_(params.column_width_deg) {}

std::vector<Label> ChannelSegmentation::classify(const Scan& scan, const std::vector<Label>& labels,
                                                 const SensorModel& sensor) const {
  Recycled<std::uint8_t> use(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) use[i] = labels[i] == Label::kKept ? 1 : 0;
  const ScanColumns columns(scan, use, columns_, sensor);
  const PairTests tests = {groundTest(params_), wallTest(params_)};
  const Sorted points = sortedPoints(scan, columns, tests);
  const bool label_first = params_.label_point == LabelPoint::kFirst;

  std::vector<Label> result = labels;
  const auto judge = [&](std::size_t first, std::size_t second) {
    const std::int32_t says = second == first + 1
                                  ? points.says[first]
                                  : tests.judge(points.point(first), points.point(second));
    Label& label = result[columns.order[label_first ? first : second]];
    if ((says & kSaysWall) != 0) {
      label = Label::kWall;
    } else if (label != Label::kWall && says != 0) {
      label = Label::kGround;
    }
  };
  for (std::size_t c = 0; c < columns_.count(); ++c) forEachPair(points, columns, c, judge);
  return result;
}

}  // namespace smoke_ground_reconstruction
