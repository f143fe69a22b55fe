#include "smoke_ground_reconstruction/wall_ramps.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "ordered.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kBin = 0.1;         // along a wall; its lowest return tells [m]
constexpr double kShortest = 0.5;    // ramp along a wall [m]
constexpr double kSeen = 0.05;       // a wall's lowest returns lie so near above its foot ... [m]
constexpr double kSeenShare = 0.85;  // in so many bins where smoke does not cut them off
constexpr double kOnPlane = FloorRelief::kOnPlane;
constexpr double kLeastRise = 2.0 * kOnPlane;

}  // namespace

void WallRampFinder::add(std::size_t line, double along, double height) {
  feet_.push_back({static_cast<std::uint32_t>(line), floorToInt(along / kBin), height, along});
}

std::optional<WallRamp> WallRampFinder::find(const Lines& lines, double max_slope) {
  keepLowest();
  std::optional<WallRamp> best;
  double longest = kShortest;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < feet_.size(); begin = end) {
    while (end < feet_.size() && feet_[end].line == feet_[begin].line) ++end;
    findLowerHull(begin, end);
    for (std::size_t k = 0; k + 1 < hull_.size(); ++k) {
      const Foot& first = feet_[hull_[k]];
      const Foot& last = feet_[hull_[k + 1]];
      const double length = last.along - first.along;
      const double slope = (last.height - first.height) / length;
      if (!(length > longest) || !FloorRelief::isClimbable(slope, max_slope)) continue;
      const double top = std::max(first.height, last.height);
      const double foot = std::min(std::fabs(first.height), std::fabs(last.height));
      if (!(top > kLeastRise) || !(foot < kOnPlane)) continue;
      double sum = 0.0;
      const auto count = static_cast<double>(sumOver(first, last, slope, &sum));
      if (!(count >= kSeenShare * (length / kBin))) continue;
      longest = length;
      // Lower than the feet by what the lowest of so many are.
      const double rest =
          (first.height - slope * first.along) - 2.0 * sum / (count * (count - 2.0));
      const std::size_t line = first.line;
      best = WallRamp{{-slope * lines.ny[line], slope * lines.nx[line], rest}, top};
    }
  }
  return best;
}

/// Leaves the lowest return of each bin, by place.
void WallRampFinder::keepLowest() {
  const auto key = [](const Foot& foot) {
    return std::make_tuple(foot.line, foot.slot, foot.height, foot.along);
  };
  std::sort(feet_.begin(), feet_.end(),
            [&](const Foot& one, const Foot& other) { return key(one) < key(other); });
  const auto is_same_bin = [](const Foot& one, const Foot& other) {
    return one.line == other.line && one.slot == other.slot;
  };
  feet_.erase(std::unique(feet_.begin(), feet_.end(), is_same_bin), feet_.end());
}

void WallRampFinder::findLowerHull(std::size_t begin, std::size_t end) {
  hull_.clear();
  for (std::size_t at = begin; at < end; ++at) {
    while (hull_.size() > 1) {
      const Foot& before = feet_[hull_[hull_.size() - 2]];
      const Foot& middle = feet_[hull_.back()];
      if ((middle.along - before.along) * (feet_[at].height - middle.height) >
          (feet_[at].along - middle.along) * (middle.height - before.height)) {
        break;
      }
      hull_.pop_back();
    }
    hull_.push_back(at);
  }
}

/// How many feet along a stretch lie near above it, and how far in all [m].
std::size_t WallRampFinder::sumOver(const Foot& first, const Foot& last, double slope,
                                    double* sum) const {
  OrderedSum over;
  for (const Foot* foot = &first; foot <= &last; ++foot) {
    const double height = foot->height - (first.height + slope * (foot->along - first.along));
    if (height < kSeen) over.add(height);
  }
  *sum = over.value();
  return over.count();
}

}  // namespace smoke_ground_reconstruction
