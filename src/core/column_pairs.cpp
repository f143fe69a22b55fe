#include "column_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

std::size_t fullLanes(std::size_t size) { return (size + kLanes - 1) / kLanes * kLanes; }

/// Some points one behind the other, and more to fill the last lanes.
struct Points {
  Recycled<float> x, y, z;

  template <typename Of>
  Points(const Of& points, const std::vector<std::uint32_t>& order)
      : x(fullLanes(order.size())), y(x.size()), z(x.size()) {
    for (std::size_t k = 0; k < order.size(); ++k) {
      x[k] = points.x[order[k]];
      y[k] = points.y[order[k]];
      z[k] = points.z[order[k]];
    }
    for (auto* values : {&x, &y, &z})
      std::fill(values->begin() + order.size(), values->end(), 0.0F);
  }
  Point point(std::size_t k) const { return {x[k], y[k], z[k]}; }
};

SMOKE_GROUND_PART RoughPoints loadPoints(const Points& points, std::size_t first) {
  return roughPoints(loadLanes(&points.x[first]), loadLanes(&points.y[first]),
                     loadLanes(&points.z[first]));
}

SMOKE_GROUND_MULTIVERSION
void judgePairs(const Points& firsts, const Points& seconds, const Screens& by,
                std::vector<std::int32_t>* says) {
  const Screens screens = by;
  for (std::size_t k = 0; k < says->size(); k += kLanes) {
    const Ints verdict = screens.judge(roughPairs(loadPoints(firsts, k), loadPoints(seconds, k)));
    std::memcpy(&(*says)[k], &verdict, sizeof(verdict));
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
    Recycled<std::int32_t> says(fullLanes(second_.size()));
    const Points seconds(points_, second_);
    judgePairs(points_, seconds, Screens(tests), &says);
    says.resize(second_.size());
    for (std::size_t k = 0; k < says.size(); ++k) {
      if (second_[k] == k) {
        says[k] = kSaysNothing;
      } else if (says[k] == kInDoubt) {
        const Label label = tests.judge(points_.point(k), points_.point(second_[k]));
        says[k] = static_cast<std::int32_t>(label);
      }
    }
    return says;
  }

 private:
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
  Points points_;
  Recycled<std::uint32_t> second_;
};

}  // namespace

void labelColumns(const Scan& scan, const ScanColumns& columns, const PairTests& tests,
                  LabelPoint label_point, std::vector<Label>* labels) {
  const Pairs pairs(scan, columns);
  const auto says = pairs.judged(tests);
  const bool label_first = label_point == LabelPoint::kFirst;
  for (std::size_t k = 0; k < says.size(); ++k) {
    // Labels as numbers: a wall overrules ground, and both overrule what was only kept.
    Label& label = (*labels)[columns.order[label_first ? k : pairs.second()[k]]];
    label = std::max(label, static_cast<Label>(says[k]));
  }
}

}  // namespace smoke_ground_reconstruction
