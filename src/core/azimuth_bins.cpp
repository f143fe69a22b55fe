#include "smoke_ground_reconstruction/azimuth_bins.hpp"

#include <algorithm>
#include <cmath>

#include "azimuth.hpp"
#include "multiversion.hpp"
#include "turn.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kSlotsPerBin = 4;
constexpr double kTurnMargin = 1e-12;       // beyond its rounding
constexpr float kShort = 1e-30F;            // what azimuthOf() knows nothing of
constexpr std::size_t kBetweenLooks = 128;  // for those in doubt: of most such none is

/// Bins of points that lie clear of every edge; of others -1 - the nearest edge.
SMOKE_GROUND_MULTIVERSION
void guessBins(const float* x, const float* y, std::size_t size, float bins, std::uint32_t* bin) {
  const auto bins_per_radian = static_cast<float>(static_cast<double>(bins) / kTwoPi);
  // The error of the guess, the rounding of the edges to single precision, and the bins' own.
  const float margin = (static_cast<float>(kAzimuthError) + 1e-6F) * bins_per_radian + 2e-7F * bins;
  for (std::size_t i = 0; i < size; ++i) {
    const float position = azimuthOf(x[i], y[i]) * bins_per_radian;
    const float inside = position < bins ? position : bins;  // also of no number
    const auto guess = static_cast<std::int32_t>(inside);
    const float part = inside - static_cast<float>(guess);
    const bool is_clear = (part > margin) & (part < 1.0F - margin) & (inside > margin) &
                          (inside < bins - margin) & (std::fabs(x[i]) + std::fabs(y[i]) > kShort);
    const std::int32_t edge = guess + (part > 0.5F ? 1 : 0);
    bin[i] = static_cast<std::uint32_t>(is_clear ? guess : -1 - edge);
  }
}

SMOKE_GROUND_MULTIVERSION
bool areAllClear(const std::uint32_t* bin, std::size_t size) {
  std::uint32_t all = 0;
  for (std::size_t i = 0; i < size; ++i) all |= bin[i];
  return static_cast<std::int32_t>(all) >= 0;  // those in doubt alone have the sign
}

}  // namespace

bool dividesCircle(double width_deg) {
  const double bins = std::round(360.0 / width_deg);
  return bins >= 4.0 && bins <= 36000.0 && std::fabs(bins * width_deg - 360.0) <= 360.0 * 1e-6;
}

AzimuthBins::AzimuthBins(double width_deg) {
  require(dividesCircle(width_deg), "the width of an azimuth bin", kCircleDivisor, width_deg);
  const double bins = std::round(360.0 / width_deg);
  const auto count = static_cast<std::size_t>(bins);
  edges_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    edges_.push_back(Direction::fromDegrees(static_cast<double>(i) * 360.0 / bins));
  }
  binsBeforeSlots();
}

// For each slot of turns the last bin that begins in an earlier one.
void AzimuthBins::binsBeforeSlots() {
  bin_before_.resize(kSlotsPerBin * count());
  std::uint32_t bin = 0;
  for (std::size_t slot = 0; slot < bin_before_.size(); ++slot) {
    const auto begins_earlier = [&](const Direction& edge) {
      return slotOf(turnOf(edge.cosine, edge.sine)) < slot;
    };
    while (bin + 1 < count() && begins_earlier(edges_[bin + 1])) ++bin;
    bin_before_[slot] = bin;
  }
}

std::size_t AzimuthBins::slotOf(double turn) const {
  const auto slots = static_cast<double>(bin_before_.size());
  return static_cast<std::size_t>(std::min(slots - 1.0, std::max(0.0, turn / kOnceAround * slots)));
}

std::size_t AzimuthBins::index(float x, float y) const {
  const double u = x;
  const double v = y;
  if (u == 0.0 && v == 0.0) return 0;
  // A bin that surely begins before the point; the products step on from there.
  std::size_t bin = bin_before_[slotOf(turnOf(u, v) - kTurnMargin)];
  while (bin + 1 < count() && isAtOrAfter(edges_[bin + 1], u, v)) ++bin;
  return bin;
}

/// Bin of a direction next to an edge.
std::uint32_t AzimuthBins::beside(std::uint32_t edge, float x, float y) const {
  const bool is_at_seam = edge == 0 || edge >= count();
  const bool has_direction = std::fabs(x) + std::fabs(y) > kShort;
  if (is_at_seam || !has_direction) return static_cast<std::uint32_t>(index(x, y));
  return isAtOrAfter(edges_[edge], x, y) ? edge : edge - 1;
}

void AzimuthBins::indices(const float* x, const float* y, std::size_t size,
                          std::uint32_t* index) const {
  guessBins(x, y, size, static_cast<float>(count()), index);
  for (std::size_t begin = 0; begin < size; begin += kBetweenLooks) {
    const std::size_t end = std::min(size, begin + kBetweenLooks);
    if (areAllClear(index + begin, end - begin)) continue;
    for (std::size_t i = begin; i < end; ++i) {
      if (static_cast<std::int32_t>(index[i]) < 0) index[i] = beside(~index[i], x[i], y[i]);
    }
  }
}

}  // namespace smoke_ground_reconstruction
