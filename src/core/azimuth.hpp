#pragma once

#include <cmath>

namespace smoke_ground_reconstruction {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kAzimuthError = 4e-6;  ///< of azimuthOf() [rad]

/// Azimuth of (x, y) from 0 at +x to 2 pi, counter-clockwise, to kAzimuthError: where a cheap guess
/// serves, exact tests follow and loops must vectorize. Not for (0, 0), nor where |x| + |y| is
/// below 1e-30. Polynomial: arc tangent within a quarter turn to 1.7e-6, by a fit of the least
/// greatest error; rounding in single precision adds 6e-7.
inline float azimuthOf(float x, float y) {
  const float from_diagonal = (std::fabs(y) - std::fabs(x)) / (std::fabs(y) + std::fabs(x));
  const float t = from_diagonal * from_diagonal;
  const float tt = t * t;
  // In pairs: processors wait less for the last result.
  const float per_diagonal = ((0.9999772F - 0.3326228F * t) + (0.1935404F - 0.1164264F * t) * tt) +
                             (0.0526473F - 0.01171912F * t) * (tt * tt);
  const float turn = std::copysign(1.0F, x) * std::copysign(1.0F, y);
  const float diagonal =  // of the quarter
      3.1415926536F - std::copysign(1.5707963268F + std::copysign(0.7853981634F, x), y);
  return diagonal + per_diagonal * (from_diagonal * turn);
}

}  // namespace smoke_ground_reconstruction
