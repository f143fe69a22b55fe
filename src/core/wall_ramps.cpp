#include "smoke_ground_reconstruction/wall_ramps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ordered.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kBin = 0.1;         // along a wall; its lowest return tells [m]
constexpr double kFarthest = 69.9;   // place along a wall [m]
constexpr int kBins = 1400;          // of a wall
constexpr double kShortest = 0.5;    // ramp along a wall [m]
constexpr double kSeen = 0.05;       // a wall's lowest returns lie so near above its foot ... [m]
constexpr double kSeenShare = 0.85;  // in so many bins where smoke does not cut them off
constexpr double kOnPlane = FloorRelief::kOnPlane;
constexpr double kLeastRise = 2.0 * kOnPlane;

}  // namespace

void WallRampFinder::clear(std::size_t lines) {
  bins_.assign(lines * kBins, {std::numeric_limits<double>::infinity(), 0.0});
}

void WallRampFinder::add(std::size_t line, double along, double height) {
  if (!(std::fabs(along) < kFarthest)) return;
  const int slot = floorToInt(along / kBin) + kBins / 2;
  Foot& foot = bins_[line * kBins + static_cast<std::size_t>(slot)];
  if (height < foot.height || (height == foot.height && along < foot.along)) {
    foot = {height, along};
  }
}

std::optional<WallRamp> WallRampFinder::find(const Lines& lines, double max_slope) {
  std::optional<WallRamp> best;
  double longest = kShortest;
  for (std::size_t line = 0; line < lines.size(); ++line) {
    takeFeetOf(line);
    findLowerHull();
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
      best = WallRamp{{-slope * lines.ny[line], slope * lines.nx[line], rest}, top};
    }
  }
  return best;
}

void WallRampFinder::listFeet(const Lines& lines, std::vector<ReliefPlace>* feet) {
  feet->clear();
  for (std::size_t line = 0; line < lines.size(); ++line) {
    takeFeetOf(line);
    const double nx = lines.nx[line], ny = lines.ny[line], rho = lines.rho[line];
    for (const Foot& foot : feet_) {
      feet->push_back({nx * rho - ny * foot.along, ny * rho + nx * foot.along, foot.height});
    }
  }
}

void WallRampFinder::takeFeetOf(std::size_t line) {
  feet_.clear();
  for (std::size_t bin = line * kBins; bin < (line + 1) * kBins; ++bin) {
    if (bins_[bin].height < std::numeric_limits<double>::infinity()) feet_.push_back(bins_[bin]);
  }
}

void WallRampFinder::findLowerHull() {
  hull_.clear();
  for (std::size_t at = 0; at < feet_.size(); ++at) {
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
                                    double* sum) {
  OrderedSum over;
  for (const Foot* foot = &first; foot <= &last; ++foot) {
    const double height = foot->height - (first.height + slope * (foot->along - first.along));
    if (height < kSeen) over.add(height);
  }
  *sum = over.value();
  return over.count();
}

}  // namespace smoke_ground_reconstruction
