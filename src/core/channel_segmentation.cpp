#include "smoke_ground_reconstruction/channel_segmentation.hpp"

#include <cmath>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// What Algorithm 4 looks at in two consecutive points of a column.
struct Pair {
  double height_step;      // dz [m]
  double horizontal_step;  // [m], with the sign of the change of planar range
  double first_range;      // [m]
  double range_step;       // [m]
};

/// One surface's tests, put together from the parameters.
struct PairTest {
  AngleWindow angles;
  double max_height_step;  // 0: unlimited
  RangeStepRule range_step;
  double min_range_step;
  double relative_margin;  // 0: off

  bool accepts(const Pair& pair) const {
    return angles.contains(pair.horizontal_step, pair.height_step) && heightHolds(pair) &&
           rangeStepHolds(pair) && marginHolds(pair);
  }

 private:
  bool heightHolds(const Pair& pair) const {
    return max_height_step == 0.0 || std::fabs(pair.height_step) <= max_height_step;
  }
  bool rangeStepHolds(const Pair& pair) const {
    if (range_step == RangeStepRule::kMinimum) return pair.range_step >= min_range_step;
    return range_step == RangeStepRule::kAny || pair.range_step > 0.0;
  }
  bool marginHolds(const Pair& pair) const {
    return relative_margin == 0.0 ||
           std::fabs(pair.range_step) <= relative_margin * pair.first_range;
  }
};

PairTest groundTest(const ChannelSegmentationParams& p) {
  return {AngleWindow::fromDegrees(p.min_ground_angle_deg, p.max_ground_angle_deg),
          p.max_ground_step_height, p.ground_range_step, p.min_range_step,
          p.ground_relative_margin ? p.relative_distance_margin : 0.0};
}

PairTest wallTest(const ChannelSegmentationParams& p) {
  return {AngleWindow::fromDegrees(p.min_wall_angle_deg, p.max_wall_angle_deg),
          p.max_wall_step_height, p.wall_range_step, p.min_range_step,
          p.wall_relative_margin ? p.relative_distance_margin : 0.0};
}

Pair pairOf(const Scan& scan, std::uint32_t a, std::uint32_t b) {
  const double dx = static_cast<double>(scan.x[b]) - static_cast<double>(scan.x[a]);
  const double dy = static_cast<double>(scan.y[b]) - static_cast<double>(scan.y[a]);
  const double dz = static_cast<double>(scan.z[b]) - static_cast<double>(scan.z[a]);
  const double step = std::sqrt(dx * dx + dy * dy);
  const bool recedes = planarRange(scan.x[b], scan.y[b]) < planarRange(scan.x[a], scan.y[a]);
  const double first_range = range(scan.x[a], scan.y[a], scan.z[a]);
  const double second_range = range(scan.x[b], scan.y[b], scan.z[b]);
  return {dz, recedes ? -step : step, first_range, second_range - first_range};
}

/// The point of order[begin, end) nearest to `point`; ties: the first, which has the lower index.
std::uint32_t nearest(const Scan& scan, const ScanColumns& columns, std::uint32_t point,
                      std::size_t begin, std::size_t end) {
  std::uint32_t best = columns.order[begin];
  double best_d2 = INFINITY;
  for (std::size_t k = begin; k < end; ++k) {
    const std::uint32_t other = columns.order[k];
    const double d2 = squaredDistance(scan.x[point], scan.y[point], scan.z[point], scan.x[other],
                                      scan.y[other], scan.z[other]);
    if (d2 < best_d2) {
      best_d2 = d2;
      best = other;
    }
  }
  return best;
}

std::size_t endOfRing(const ScanColumns& columns, std::size_t begin, std::size_t end) {
  std::size_t k = begin;
  while (k < end && columns.rank[k] == columns.rank[begin]) ++k;
  return k;
}

/// Calls visit(first, second) for each pair of a column, the lower ring first.
template <typename Visit>
void forEachPair(const Scan& scan, const ScanColumns& columns, std::size_t column, Visit visit) {
  const std::size_t column_end = columns.column_begin[column + 1];
  std::size_t begin = columns.column_begin[column];
  std::size_t middle = endOfRing(columns, begin, column_end);
  while (middle < column_end) {
    const std::size_t end = endOfRing(columns, middle, column_end);
    for (std::size_t k = begin; k < middle; ++k) {
      visit(columns.order[k], nearest(scan, columns, columns.order[k], middle, end));
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
  std::vector<std::uint8_t> use(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) use[i] = labels[i] == Label::kKept ? 1 : 0;
  const ScanColumns columns(scan, use, columns_, sensor);
  const PairTest ground = groundTest(params_);
  const PairTest wall = wallTest(params_);
  const bool label_first = params_.label_point == LabelPoint::kFirst;

  std::vector<Label> result = labels;
  const auto judge = [&](std::uint32_t first, std::uint32_t second) {
    const Pair pair = pairOf(scan, first, second);
    Label& label = result[label_first ? first : second];
    if (wall.accepts(pair)) {
      label = Label::kWall;
    } else if (label != Label::kWall && ground.accepts(pair)) {
      label = Label::kGround;
    }
  };
  for (std::size_t c = 0; c < columns_.count(); ++c) forEachPair(scan, columns, c, judge);
  return result;
}

}  // namespace smoke_ground_reconstruction
