#include "raster_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kWidth = ScanRaster::kWidth;
constexpr std::size_t kAtOnce = 1024;  // points

/// Where the rows of a raster begin in a stripe, from the lowest beam to the highest.
using Rows = std::vector<std::size_t>;

SMOKE_GROUND_PART RoughPoints merged(const Ints& is_new, const RoughPoints& now,
                                     const RoughPoints& last) {
  return {is_new ? now.x : last.x, is_new ? now.y : last.y, is_new ? now.z : last.z,
          is_new ? now.squared_planar : last.squared_planar, is_new ? now.range : last.range};
}

/// The coordinates by place.
struct Places {
  const float *x, *y, *z;

  explicit Places(const ScanRaster& raster)
      : x(raster.x.data()), y(raster.y.data()), z(raster.z.data()) {}

  SMOKE_GROUND_PART RoughPoints load(std::size_t at) const {
    return roughPoints(loadLanes(x + at), loadLanes(y + at), loadLanes(z + at));
  }
};

SMOKE_GROUND_PART void put(const Ints& verdict, std::int8_t* says) {
  const Bytes said = bytesOf(verdict);
  std::memcpy(says, &said, sizeof(said));
}

/// What the points of eight columns say, each with the one before it in its column.
/// \param first  their place in row 0.
/// \param is_downwards  the one before is the upper of the two.
SMOKE_GROUND_PART void judgeColumns(const ScanRaster& raster, const Rows& rows, std::size_t first,
                                    bool is_downwards, const Screens& screens, std::int8_t* says) {
  const Floats nobody = Floats{} + NAN;
  RoughPoints last = roughPoints(nobody, nobody, nobody);
  const Places places(raster);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::size_t at = first + rows[is_downwards ? rows.size() - 1 - k : k];
    const RoughPoints now = places.load(at);
    put(screens.judge(is_downwards ? roughPairs(now, last) : roughPairs(last, now)), says + at);
    last = merged(now.x == now.x, now, last);
  }
}

/// The two points of a place, of eight columns.
struct TwoPoints {
  RoughPoints a, b;
};

/// Which of two points is the nearest to one: `is_b`, else a.
struct Choice {
  Ints is_b, is_doubt;
};

SMOKE_GROUND_PART Choice nearestTo(const RoughPoints& p, const TwoPoints& of) {
  const auto square = [&](const RoughPoints& q) {
    const Floats dx = p.x - q.x, dy = p.y - q.y, dz = p.z - q.z;
    return (dx * dx + dy * dy) + dz * dz;
  };
  const Floats to_a = square(of.a), to_b = square(of.b);
  const Floats margin = kScreenMargin * (to_a + to_b) + kLeastMargin;
  const Ints is_b = to_b < to_a - margin;
  const Ints is_a = (to_b > to_a + margin) | (of.b.x != of.b.x);
  const Ints are_one = (of.a.x == of.b.x) & (of.a.y == of.b.y) & (of.a.z == of.b.z);
  return {is_b, ~(is_a | is_b | are_one)};
}

/// What pairs of a lower and the nearest upper point say, and whether they chose the upper b.
struct Verdicts {
  Ints verdict, is_b;
};

SMOKE_GROUND_PART Verdicts judgeNearest(const RoughPoints& first, const TwoPoints& seconds,
                                        const Screens& screens) {
  const Choice choice = nearestTo(first, seconds);
  const Ints is_pair = (first.x == first.x) & (seconds.a.x == seconds.a.x);
  const RoughPoints second = merged(choice.is_b, seconds.b, seconds.a);
  const Ints in_doubt = Ints{} + kInDoubt;
  const Ints verdict = choice.is_doubt ? in_doubt : screens.judge(roughPairs(first, second));
  return {verdict & is_pair, choice.is_b};
}

/// The greatest of two verdicts, in doubt if one is.
SMOKE_GROUND_PART Ints strongest(const Ints& one, const Ints& other) {
  return (one > other ? one : other) | ((one < 0) | (other < 0));
}

/// What the pairs of two rows say of the points of the first, or of the second.
struct TwoVerdicts {
  Ints a, b;
};

SMOKE_GROUND_PART TwoVerdicts judgeRows(const TwoPoints& firsts, const TwoPoints& seconds,
                                        bool of_firsts, const Screens& screens) {
  const Verdicts a = judgeNearest(firsts.a, seconds, screens);
  const Verdicts b = judgeNearest(firsts.b, seconds, screens);
  if (of_firsts) return {a.verdict, b.verdict};
  // One that is in doubt, maybe of its second, puts both seconds in doubt.
  const Ints of_a =
      strongest(a.verdict & (~a.is_b | (a.verdict < 0)), b.verdict & (~b.is_b | (b.verdict < 0)));
  const Ints of_b =
      strongest(a.verdict & (a.is_b | (a.verdict < 0)), b.verdict & (b.is_b | (b.verdict < 0)));
  return {of_a, of_b & (seconds.b.x == seconds.b.x)};
}

