#include "smoke_ground_reconstruction/azimuth_bins.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "azimuth.hpp"
#include "multiversion.hpp"
#include "turn.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kSlotsPerBin = 4;
constexpr double kTurnMargin = 1e-12;       // beyond its rounding
constexpr float kShort = 1e-30F;            // what azimuthOf() knows nothing of
constexpr float kRounding = 8388608.0F;     // 2^23: what is added to it is rounded
constexpr std::int32_t kRounded = 0xFFFF;   // bits of that
constexpr std::size_t kBetweenLooks = 128;  // for those in doubt: of most such none is

/// Bins of points that lie clear of every edge; of others -1 - the nearest edge. Returns whether
/// there are none of these.
SMOKE_GROUND_MULTIVERSION
bool guessBins(const float* x, const float* y, std::size_t size, float bins, std::uint32_t* bin) {
  const auto bins_per_radian = static_cast<float>(static_cast<double>(bins) / kTwoPi);
  // The error of the guess, the rounding of the edges to single precision, and the bins' own.
  const float margin = (static_cast<float>(kAzimuthError) + 1e-6F) * bins_per_radian + 2e-7F * bins;
  std::int32_t all = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const float position = azimuthOf(x[i], y[i]) * bins_per_radian;
    const float inside = position < bins ? position : bins;  // also of no number
    const float with_edge = inside + kRounding;
    const float beyond = inside - (with_edge - kRounding);
    std::int32_t edge;
    std::memcpy(&edge, &with_edge, sizeof(edge));
    edge &= kRounded;
    const std::int32_t guess = beyond < 0.0F ? edge - 1 : edge;
    const std::int32_t found = std::fabs(beyond) > margin ? guess : -1 - edge;
    all |= found;  // those in doubt alone have the sign
    bin[i] = static_cast<std::uint32_t>(found);
  }
  return all >= 0;
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
  const bool is_before = !isAtOrAfter(edges_[edge], x, y);
  return edge - static_cast<std::uint32_t>(is_before);  // no branch: rounding decides
}

void AzimuthBins::indices(const float* x, const float* y, std::size_t size,
                          std::uint32_t* index) const {
  for (std::size_t begin = 0; begin < size; begin += kBetweenLooks) {
    const std::size_t end = std::min(size, begin + kBetweenLooks);
    const bool are_all_clear =
        guessBins(x + begin, y + begin, end - begin, static_cast<float>(count()), index + begin);
    for (std::size_t i = begin; !are_all_clear && i < end; ++i) {
      if (static_cast<std::int32_t>(index[i]) < 0) index[i] = beside(~index[i], x[i], y[i]);
    }
  }
}

void greatestBeside(const std::vector<double>& values, std::size_t beside,
                    std::vector<double>* greatest) {
  const std::size_t columns = values.size();
  greatest->resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    double most = 0.0;
    for (std::size_t k = 0; k <= 2 * beside; ++k) {
      most = std::max(most, values[wrapped(c + columns + k - beside, columns)]);
    }
    (*greatest)[c] = most;
  }
}

}  // namespace smoke_ground_reconstruction
