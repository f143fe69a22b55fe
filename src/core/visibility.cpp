#include "smoke_ground_reconstruction/visibility.hpp"

#include <algorithm>
#include <cstddef>

namespace smoke_ground_reconstruction {
namespace {

constexpr double kBin = 0.2;   // of range [m]
constexpr double kFewest = 8;  // returns of a bin
constexpr std::size_t kFewestBins = 5;
constexpr double kSpan = 0.6;            // least spread of range [m]
constexpr double kGrazing = 0.2;         // least cosine of incidence
constexpr double kPatches = 0.32;        // sigma of the optical depth / (extinction sqrt(range))
constexpr double kFaintestShare = 0.02;  // of the far half lies at the detection limit or below
constexpr double kDimmest = 0.5;         // an intensity of 0 was rounded from up to this
constexpr int kSteps = 8;
constexpr double kMostHidden = 2.5;  // that the correction for what is not seen may be
constexpr double kEven = 0.15;       // sigma over mean of a bin in clear air; smoke is patchy
constexpr double kShared = 0.1;      // sigma of an extinction for patches that all beams pass
constexpr double kTilted = 0.3;      // ... and for those that tilt the slope
constexpr double kClearest = 0.06;   // extinction of what passes for clear air [1/m]
constexpr std::size_t kSlots = 330;  // of range, for each wall; no wall is farther than 65 m

/// ln of the share of a normal distribution that lies above `-above` sigmas.
double logShare(double above) {
  return std::log(std::max(0.5 * std::erfc(-above / std::sqrt(2.0)), 1e-9));
}

/// Of an even number the mean of the middle two, as NumPy has it.
double median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  if (values->size() % 2 == 1) {
    return *middle;
  }
  return 0.5 * (*std::max_element(values->begin(), middle) + *middle);
}

/// With a sigma that counts what the bins have in common, a share of the extinction.
Visibility shared(double extinction, double sigma, double share) {
  Visibility found;
  found.extinction = std::max(0.0, extinction);
  const double common = share * found.extinction;
  found.sigma = std::sqrt(sigma * sigma + common * common);
  return found;
}

}  // namespace

double Visibility::meteorologicalRange() const {
  return extinction > 0.0 ? std::log(20.0) / extinction : std::numeric_limits<double>::infinity();
}

void WallLight::resize(std::size_t size) {
  wall.resize(size);
  for (auto* values : {&range, &intensity, &cosine}) values->resize(size);
}

void WallLight::push(std::int32_t of_wall, double at_range, double of_intensity, double of_cosine) {
  wall.push_back(of_wall);
  range.push_back(at_range);
  intensity.push_back(of_intensity);
  cosine.push_back(of_cosine);
}

Visibility VisibilityEstimator::estimate(const WallLight& returns) {
  if (!fillBins(returns)) {
    return {};
  }
  hidden_.assign(bins_.size(), 0.0);
  learn();
  if (!std::isnan(clear_level_)) {
    return solve();
  }
  if (span() < kSpan) {
    return {};
  }
  const Line found = slope();
  return shared(found.extinction, found.sigma, kTilted);
}

bool VisibilityEstimator::fillBins(const WallLight& returns) {
  sumUp(returns);
  bins_.clear();
  for (const Sum& sum : sums_) {
    if (sum.count < kFewest || !(sum.bright > 0.0)) {
      continue;
    }
    const double at = sum.range / sum.count, mean = sum.bright / sum.count;
    const double variance = sum.square / sum.count - mean * mean;
    const double cosine = sum.cosine / sum.count;
    bins_.push_back({at, std::log(mean), at * at / cosine,
                     std::sqrt(std::max(0.0, variance)) / mean, sum.count});
  }
  if (bins_.size() < kFewestBins) {
    return false;
  }
  const double limit = faintest();
  for (Bin& bin : bins_) bin.limit = std::log(limit * bin.limit);
  return true;
}

void VisibilityEstimator::sumUp(const WallLight& returns) {
  seen_.clear();
  std::int32_t walls = 0;
  for (const std::int32_t wall : returns.wall) walls = std::max(walls, wall + 1);
  sums_.assign(static_cast<std::size_t>(walls) * kSlots, Sum());
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const double range = returns.range[i], cosine = returns.cosine[i];
    const auto slot = static_cast<std::size_t>(range / kBin);
    if (!(cosine > kGrazing) || slot >= kSlots) {
      continue;
    }
    seen_.push_back({range, returns.intensity[i]});
    Sum& sum = sums_[static_cast<std::size_t>(returns.wall[i]) * kSlots + slot];
    const double bright = returns.intensity[i] / cosine;
    sum.count += 1.0;
    sum.range += range;
    sum.bright += bright;
    sum.square += bright * bright;
    sum.cosine += cosine;
  }
}

