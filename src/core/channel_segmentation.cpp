#include "smoke_ground_reconstruction/channel_segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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

struct PairTests {
  PairTest ground;
  PairTest wall;

  Label judge(const Point& a, const Point& b) const {
    const Pair pair(a, b);
    if (wall.accepts(pair)) return Label::kWall;
    return ground.accepts(pair) ? Label::kGround : Label::kInvalid;
  }
};

// Single precision errs by less than a quarter of kScreenMargin times what is compared, and by less
// than kLeastMargin where squares underflow.
constexpr float kScreenMargin = 2e-6F;
constexpr float kLeastMargin = 1e-15F;
constexpr double kNoLimit = 1e30;

/// A Pair in single precision, and how far its angle and its ranges may be off.
struct RoughPair {
  float height_step;
  float horizontal_step;  // 0 where its sign is in doubt
  float angle_margin;
  float first_range;
  float range_step;
  float range_margin;
};

/// A PairTest in single precision: knows most pairs that pass and most that fail.
struct Screen {
  float from_cosine, from_sine, to_cosine, to_sine;
  float max_height_step, min_range_step, relative_margin;
  float least_nearness = 0.0F;  // of any pair: a range may have underflown

  explicit Screen(const PairTest& test)
      : from_cosine(static_cast<float>(test.angles.from.cosine)),
        from_sine(static_cast<float>(test.angles.from.sine)),
        to_cosine(static_cast<float>(test.angles.to.cosine)),
        to_sine(static_cast<float>(test.angles.to.sine)),
        max_height_step(limited(test.max_height_step)),
        min_range_step(limited(test.min_range_step)),
        relative_margin(static_cast<float>(test.relative_margin)) {
    if (std::isinf(relative_margin)) {
      relative_margin = 0.0F;
      least_nearness = static_cast<float>(kNoLimit);
    }
    const bool is_half_a_turn =
        from_cosine * to_cosine + from_sine * to_sine < -0.9998F;  // cos 179 deg
    if (is_half_a_turn) from_cosine = to_cosine = NAN;             // knows no angle
  }

  /// An angle clear of both edges of a window is ahead of one of them.
  bool surelyAccepts(const RoughPair& p) const {
    return (beyondFrom(p) > p.angle_margin) & (beforeTo(p) > p.angle_margin) &
           (height(p) > heightMargin(p)) & (receding(p) > recedingMargin(p)) &
           (nearness(p) > nearnessMargin(p));
  }
  bool surelyRefuses(const RoughPair& p) const {
    return (beyondFrom(p) < -p.angle_margin) | (beforeTo(p) < -p.angle_margin) |
           (height(p) < -heightMargin(p)) | (receding(p) < -recedingMargin(p)) |
           (nearness(p) < -nearnessMargin(p));
  }

 private:
  static float limited(double value) {
    return static_cast<float>(std::fmax(std::fmin(value, kNoLimit), -kNoLimit));
  }
  float beyondFrom(const RoughPair& p) const {
    return from_cosine * p.height_step - from_sine * p.horizontal_step;
  }
  float beforeTo(const RoughPair& p) const {
    return to_sine * p.horizontal_step - to_cosine * p.height_step;
  }
  float height(const RoughPair& p) const { return max_height_step - std::fabs(p.height_step); }
  float heightMargin(const RoughPair& p) const {
    return kScreenMargin * (max_height_step + std::fabs(p.height_step)) + kLeastMargin;
  }
  float receding(const RoughPair& p) const { return p.range_step - min_range_step; }
  float recedingMargin(const RoughPair& p) const {
    return p.range_margin + kScreenMargin * std::fabs(min_range_step);
  }
  float nearness(const RoughPair& p) const {
    return (least_nearness + relative_margin * p.first_range) - std::fabs(p.range_step);
  }
  float nearnessMargin(const RoughPair& p) const {
    return p.range_margin + kScreenMargin * (relative_margin * p.first_range);
  }
};

