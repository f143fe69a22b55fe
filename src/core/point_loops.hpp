#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/return_kind.hpp"
#include "smoke_ground_reconstruction/scan_view.hpp"

namespace smoke_ground_reconstruction {

// Loops over all returns of a scan, compiled to vectors. No version gives other numbers.

/// Coordinates of points in one array each [m].
struct PointArrays {
  const float *x, *y, *z;
  std::size_t size;
};

/// Where the returns of a scan are put, one array each.
struct TakenReturns {
  float *x, *y, *z, *intensity;
  std::uint16_t* ring;
  std::uint32_t* index;  ///< in the scan; not told where all points are returns
};

/// Takes the points of a scan that isReturn(), in order.
/// \param to  with room for all points.
/// \return their number.
std::size_t takeReturns(const ScanView& scan, const TakenReturns& to);

/// The points in a frame turned by a rotation (row by row); sums in double. Not in place.
void turnPoints(const PointArrays& points, const std::array<double, 9>& rotation, float* x,
                float* y, float* z);

/// Points that are worked on together, so that what is told of them stays in the fastest memory.
constexpr std::size_t kTogether = 2048;

/// Planar range and height over the plane z = a x + b y + c [m], in single precision.
void rangesAndHeights(const PointArrays& points, const std::array<double, 3>& plane, float* planar,
                      float* height);

/// Bounds of what returns may be, none of them included: heights over the plane, planar ranges [m].
struct KindBounds {
  double low, low_range;             // of the height's amount; of the range
  double lift_square;                // or of the square of height times range, in single precision
  double deep;                       // from above
  double near_lowest, near_highest;  // from both sides, as those that follow
  double above, wall_highest;        // soft returns, too, lie above
  double wall_nearest, wall_farthest;
  double ceiling_lowest, ceiling_highest;
  double soft_square;  // of the range, in single precision
};

/// What returns may be; soft is whatever lies so near. Comparisons are exact, but for squares.
void findKinds(const float* planar, const float* z, const float* height, std::size_t size,
               const KindBounds& bounds, std::uint8_t* kind);

/// Leaves those soft, and no wall, that are weak: by their strength, intensity times the range's
/// square in single precision.
void judgeSoft(const float* planar, const float* z, const float* intensity, std::size_t size,
               double gate, std::uint8_t* kind);

/// The indices of `size` flags that are as wanted under a mask, in order.
void listWhere(const std::uint8_t* flags, std::size_t size, std::uint8_t mask, std::uint8_t wanted,
               std::vector<std::uint32_t>* list);

inline void listWhere(const std::vector<std::uint8_t>& flags, std::uint8_t mask,
                      std::uint8_t wanted, std::vector<std::uint32_t>* list) {
  listWhere(flags.data(), flags.size(), mask, wanted, list);
}

/// Of returns that are of a kind.
inline void listKind(const std::vector<std::uint8_t>& kinds, ReturnKind::Bit kind,
                     std::vector<std::uint32_t>* list) {
  listWhere(kinds, kind, kind, list);
}

}  // namespace smoke_ground_reconstruction
