#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace smoke_ground_reconstruction {

// Sums in one fixed order and small linear algebra written out, as in reference/ordered.py: what
// decisions hang on is the same to the last bit in both engines.

/// Four running sums, of every fourth value each, then theirs.
class OrderedSum {
 public:
  void add(double value) { lanes_[count_++ % kLanes] += value; }
  double value() const { return (lanes_[0] + lanes_[1]) + (lanes_[2] + lanes_[3]); }
  std::size_t count() const { return count_; }

  static constexpr std::size_t kLanes = 4;

 private:
  std::array<double, kLanes> lanes_ = {0, 0, 0, 0};
  std::size_t count_ = 0;
};

using Matrix3 = std::array<double, 9>;  ///< row by row
using Vector3 = std::array<double, 3>;

constexpr Matrix3 kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/// Inverse of a symmetric matrix by its cofactors; only the upper half is read.
inline Matrix3 symmetricInverse(const Matrix3& m) {
  const double xx = m[0], xy = m[1], xz = m[2], yy = m[4], yz = m[5], zz = m[8];
  const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
  const double d = xx * zz - xz * xz, e = xy * xz - xx * yz, f = xx * yy - xy * xy;
  const double determinant = (xx * a + xy * b) + xz * c;
  return {a / determinant, b / determinant, c / determinant, b / determinant, d / determinant,
          e / determinant, c / determinant, e / determinant, f / determinant};
}

inline Vector3 times(const Matrix3& m, const Vector3& v) {
  return {(m[0] * v[0] + m[1] * v[1]) + m[2] * v[2], (m[3] * v[0] + m[4] * v[1]) + m[5] * v[2],
          (m[6] * v[0] + m[7] * v[1]) + m[8] * v[2]};
}

inline Matrix3 times(const Matrix3& a, const Matrix3& b) {
  Matrix3 product{};
  for (std::size_t column = 0; column < 3; ++column) {
    const Vector3 v = times(a, Vector3{b[column], b[3 + column], b[6 + column]});
    for (std::size_t row = 0; row < 3; ++row) product[3 * row + column] = v[row];
  }
  return product;
}

inline Matrix3 transposed(const Matrix3& m) {
  return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}

/// Unit vector along which a symmetric spread is least, and that spread.
struct LeastAxis {
  double x, y, spread;
};

inline LeastAxis leastAxis(double xx, double xy, double yy) {
  const double half = 0.5 * (xx - yy);
  const double radius = std::sqrt(half * half + xy * xy);
  const double x = half >= 0.0 ? -xy : radius - half;
  const double y = half >= 0.0 ? half + radius : -xy;
  const double length = std::sqrt(x * x + y * y);
  if (length == 0.0) return {1.0, 0.0, 0.5 * (xx + yy)};
  return {x / length, y / length, 0.5 * (xx + yy) - radius};
}

/// std::floor of a value that an int can hold, without a call into the library.
inline int floorToInt(double value) {
  const int truncated = static_cast<int>(value);
  return truncated - (value < truncated ? 1 : 0);
}

}  // namespace smoke_ground_reconstruction
