#include "point_loops.hpp"

#include <cmath>

#include "multiversion.hpp"
#include "ordered.hpp"

namespace smoke_ground_reconstruction {

SMOKE_GROUND_MULTIVERSION
void turnPoints(const PointArrays& points, const std::array<double, 9>& rotation, float* x,
                float* y, float* z) {
  const Matrix3 r = rotation;
  for (std::size_t i = 0; i < points.size; ++i) {
    const double px = points.x[i];
    const double py = points.y[i];
    const double pz = points.z[i];
    x[i] = static_cast<float>((r[0] * px + r[1] * py) + r[2] * pz);
    y[i] = static_cast<float>((r[3] * px + r[4] * py) + r[5] * pz);
    z[i] = static_cast<float>((r[6] * px + r[7] * py) + r[8] * pz);
  }
}

SMOKE_GROUND_MULTIVERSION
void rangesAndHeights(const PointArrays& points, const std::array<double, 3>& plane, float* planar,
                      float* height) {
  const double a = plane[0];
  const double b = plane[1];
  const double c = plane[2];
  for (std::size_t i = 0; i < points.size; ++i) {
    const double x = points.x[i];
    const double y = points.y[i];
    const double z = points.z[i];
    planar[i] = static_cast<float>(std::sqrt(x * x + y * y));
    height[i] = static_cast<float>(z - ((a * x + b * y) + c));
  }
}

}  // namespace smoke_ground_reconstruction