/// Detection limit of I / R^2: intensity is corrected for range, what is received is not.
double VisibilityEstimator::faintest() {
  scratch_.clear();
  for (const Seen& one : seen_) scratch_.push_back(one.range);
  const auto nth = [this](std::size_t n) {
    const auto place = scratch_.begin() + static_cast<std::ptrdiff_t>(n);
    std::nth_element(scratch_.begin(), place, scratch_.end());
    return *place;
  };
  const double far = nth(scratch_.size() / 2);
  scratch_.clear();
  for (const Seen& one : seen_) {
    if (one.range >= far) {
      scratch_.push_back(std::max(one.intensity, kDimmest) / (one.range * one.range));
    }
  }
  return nth(static_cast<std::size_t>(kFaintestShare * static_cast<double>(scratch_.size())));
}

double VisibilityEstimator::span() const {
  const auto ends = std::minmax_element(bins_.begin(), bins_.end(),
                                        [](const Bin& a, const Bin& b) { return a.at < b.at; });
  return ends.second->at - ends.first->at;
}

/// Takes over the level of a scan in clear air; brighter walls win.
void VisibilityEstimator::learn() {
  scratch_.clear();
  for (const Bin& bin : bins_) scratch_.push_back(bin.spread);
  if (span() < kSpan || median(&scratch_) > kEven) {
    return;
  }
  const double extinction = std::max(0.0, slope().extinction);
  scratch_.clear();
  for (const Bin& bin : bins_) scratch_.push_back(bin.level + 2.0 * extinction * bin.at);
  const double level = median(&scratch_);
  if (extinction < kClearest && !(level < clear_level_)) {
    clear_level_ = level;
  }
}

/// Half the negative slope by weighted least squares, and its sigma from the residuals.
VisibilityEstimator::Line VisibilityEstimator::slope() const {
  double total = 0.0, at = 0.0, level = 0.0;
  for (const Bin& bin : bins_) {
    total += bin.weight;
    at += bin.weight * bin.at;
    level += bin.weight * bin.level;
  }
  at /= total;
  level /= total;
  double square = 0.0, product = 0.0, spread = 0.0;
  for (const Bin& bin : bins_) {
    square += bin.weight * (bin.at - at) * (bin.at - at);
    product += bin.weight * (bin.at - at) * bin.level;
  }
  const double rise = product / square;
  for (const Bin& bin : bins_) {
    const double rest = bin.weight * (bin.at - at) * (bin.level - level - rise * (bin.at - at));
    spread += rest * rest;
  }
  return {-0.5 * rise, 0.5 * std::sqrt(spread) / square};
}

/// Extinction from what is left of the level in clear air.
VisibilityEstimator::Line VisibilityEstimator::fromLevel() const {
  double total = 0.0, sum = 0.0, square = 0.0;
  const auto each = [this](std::size_t i) {
    return (clear_level_ - (bins_[i].level - hidden_[i])) / (2.0 * bins_[i].at);
  };
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    const double weight = bins_[i].weight * bins_[i].at * bins_[i].at;
    total += weight;
    sum += weight * each(i);
  }
  const double mean = sum / total;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    const double weight = bins_[i].weight * bins_[i].at * bins_[i].at;
    square += weight * (each(i) - mean) * (each(i) - mean);
  }
  return {mean, std::sqrt(square / total / static_cast<double>(bins_.size()))};
}

/// Extinction and what it hides, each from the other.
Visibility VisibilityEstimator::solve() {
  Line found = fromLevel();
  double extinction = found.extinction;
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      hidden_[i] = hidden(bins_[i], std::max(extinction, 0.01));
    }
    found = fromLevel();
    extinction = 0.5 * (extinction + found.extinction);
  }
  return shared(extinction, found.sigma, kShared);
}

/// How far ln of the mean of what is seen lies above the mean of ln of all: a log-normal
/// distribution with the sigma that patches make, cut off at the limit.
double VisibilityEstimator::hidden(const Bin& bin, double extinction) const {
  const double sigma = 2.0 * kPatches * extinction * std::sqrt(bin.at);
  double hidden = 0.0, centre = bin.level - 0.5 * sigma * sigma;
  for (int step = 0; step < 3; ++step) {
    const double above = (centre - bin.limit) / sigma;
    hidden = 0.5 * sigma * sigma + logShare(above + sigma) - logShare(above);
    hidden = std::min(hidden, kMostHidden);
    centre = bin.level - hidden;
  }
  return hidden;
}

}  // namespace smoke_ground_reconstruction
