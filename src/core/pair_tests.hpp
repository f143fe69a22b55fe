#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "lanes.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

// The tests of Algorithm 4 on two points: in double precision, which decides, and in single
// precision, which knows most of the answers.

/// A point, in the precision of the decisions, and what two of its coordinates make.
struct Point {
  double x, y, z;
  double planar_range;
  double range;

  Point(float px, float py, float pz)
      : x(px),
        y(py),
        z(pz),
        planar_range(planarRange(px, py)),
        range(smoke_ground_reconstruction::range(px, py, pz)) {}
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

/// The tests of both surfaces.
struct PairTests {
  PairTest ground;
  PairTest wall;

  explicit PairTests(const ChannelSegmentationParams& params);

  Label judge(const Point& a, const Point& b) const {
    const Pair pair(a, b);
    if (wall.accepts(pair)) return Label::kWall;
    return ground.accepts(pair) ? Label::kGround : Label::kInvalid;
  }
};

// Single precision errs by less than kScreenMargin times what is compared, ranges and squared
// planar ranges, and by less than kLeastMargin where squares underflow.
constexpr float kScreenMargin = 1e-6F;
constexpr float kLeastMargin = 1e-15F;
constexpr float kNoLimit = 1e30F;

/// Points in single precision.
struct RoughPoints {
  Floats x, y, z;
  Floats squared_planar;  // squared planar range
  Floats range;
};

SMOKE_GROUND_PART RoughPoints roughPoints(const Floats& x, const Floats& y, const Floats& z) {
  const Floats squared_planar = x * x + y * y;
  return {x, y, z, squared_planar, rootOf(squared_planar + z * z)};
}

/// Pairs in single precision; a margin that is no number: one of the two is no point.
struct RoughPairs {
  Floats height_step;
  Floats horizontal_step;  // 0 where its sign is in doubt
  Floats first_range;
  Floats range_step;
  Floats margin;  // by which whatever is compared may be off
};

SMOKE_GROUND_PART RoughPairs roughPairs(const RoughPoints& a, const RoughPoints& b) {
  const Floats dx = b.x - a.x;
  const Floats dy = b.y - a.y;
  const Floats step = rootOf(dx * dx + dy * dy);
  const Floats growth = b.squared_planar - a.squared_planar;
  const Floats ranges = a.range + b.range;
  const Floats margin = kScreenMargin * ranges + kLeastMargin;
  const Ints is_in_doubt = magnitudeOf(growth) <= margin * ranges;
  const Floats unsure = is_in_doubt ? step : Floats{};
  return {b.z - a.z, withSignOf(growth, step - unsure), a.range, b.range - a.range,
          margin + unsure};
}

/// A PairTest in single precision: knows of most pairs whether they pass.
class Screen {
 public:
  explicit Screen(const PairTest& test)
      : from_cosine_(static_cast<float>(test.angles.from.cosine)),
        from_sine_(static_cast<float>(test.angles.from.sine)),
        to_cosine_(static_cast<float>(test.angles.to.cosine)),
        to_sine_(static_cast<float>(test.angles.to.sine)),
        height_(limited(test.max_height_step)),
        receding_(limited(test.min_range_step)),
        nearness_(test.relative_margin == kUnlimited ? 0.0F : limited(test.relative_margin)),
        least_nearness_(test.relative_margin == kUnlimited ? kNoLimit : 0.0F) {
    constexpr float kCosine179 = -0.9998F;
    const bool is_half_a_turn = from_cosine_ * to_cosine_ + from_sine_ * to_sine_ < kCosine179;
    if (is_half_a_turn) from_cosine_ = from_sine_ = to_cosine_ = to_sine_ = 0.0F;  // never sure
  }

  /// How far pairs keep away from the nearest of all limits [m]; less than none beyond it.
  /// An angle clear of both edges of a window is ahead of one of them.
  SMOKE_GROUND_PART Floats clearance(const RoughPairs& p) const {
    const Floats beyond_from = from_cosine_ * p.height_step - from_sine_ * p.horizontal_step;
    const Floats before_to = to_sine_ * p.horizontal_step - to_cosine_ * p.height_step;
    Floats clearance = least(beyond_from, before_to);
    clearance = least(clearance, height_ - magnitudeOf(p.height_step));
    clearance = least(clearance, p.range_step - receding_);
    const Floats near = nearness_ * p.first_range + least_nearness_;
    return least(clearance, near - magnitudeOf(p.range_step));
  }

 private:
  static float limited(double value) {
    return static_cast<float>(std::fmax(std::fmin(value, double{kNoLimit}), -double{kNoLimit}));
  }

  float from_cosine_, from_sine_, to_cosine_, to_sine_;
  float height_, receding_, nearness_;
  float least_nearness_;  // of any pair: a range may have underflown
};

/// What a pair says is a Label, kInvalid if nothing, or this.
constexpr std::int32_t kInDoubt = -1;
constexpr auto kSaysNothing = static_cast<std::int32_t>(Label::kInvalid);
constexpr auto kSaysGround = static_cast<std::int32_t>(Label::kGround);
constexpr auto kSaysWall = static_cast<std::int32_t>(Label::kWall);

/// The PairTests in single precision.
struct Screens {
  Screen ground;
  Screen wall;

  explicit Screens(const PairTests& tests) : ground(tests.ground), wall(tests.wall) {}

  SMOKE_GROUND_PART Ints judge(const RoughPairs& pairs) const {
    static_assert(kInDoubt == -1, "where a comparison holds");
    const Floats of_ground = ground.clearance(pairs);
    const Floats of_wall = wall.clearance(pairs);
    const Ints if_refused = of_ground > -pairs.margin;
    const Ints if_no_wall = of_ground > pairs.margin ? Ints{} + kSaysGround : if_refused;
    const Ints if_not_accepted = if_no_wall | (of_wall > -pairs.margin);
    return of_wall > pairs.margin ? Ints{} + kSaysWall : if_not_accepted;
  }
};

}  // namespace smoke_ground_reconstruction
