#pragma once

#include <cmath>

namespace smoke_ground_reconstruction {

constexpr double kOnceAround = 4.0;  ///< turnOf() just before +x

/// Stand-in for the azimuth of (x, y) where only its order matters: grows with it from 0 at +x to
/// kOnceAround, between 0.5 and 1 per radian, without an arc tangent. Right to 1e-15. 0 for (0, 0).
inline double turnOf(double x, double y) {
  const double sum = std::fabs(x) + std::fabs(y);
  if (sum == 0.0) return 0.0;
  const double part = y / sum;
  if (x < 0.0) return 2.0 - part;
  return part < 0.0 ? kOnceAround + part : part;
}

}  // namespace smoke_ground_reconstruction
