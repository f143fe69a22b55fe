#include "smoke_ground_reconstruction/azimuth_bins.hpp"

#include <cmath>

#include "validation.hpp"

namespace smoke_ground_reconstruction {

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
  bins_per_radian_ = bins / (2.0 * M_PI);
}

std::size_t AzimuthBins::index(float x, float y) const {
  const double u = x;
  const double v = y;
  if (u == 0.0 && v == 0.0) return 0;
  const std::size_t bin = estimate(u, v);
  const std::size_t last = count() - 1;
  const std::size_t next = bin == last ? 0 : bin + 1;
  if (!isAtOrAfter(edges_[bin], u, v)) return bin == 0 ? last : bin - 1;
  return isAtOrAfter(edges_[next], u, v) ? next : bin;
}

// Right to within one bin; index() settles it.
std::size_t AzimuthBins::estimate(double x, double y) const {
  const double azimuth = std::atan2(y, x);
  const double position = (azimuth < 0.0 ? azimuth + 2.0 * M_PI : azimuth) * bins_per_radian_;
  const auto bin = static_cast<std::size_t>(position);
  return bin < count() ? bin : count() - 1;
}

}  // namespace smoke_ground_reconstruction
