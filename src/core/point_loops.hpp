#pragma once

#include <array>
#include <cstddef>

namespace smoke_ground_reconstruction {

// Loops over all returns of a scan, compiled to vectors. No version gives other numbers.

/// Coordinates of points in one array each [m].
struct PointArrays {
  const float *x, *y, *z;
  std::size_t size;
};

/// The points in a frame turned by a rotation (row by row); sums in double. Not in place.
void turnPoints(const PointArrays& points, const std::array<double, 9>& rotation, float* x,
                float* y, float* z);

/// Planar range and height over the plane z = a x + b y + c [m].
void rangesAndHeights(const PointArrays& points, const std::array<double, 3>& plane, float* planar,
                      float* height);

}  // namespace smoke_ground_reconstruction