/// Some points, and of each the squared planar range and the range in single precision.
struct RoughPoints {
  Recycled<float> x, y, z, squared_planar, range;

  template <typename Points>
  RoughPoints(const Points& from, const std::vector<std::uint32_t>& order)
      : x(order.size()),
        y(order.size()),
        z(order.size()),
        squared_planar(order.size()),
        range(order.size()) {
    for (std::size_t k = 0; k < order.size(); ++k) {
      x[k] = from.x[order[k]];
      y[k] = from.y[order[k]];
      z[k] = from.z[order[k]];
    }
    for (std::size_t k = 0; k < order.size(); ++k) {
      squared_planar[k] = x[k] * x[k] + y[k] * y[k];
      range[k] = std::sqrt(squared_planar[k] + z[k] * z[k]);
    }
  }
  std::size_t size() const { return x.size(); }
  Point point(std::size_t k) const {
    return {x[k], y[k], z[k], planarRange(x[k], y[k]),
            smoke_ground_reconstruction::range(x[k], y[k], z[k])};
  }
};

/// Where rough points lie from one of them on.
struct RoughLook {
  const float *x, *y, *z, *squared_planar, *range;

  RoughLook(const RoughPoints& points, std::size_t first)
      : x(points.x.data() + first),
        y(points.y.data() + first),
        z(points.z.data() + first),
        squared_planar(points.squared_planar.data() + first),
        range(points.range.data() + first) {}
};

inline RoughPair roughPair(const RoughLook& a, const RoughLook& b, std::size_t k) {
  const float dx = b.x[k] - a.x[k];
  const float dy = b.y[k] - a.y[k];
  const float dz = b.z[k] - a.z[k];
  const float step = std::sqrt(dx * dx + dy * dy);
  const float growth = b.squared_planar[k] - a.squared_planar[k];
  const float growth_margin =
      kScreenMargin * (b.squared_planar[k] + a.squared_planar[k]) + kLeastMargin;
  const bool is_in_doubt = std::fabs(growth) <= growth_margin;
  const float signed_step = growth < 0.0F ? -step : step;
  const float margin = kScreenMargin * (step + std::fabs(dz)) + kLeastMargin;
  const float range_margin = kScreenMargin * (a.range[k] + b.range[k]) + kLeastMargin;
  return {dz,         is_in_doubt ? 0.0F : signed_step, is_in_doubt ? margin + step : margin,
          a.range[k], b.range[k] - a.range[k],          range_margin};
}

/// What a pair says is a Label, kInvalid if nothing, or this, as numbers without branches.
constexpr std::int32_t kInDoubt = -1;
constexpr auto kSaysNothing = static_cast<std::int32_t>(Label::kInvalid);
constexpr auto kSaysGround = static_cast<std::int32_t>(Label::kGround);
constexpr auto kSaysWall = static_cast<std::int32_t>(Label::kWall);

SMOKE_GROUND_MULTIVERSION
void judgePairs(const RoughLook& firsts, const RoughLook& seconds, std::size_t size,
                const Screen& ground_screen, const Screen& wall_screen, std::int32_t* says) {
  const RoughLook a = firsts;
  const RoughLook b = seconds;
  const Screen ground = ground_screen;
  const Screen wall = wall_screen;
  for (std::size_t k = 0; k < size; ++k) {
    const RoughPair pair = roughPair(a, b, k);
    const std::int32_t if_no_wall = ground.surelyAccepts(pair)
                                        ? kSaysGround
                                        : (ground.surelyRefuses(pair) ? kSaysNothing : kInDoubt);
    says[k] =
        wall.surelyAccepts(pair) ? kSaysWall : (wall.surelyRefuses(pair) ? if_no_wall : kInDoubt);
  }
}