/// judgeColumns() with two layers.
SMOKE_GROUND_PART void judgeLayers(const ScanRaster& raster, const Rows& rows, std::size_t first,
                                   bool is_downwards, const Screens& screens, std::int8_t* says) {
  const Floats nobody = Floats{} + NAN;
  TwoPoints last = {roughPoints(nobody, nobody, nobody), roughPoints(nobody, nobody, nobody)};
  const Places places(raster);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::size_t at = first + rows[is_downwards ? rows.size() - 1 - k : k];
    const std::size_t second = raster.secondOf(at);
    const TwoPoints now = {places.load(at), places.load(second)};
    const TwoVerdicts verdicts =
        is_downwards ? judgeRows(now, last, true, screens) : judgeRows(last, now, false, screens);
    put(verdicts.a, says + at);
    put(verdicts.b, says + second);
    const Ints is_taken = now.a.x == now.a.x;
    last = {merged(is_taken, now.a, last.a), merged(is_taken, now.b, last.b)};
  }
}

/// judgeColumns() or judgeLayers(), each made for one direction.
template <bool is_downwards>
SMOKE_GROUND_PART void judgeEight(const ScanRaster& raster, const Rows& rows, std::size_t first,
                                  const Screens& screens, std::int8_t* says) {
  raster.has_second ? judgeLayers(raster, rows, first, is_downwards, screens, says)
                    : judgeColumns(raster, rows, first, is_downwards, screens, says);
}

/// The same of a stripe.
SMOKE_GROUND_MULTIVERSION
void judgeStripe(const ScanRaster& raster, const Rows& rows, std::size_t stripe, bool is_downwards,
                 const Screens& by, std::int8_t* says) {
  const Screens screens = by;
  for (std::size_t column = 0; column < kWidth; column += kLanes) {
    const std::size_t first = stripe * raster.rows * kWidth + column;
    is_downwards ? judgeEight<true>(raster, rows, first, screens, says)
                 : judgeEight<false>(raster, rows, first, screens, says);
  }
}

/// Is one of them kInDoubt? No other has a sign.
SMOKE_GROUND_MULTIVERSION
bool areInDoubt(const std::int8_t* says, std::size_t size) {
  std::int8_t all = 0;
  for (std::size_t at = 0; at < size; ++at) all |= says[at];
  return all < 0;
}

/// Labels as numbers: a wall overrules ground, and both overrule what was only kept.
SMOKE_GROUND_MULTIVERSION
void overrule(const std::int8_t* said, std::size_t size, Label* label) {
  for (std::size_t i = 0; i < size; ++i) label[i] = std::max(label[i], static_cast<Label>(said[i]));
}

/// What the pairs of a raster say of their labelled points.
class RasterPairs {
 public:
  RasterPairs(const Scan& scan, const ScanRaster& raster, const SensorModel& sensor,
              const PairTests& tests, LabelPoint label_point)
      : scan_(scan),
        raster_(raster),
        sensor_(sensor),
        tests_(tests),
        label_first_(label_point == LabelPoint::kFirst),
        says_(raster.x.size()) {
    extra_says_.assign(raster.extras.size(), kSaysNothing);
    for (const std::uint16_t ring : sensor.ringsByElevation()) {
      if (ring < raster.rows) rows_.push_back(ring * kWidth);
    }
    if (rows_.size() < raster.rows) std::fill(says_.begin(), says_.end(), kSaysNothing);
    says_[raster.nowhere()] = kSaysNothing;
    judgeRows();
    judgeExtras();
  }

  void label(std::vector<Label>* labels) const {
    Label* const label = labels->data();
    for (std::size_t begin = 0; begin < labels->size(); begin += kAtOnce) {
      const std::size_t size = std::min(kAtOnce, labels->size() - begin);
      std::array<std::int8_t, kAtOnce> said;
      const std::uint32_t* const place = &raster_.place[begin];
      const std::int8_t* const says = says_.data();
      for (std::size_t i = 0; i < size; ++i) said[i] = says[place[i]];
      overrule(said.data(), size, label + begin);
    }
    for (std::size_t k = 0; k < raster_.extras.size(); ++k) {
      Label& extra = label[raster_.extras[k].point];
      extra = std::max(extra, static_cast<Label>(extra_says_[k]));
    }
  }

 private:
  /// One of the points at a place: the extras after the one in the raster.
  struct Found {
    std::array<float, 3> at;
    std::int8_t* says;

    Point point() const { return {at[0], at[1], at[2]}; }
    double squaredDistanceTo(const Found& other) const {
      const auto& to = other.at;
      return squaredDistance(at[0], at[1], at[2], to[0], to[1], to[2]);
    }
  };

  /// From the highest row down, or up: the labelled points of a pair are those of the later row.
  void judgeRows() {
    const Screens screens(tests_);
    const std::size_t size = raster_.rows * kWidth;
    for (std::size_t stripe = 0; stripe < raster_.stripes; ++stripe) {
      const std::size_t begin = stripe * size;
      judgeStripe(raster_, rows_, stripe, label_first_, screens, says_.data());
      bool is_doubt = areInDoubt(&says_[begin], size);
      if (raster_.has_second) is_doubt |= areInDoubt(&says_[raster_.secondOf(begin)], size);
      for (std::size_t at = begin; is_doubt && at < begin + size; ++at) judgeDoubt(at);
    }
  }

