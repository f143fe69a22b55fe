#pragma once

#include <cmath>

namespace smoke_ground_reconstruction {

// Every decision of the method is written here once, in operations that IEEE 754 defines to the
// last bit (+, -, *, sqrt on doubles, no fused multiply-add), so that C++, NumPy, x86 and ARM
// agree.

/// Squared distance of two points [m^2] in the one order of operations that all engines share.
inline double squaredDistance(float ax, float ay, float az, float bx, float by, float bz) {
  const double dx = static_cast<double>(ax) - static_cast<double>(bx);
  const double dy = static_cast<double>(ay) - static_cast<double>(by);
  const double dz = static_cast<double>(az) - static_cast<double>(bz);
  return (dx * dx + dy * dy) + dz * dz;
}

/// Planar range sqrt(x^2 + y^2) [m].
inline double planarRange(float x, float y) {
  const double xd = x;
  const double yd = y;
  return std::sqrt(xd * xd + yd * yd);
}

/// Range sqrt(x^2 + y^2 + z^2) [m].
inline double range(float x, float y, float z) {
  const double xd = x;
  const double yd = y;
  const double zd = z;
  return std::sqrt((xd * xd + yd * yd) + zd * zd);
}

/// Unit vector at an angle, rounded to float32: libraries that differ in the last bit of cos and
/// sin then still give the same vector. The rounding turns it by less than 1e-7 rad.
struct Direction {
  double cosine;
  double sine;

  static Direction fromDegrees(double angle_deg) {
    const double angle = angle_deg * (M_PI / 180.0);
    return {snapped(std::cos(angle)), snapped(std::sin(angle))};
  }

 private:
  // cos(pi/2) is 6e-17 in doubles; the axes are meant exactly.
  static double snapped(double value) {
    return std::fabs(value) < 1e-12 ? 0.0 : static_cast<double>(static_cast<float>(value));
  }
};

/// True where (u, v) lies counter-clockwise of `edge` or on it (within half a turn).
inline bool isAtOrAfter(const Direction& edge, double u, double v) {
  return edge.cosine * v >= edge.sine * u;
}

/// True where (u, v) lies less than a quarter turn from `direction`.
inline bool isAhead(const Direction& direction, double u, double v) {
  return direction.cosine * u + direction.sine * v > 0.0;
}

/// Closed window of angles [from, to], less than half a turn wide, decided by comparing products.
struct AngleWindow {
  Direction from;
  Direction to;

  static AngleWindow fromDegrees(double from_deg, double to_deg) {
    return {Direction::fromDegrees(from_deg), Direction::fromDegrees(to_deg)};
  }

  /// Is the angle of the vector (u, v) in the window? A zero vector has no angle: false.
  bool contains(double u, double v) const {
    // The products alone would take the opposite of a window without width for the window itself.
    const bool is_after_from = isAtOrAfter(from, u, v);
    const bool is_before_to = to.cosine * v <= to.sine * u;
    const bool is_ahead_of_from = isAhead(from, u, v);
    const bool is_ahead_of_to = isAhead(to, u, v);
    // No branches: loops over pairs of points vectorize.
    return is_after_from & is_before_to & (is_ahead_of_from | is_ahead_of_to);
  }
};

}  // namespace smoke_ground_reconstruction
