#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "ordered.hpp"
#include "smoke_ground_reconstruction/floor_relief.hpp"

// The slope of a ramp, fitted to all that lies on it. A few cells, or the feet of one wall, tell
// roughly how a ramp rises. Returns of its floor that lie near to that, be they ever so scattered,
// and the feet of all walls, which stand on it or are seen no farther down, tell better.

namespace smoke_ground_reconstruction {

namespace {

constexpr double kNear = 0.03;                     // what lies so near belongs to the ramp [m]
constexpr double kClear = 0.05;                    // of where it begins and ends [m]
constexpr double kOnFoot = 0.2, kOverFoot = 0.01;  // weight of a wall's lowest returns below
                                                   // the ramp and over it
constexpr std::size_t kFewest = 12;
constexpr int kPasses = 5;
constexpr double kPrior = 0.05;   // weight of the slope as it was [m^2]
constexpr double kAlong = 0.996;  // cosine between the slope and a wall or its normal: 5 deg

using Way = std::array<double, 2>;

/// The way up: along or across a wall if nearly so.
Way findUp(const Way& gradient, const std::vector<Way>& normals) {
  for (const Way& n : normals) {
    for (const Way& way : {n, Way{-n[1], n[0]}, Way{-n[0], -n[1]}, Way{n[1], -n[0]}}) {
      if (way[0] * gradient[0] + way[1] * gradient[1] > kAlong) return way;
    }
  }
  return gradient;
}

}  // namespace

bool FloorRelief::hasOneSlope() const { return slope() >= 0; }

/// Number of the only facet that slopes; -1 if there is none, or more.
int FloorRelief::slope() const {
  int found = -1;
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    if (facets_[f].isLevel()) continue;
    if (found >= 0) return -1;
    found = static_cast<int>(f);
  }
  return found;
}

void FloorRelief::fitRamp(const std::vector<ReliefPlace>& floor,
                          const std::vector<ReliefPlace>& feet, const std::vector<Way>& normals) {
  const int number = slope();
  if (number < 0) return;
  ReliefFacet& facet = facets_[static_cast<std::size_t>(number)];
  const double rise = std::sqrt(facet.a * facet.a + facet.b * facet.b);
  const Way up = findUp({facet.a / rise, facet.b / rise}, normals);
  RampFit fit{facet, rise, up[0], up[1], 0.0, 0.0};
  findEnds(number, &fit);
  for (int pass = 0; pass < kPasses; ++pass) {
    on_ramp_.clear();
    addOnRamp(fit, floor, 1.0, 1.0);
    addOnRamp(fit, feet, kOnFoot, kOverFoot);
    if (on_ramp_.size() < kFewest) return;
    refit(rise, &fit);
    if (fit.slope < 0.0 || !isClimbable(fit.slope, params_.max_slope)) return;
  }
  facet = fit.facet;
  moveCreases(number, fit);
}

/// Heights between which the slope lies.
void FloorRelief::findEnds(int number, RampFit* fit) const {
  fit->lowest = -std::numeric_limits<double>::infinity();
  fit->highest = -fit->lowest;
  for (const ReliefCrease& crease : creases_) {
    if (crease.of != number) continue;
    const double level = facets_[static_cast<std::size_t>(crease.to)].c;
    if (crease.nx * fit->x + crease.ny * fit->y > 0.0) {
      fit->highest = std::min(fit->highest, level);
    } else {
      fit->lowest = std::max(fit->lowest, level);
    }
  }
}

void FloorRelief::addOnRamp(const RampFit& fit, const std::vector<ReliefPlace>& places,
                            double below, double over) {
  const double margin = kClear * fit.slope;
  for (const ReliefPlace& place : places) {
    const double model = fit.facet.at(place.x, place.y);
    if (!(std::fabs(place.height - model) < kNear)) continue;
    if (!(model > fit.lowest + margin) || !(model < fit.highest - margin)) continue;
    on_ramp_.push_back(
        {fit.x * place.x + fit.y * place.y, place.height, place.height < model ? below : over});
  }
}

/// Weighted least squares along the slope.
void FloorRelief::refit(double rise, RampFit* fit) const {
  OrderedSum total, of_place, of_height, of_square, of_product;
  for (const auto& [place, height, weight] : on_ramp_) {
    total.add(weight);
    of_place.add(weight * place);
    of_height.add(weight * height);
  }
  const double mean_place = of_place.value() / total.value();
  const double mean_height = of_height.value() / total.value();
  for (const auto& [place, height, weight] : on_ramp_) {
    const double away = place - mean_place;
    of_square.add(weight * (away * away));
    of_product.add(weight * (away * (height - mean_height)));
  }
  fit->slope = (of_product.value() + kPrior * rise) / (of_square.value() + kPrior);
  fit->facet = {fit->slope * fit->x, fit->slope * fit->y, mean_height - fit->slope * mean_place};
}

/// To where the slope meets the other facets now.
void FloorRelief::moveCreases(int number, const RampFit& fit) {
  for (ReliefCrease& crease : creases_) {
    if (crease.of != number && crease.to != number) continue;
    const int other = crease.of == number ? crease.to : crease.of;
    const double rho = (facets_[static_cast<std::size_t>(other)].c - fit.facet.c) / fit.slope;
    const double side = crease.nx * fit.x + crease.ny * fit.y > 0.0 ? 1.0 : -1.0;
    crease = {crease.of, crease.to, side * fit.x, side * fit.y, side * rho};
  }
}

}  // namespace smoke_ground_reconstruction
