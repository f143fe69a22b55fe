#include "column_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// Points one behind the other, and more for lanes beyond the last.
struct Points {
  Recycled<float> x, y, z;

  Points(const Scan& scan, const std::vector<std::uint32_t>& order)
      : x(order.size() + kLanes), y(x.size()), z(x.size()) {
    for (std::size_t k = 0; k < order.size(); ++k) {
      x[k] = scan.x[order[k]];
      y[k] = scan.y[order[k]];
      z[k] = scan.z[order[k]];
    }
    for (auto* values : {&x, &y, &z}) std::fill(values->end() - kLanes, values->end(), 0.0F);
  }
  Point point(std::size_t k) const { return {x[k], y[k], z[k]}; }
};

/// For each point those of the next ring in its column, from `begin` to `end`; for lanes beyond the
/// last point none.
struct NextRings {
  Recycled<std::int32_t> begin, end;

  explicit NextRings(const ScanColumns& columns)
      : begin(columns.order.size() + kLanes), end(begin.size()) {
    for (auto* values : {&begin, &end}) std::fill(values->end() - kLanes, values->end(), 0);
    for (std::size_t c = 0; c + 1 < columns.column_begin.size(); ++c) {
      findIn(columns.rank, columns.column_begin[c], columns.column_begin[c + 1]);
    }
  }

 private:
  /// No branches: some sensors fire twice or three times per column, as rounding decides.
  void findIn(const std::vector<std::uint16_t>& rank, std::uint32_t column_begin,
              std::uint32_t column_end) {
    std::uint32_t ring_end = column_end, next_begin = column_end, next_end = column_end;
    std::uint32_t last_rank = SensorModel::kNoRank;  // of none
    for (std::uint32_t k = column_end; k-- > column_begin;) {
      const std::uint32_t if_new = rank[k] != last_rank ? ~0U : 0U;  // bits, not a branch
      last_rank = rank[k];
      next_end = (ring_end & if_new) | (next_end & ~if_new);
      next_begin = ((k + 1) & if_new) | (next_begin & ~if_new);
      ring_end = ((k + 1) & if_new) | (ring_end & ~if_new);
      begin[k] = static_cast<std::int32_t>(next_begin);
      end[k] = static_cast<std::int32_t>(next_end);
    }
  }
};

/// What points and their seconds say, and who these are: themselves if nobody.
struct Verdicts {
  Recycled<std::int32_t> says, second;

  explicit Verdicts(std::size_t size) : says(size + kLanes), second(says.size()) {}
};

/// The nearest of the next ring found so far.
struct Nearest {
  Floats x = Floats{} + NAN, y = {}, z = {};
  Floats squared_distance = Floats{} + kNoLimit;
  Ints at;
  Ints is_doubt = {};  // which one is

  /// Looks at others. \param is_asked  are they of the next ring?
  SMOKE_GROUND_PART void look(const RoughPoints& from, const Floats& other_x, const Floats& other_y,
                              const Floats& other_z, const Ints& other_at, const Ints& is_asked) {
    const Floats dx = from.x - other_x, dy = from.y - other_y, dz = from.z - other_z;
    const Floats d2 = (dx * dx + dy * dy) + dz * dz;
    const Floats margin = kScreenMargin * (d2 + squared_distance) + kLeastMargin;
    const Ints is_nearer = is_asked & (d2 < squared_distance - margin);
    const Ints is_same = (other_x == x) & (other_y == y) & (other_z == z);
    is_doubt |= is_asked & ~(is_nearer | is_same | (d2 > squared_distance + margin));
    x = is_nearer ? other_x : x;
    y = is_nearer ? other_y : y;
    z = is_nearer ? other_z : z;
    squared_distance = is_nearer ? d2 : squared_distance;
    at = is_nearer ? other_at : at;
  }
};

SMOKE_GROUND_PART Ints loadInts(const std::int32_t* from) {
  Ints lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

/// Pairs each point with the nearest of the next ring, and judges them, in single precision.
SMOKE_GROUND_MULTIVERSION
void judgeNearest(const Points& points, const NextRings& next, const Screens& by,
                  Verdicts* verdicts) {
  const Screens screens = by;
  const float *const x = points.x.data(), *const y = points.y.data(), *const z = points.z.data();
  const Ints lanes = {0, 1, 2, 3, 4, 5, 6, 7};
  for (std::size_t k = 0; k + kLanes < points.x.size(); k += kLanes) {
    const Ints here = lanes + static_cast<std::int32_t>(k);
    const Ints begin = loadInts(&next.begin[k]), end = loadInts(&next.end[k]);
    const RoughPoints first = roughPoints(loadLanes(x + k), loadLanes(y + k), loadLanes(z + k));
    Nearest nearest;
    nearest.at = here;
    const Ints beyond = end - here;
    std::int32_t steps = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane) steps = std::max(steps, beyond[lane]);
    for (std::int32_t step = 1; step < steps; ++step) {
      const std::size_t at = k + static_cast<std::size_t>(step);
      const Ints there = here + step;
      nearest.look(first, loadLanes(x + at), loadLanes(y + at), loadLanes(z + at), there,
                   (there >= begin) & (there < end));
    }
    const RoughPoints second = roughPoints(nearest.x, nearest.y, nearest.z);
    const Ints verdict =
        nearest.is_doubt ? Ints{} + kInDoubt : screens.judge(roughPairs(first, second));
    std::memcpy(&verdicts->says[k], &verdict, sizeof(verdict));
    std::memcpy(&verdicts->second[k], &nearest.at, sizeof(nearest.at));
  }
}

/// Of the points [begin, end) the one nearest to a point; ties: the first, which has the lower
/// index in the scan.
std::size_t nearest(const Points& points, std::size_t point, std::size_t begin, std::size_t end) {
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

}  // namespace

void labelColumns(const Scan& scan, const ScanColumns& columns, const PairTests& tests,
                  LabelPoint label_point, std::vector<Label>* labels) {
  const Points points(scan, columns.order);
  const NextRings next(columns);
  Verdicts verdicts(columns.order.size());
  judgeNearest(points, next, Screens(tests), &verdicts);
  const bool label_first = label_point == LabelPoint::kFirst;
  for (std::size_t k = 0; k < columns.order.size(); ++k) {
    std::size_t second = static_cast<std::size_t>(verdicts.second[k]);
    std::int32_t says = verdicts.says[k];
    if (says == kInDoubt) {
      second = nearest(points, k, static_cast<std::size_t>(next.begin[k]),
                       static_cast<std::size_t>(next.end[k]));
      says = static_cast<std::int32_t>(tests.judge(points.point(k), points.point(second)));
    }
    // Labels as numbers: a wall overrules ground, and both overrule what was only kept.
    Label& label = (*labels)[columns.order[label_first ? k : second]];
    label = std::max(label, static_cast<Label>(says));
  }
}

}  // namespace smoke_ground_reconstruction
