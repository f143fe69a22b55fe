#pragma once

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

// Single precision errs by 3e-7 of a squared distance, as long as nothing under- or overflows.
constexpr double kScreenMargin = 1e-6;
constexpr double kLeastScreened = 1e-20;    // squared radius [m^2]
constexpr double kGreatestScreened = 1e30;  // squared radius [m^2]

constexpr double kSineMargin = 2e-6;  // of elevations known in single precision

/// Of one point, or of the points in lanes.
template <typename Number>
SMOKE_GROUND_PART Number squaredRangeOf(const Number& x, const Number& y, const Number& z) {
  return (x * x + y * y) + z * z;
}

/// Factors of squared ranges: balls a hair smaller and a hair larger than the one asked about.
struct ScreenFactors {
  float surely, possibly;

  explicit ScreenFactors(double radius_per_range) {
    const double squared = radius_per_range * radius_per_range;
    surely = static_cast<float>(squared * (1.0 - 4.0 * kScreenMargin));
    possibly = static_cast<float>(squared * (1.0 + 4.0 * kScreenMargin));
  }
};

}  // namespace smoke_ground_reconstruction