  void judgeDoubt(std::size_t at) {
    if (!raster_.has_second) {
      if (says_[at] == kInDoubt) judgeExactly(at);
    } else if (says_[at] == kInDoubt || says_[raster_.secondOf(at)] == kInDoubt) {
      label_first_ ? judgePlaces(at, above(at)) : judgePlaces(below(at), at);
    }
  }

  void judgeExactly(std::size_t at) {
    const Point here = pointAt(at);
    const Point there = pointAt(label_first_ ? above(at) : below(at));
    says_[at] = static_cast<std::int8_t>(label_first_ ? tests_.judge(here, there)
                                                      : tests_.judge(there, here));
  }

  Point pointAt(std::size_t at) const { return {raster_.x[at], raster_.y[at], raster_.z[at]}; }

  /// Places of several points, with the next ones below and above.
  void judgeExtras() {
    for (std::size_t k = 0; k < raster_.extras.size(); ++k) {
      const std::uint32_t at = raster_.extras[k].place;
      if (k > 0 && raster_.extras[k - 1].place == at) continue;
      if (rankOf(at) == SensorModel::kNoRank) continue;
      judgePlaces(below(at), at);
      judgePlaces(at, above(at));
    }
  }

  std::size_t rankOf(std::size_t at) const {
    return sensor_.rank(static_cast<std::uint16_t>(raster_.rowOf(at)));
  }

  /// The next place that is taken in the same column; nowhere(): none is.
  std::size_t above(std::size_t at) const {
    for (std::size_t rank = rankOf(at) + 1U; rank < sensor_.ringsByElevation().size(); ++rank) {
      if (isTakenIn(rank, at)) return placeIn(rank, at);
    }
    return raster_.nowhere();
  }
  std::size_t below(std::size_t at) const {
    for (std::size_t rank = rankOf(at); rank-- > 0;) {
      if (isTakenIn(rank, at)) return placeIn(rank, at);
    }
    return raster_.nowhere();
  }

  /// The place in the row of a rank that has the same column as one.
  std::size_t placeIn(std::size_t rank, std::size_t at) const {
    return at - raster_.rowOf(at) * kWidth + sensor_.ringsByElevation()[rank] * kWidth;
  }
  bool isTakenIn(std::size_t rank, std::size_t at) const {
    return sensor_.ringsByElevation()[rank] < raster_.rows && raster_.isTaken(placeIn(rank, at));
  }

  void judgePlaces(std::size_t lower, std::size_t upper) {
    if (lower == raster_.nowhere() || upper == raster_.nowhere()) return;
    findAt(lower, &firsts_);
    findAt(upper, &seconds_);
    for (const Found& found : label_first_ ? firsts_ : seconds_) *found.says = kSaysNothing;
    for (const Found& first : firsts_) {
      const Found& second = nearest(first);
      std::int8_t* const says = label_first_ ? first.says : second.says;
      *says =
          std::max(*says, static_cast<std::int8_t>(tests_.judge(first.point(), second.point())));
    }
  }

  void findAt(std::size_t at, std::vector<Found>* found) {
    const auto found_at = [&](std::size_t place) -> Found {
      return {{raster_.x[place], raster_.y[place], raster_.z[place]}, &says_[place]};
    };
    found->assign(1, found_at(at));
    const std::size_t second = raster_.secondOf(at);
    if (raster_.has_second && raster_.isTaken(second)) found->push_back(found_at(second));
    const auto is_before = [](const ScanRaster::Extra& extra, std::size_t place) {
      return extra.place < place;
    };
    const auto begin = raster_.extras.begin();
    for (auto e = std::lower_bound(begin, raster_.extras.end(), at, is_before);
         e != raster_.extras.end() && e->place == at; ++e) {
      found->push_back({scan_.point(e->point), &extra_says_[e - begin]});
    }
  }

  /// The second that is nearest to a first; ties: the first, which has the lower index in the scan.
  const Found& nearest(const Found& to) const {
    return *std::min_element(seconds_.begin(), seconds_.end(), [&](const Found& a, const Found& b) {
      return a.squaredDistanceTo(to) < b.squaredDistanceTo(to);
    });
  }

  const Scan& scan_;
  const ScanRaster& raster_;
  const SensorModel& sensor_;
  const PairTests& tests_;
  const bool label_first_;
  Recycled<std::size_t> rows_;
  Recycled<std::int8_t> says_;        // by place
  Recycled<std::int8_t> extra_says_;  // by extra
  Recycled<Found> firsts_, seconds_;  // at two places
};

}  // namespace

void labelRaster(const Scan& scan, const ScanRaster& raster, const SensorModel& sensor,
                 const PairTests& tests, LabelPoint label_point, std::vector<Label>* labels) {
  RasterPairs(scan, raster, sensor, tests, label_point).label(labels);
}

}  // namespace smoke_ground_reconstruction