/// Of the points [begin, end) the one nearest to a point; ties: the first, which has the lower
/// index in the scan.
std::size_t nearest(const RoughPoints& points, std::size_t point, std::size_t begin,
                    std::size_t end) {
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

constexpr std::size_t kFewNotNext = 32;  // one in so many

/// The points of the columns, and whom each is paired with: itself if nobody.
class Pairs {
 public:
  Pairs(const Scan& scan, const ScanColumns& columns)
      : columns_(columns), points_(scan, columns.order), second_(columns.order.size()) {
    std::iota(second_.begin(), second_.end(), 1U);
    for (std::size_t c = 0; c + 1 < columns.column_begin.size(); ++c) {
      pairColumn(columns.column_begin[c], columns.column_begin[c + 1]);
    }
  }

  const std::vector<std::uint32_t>& second() const { return second_; }

  /// What each point and its second say.
  Recycled<std::int32_t> judged(const PairTests& tests) const {
    Recycled<std::int32_t> says(points_.size());
    if (says.empty()) return says;
    const bool are_few = not_next_ <= points_.size() / kFewNotNext;
    judgeRoughly(Screen(tests.ground), Screen(tests.wall), are_few, &says);
    for (std::size_t k = 0; k < says.size(); ++k) {
      if (second_[k] == k) {
        says[k] = kSaysNothing;
      } else if (says[k] == kInDoubt || (are_few && second_[k] != k + 1)) {
        const Label label = tests.judge(points_.point(k), points_.point(second_[k]));
        says[k] = static_cast<std::int32_t>(label);
      }
    }
    return says;
  }

 private:
  /// \param with_next  every point with the next one, whoever its second is.
  void judgeRoughly(const Screen& ground, const Screen& wall, bool with_next,
                    Recycled<std::int32_t>* says) const {
    const RoughLook firsts(points_, 0);
    if (with_next) {
      return judgePairs(firsts, RoughLook(points_, 1), points_.size() - 1, ground, wall,
                        says->data());
    }
    const RoughPoints seconds(points_, second_);
    judgePairs(firsts, RoughLook(seconds, 0), points_.size(), ground, wall, says->data());
  }

  void pairColumn(std::uint32_t begin, std::uint32_t end) {
    if (begin == end) return;
    bool is_ring_of_more = false;  // than one point
    for (std::size_t k = begin + 1; k < end; ++k) {
      is_ring_of_more |= columns_.rank[k] == columns_.rank[k - 1];
    }
    second_[end - 1] = end - 1;
    if (is_ring_of_more) pairRings(begin, end);
  }

  void pairRings(std::size_t begin, std::size_t column_end) {
    std::size_t middle = endOfRing(begin, column_end);
    while (middle < column_end) {
      const std::size_t end = endOfRing(middle, column_end);
      for (std::size_t k = begin; k < middle; ++k) {
        second_[k] = static_cast<std::uint32_t>(nearest(points_, k, middle, end));
        not_next_ += second_[k] == k + 1 ? 0U : 1U;
      }
      begin = middle;
      middle = end;
    }
    for (std::size_t k = begin; k < column_end; ++k) second_[k] = static_cast<std::uint32_t>(k);
  }

  std::size_t endOfRing(std::size_t begin, std::size_t end) const {
    std::size_t k = begin + 1;
    while (k < end && columns_.rank[k] == columns_.rank[begin]) ++k;
    return k;
  }

  const ScanColumns& columns_;
  RoughPoints points_;
  Recycled<std::uint32_t> second_;
  std::size_t not_next_ = 0;  // seconds other than the next point
};

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
  const Pairs pairs(scan, columns);
  const auto says = pairs.judged({groundTest(params_), wallTest(params_)});
  const bool label_first = params_.label_point == LabelPoint::kFirst;

  std::vector<Label> result = labels;
  for (std::size_t k = 0; k < says.size(); ++k) {
    // Labels as numbers: a wall overrules ground, and both overrule what was only kept.
    Label& label = result[columns.order[label_first ? k : pairs.second()[k]]];
    label = std::max(label, static_cast<Label>(says[k]));
  }
  return result;
}

}  // namespace smoke_ground_reconstruction
