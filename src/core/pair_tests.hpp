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

// Single precision errs by less than a quarter of kScreenMargin times what is compared, and by less
// than kLeastMargin where squares underflow.
constexpr float kScreenMargin = 2e-6F;
constexpr float kLeastMargin = 1e-15F;
constexpr double kNoLimit = 1e30;

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

/// Pairs in single precision, and how far their angles and ranges may be off.
struct RoughPairs {
  Floats height_step;
  Floats horizontal_step;  // 0 where its sign is in doubt
  Floats angle_margin;
  Floats first_range;
  Floats range_step;
  Floats range_margin;
};

SMOKE_GROUND_PART RoughPairs roughPairs(const RoughPoints& a, const RoughPoints& b) {
  const Floats dx = b.x - a.x;
  const Floats dy = b.y - a.y;
  const Floats dz = b.z - a.z;
  const Floats step = rootOf(dx * dx + dy * dy);
  const Floats growth = b.squared_planar - a.squared_planar;
  const Floats growth_margin = kScreenMargin * (b.squared_planar + a.squared_planar) + kLeastMargin;
  const Floats none = {};
  const Ints is_in_doubt = magnitudeOf(growth) <= growth_margin;
  const Floats signed_step = growth < 0.0F ? -step : step;
  const Floats margin = kScreenMargin * (step + magnitudeOf(dz)) + kLeastMargin;
  return {dz,
          is_in_doubt ? none : signed_step,
          is_in_doubt ? margin + step : margin,
          a.range,
          b.range - a.range,
          kScreenMargin * (a.range + b.range) + kLeastMargin};
}

/// A PairTest in single precision: knows most pairs that pass and most that fail.
class Screen {
 public:
  explicit Screen(const PairTest& test)
      : from_cosine_(static_cast<float>(test.angles.from.cosine)),
        from_sine_(static_cast<float>(test.angles.from.sine)),
        to_cosine_(static_cast<float>(test.angles.to.cosine)),
        to_sine_(static_cast<float>(test.angles.to.sine)),
        height_(limited(test.max_height_step)),
        receding_(limited(test.min_range_step)),
        nearness_(test.relative_margin == kUnlimited ? around(0.0) : around(test.relative_margin)),
        least_nearness_(test.relative_margin == kUnlimited ? static_cast<float>(kNoLimit) : 0.0F) {
    const bool is_half_a_turn =
        from_cosine_ * to_cosine_ + from_sine_ * to_sine_ < -0.9998F;  // cos 179 deg
    if (is_half_a_turn) from_cosine_ = to_cosine_ = NAN;               // knows no angle
  }

  /// An angle clear of both edges of a window is ahead of one of them.
  SMOKE_GROUND_PART Ints surelyAccepts(const RoughPairs& p) const {
    return (beyondFrom(p) > p.angle_margin) & (beforeTo(p) > p.angle_margin) &
           (magnitudeOf(p.height_step) < height_.surely_below) &
           (p.range_step - p.range_margin > receding_.surely_above) &
           (nearness_.surely_below * p.first_range + least_nearness_ >
            magnitudeOf(p.range_step) + p.range_margin);
  }
  SMOKE_GROUND_PART Ints surelyRefuses(const RoughPairs& p) const {
    return (beyondFrom(p) < -p.angle_margin) | (beforeTo(p) < -p.angle_margin) |
           (magnitudeOf(p.height_step) > height_.surely_above) |
           (p.range_step + p.range_margin < receding_.surely_below) |
           (nearness_.surely_above * p.first_range + least_nearness_ <
            magnitudeOf(p.range_step) - p.range_margin);
  }

 private:
  /// A limit, with margins for itself and for what is compared with it.
  struct Limit {
    float surely_below, surely_above;
  };
  static Limit around(double value) {
    const double margin = 2.0 * kScreenMargin * std::fabs(value) + kLeastMargin;
    return {static_cast<float>(value - margin), static_cast<float>(value + margin)};
  }
  static Limit limited(double value) {
    return around(std::fmax(std::fmin(value, kNoLimit), -kNoLimit));
  }
  SMOKE_GROUND_PART Floats beyondFrom(const RoughPairs& p) const {
    return from_cosine_ * p.height_step - from_sine_ * p.horizontal_step;
  }
  SMOKE_GROUND_PART Floats beforeTo(const RoughPairs& p) const {
    return to_sine_ * p.horizontal_step - to_cosine_ * p.height_step;
  }

  float from_cosine_, from_sine_, to_cosine_, to_sine_;
  Limit height_, receding_, nearness_;
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
    const Ints in_doubt = Ints{} + kInDoubt;
    const Ints if_refused = ground.surelyRefuses(pairs) ? Ints{} + kSaysNothing : in_doubt;
    const Ints if_no_wall = ground.surelyAccepts(pairs) ? Ints{} + kSaysGround : if_refused;
    const Ints if_not_accepted = wall.surelyRefuses(pairs) ? if_no_wall : in_doubt;
    return wall.surelyAccepts(pairs) ? Ints{} + kSaysWall : if_not_accepted;
  }
};

}  // namespace smoke_ground_reconstruction
