#pragma once

#include <array>
#include <cstddef>

#include "lanes.hpp"
#include "smoke_ground_reconstruction/scan_view.hpp"

namespace smoke_ground_reconstruction {

/// Do x, y, z and intensity of a point lie side by side, as most drivers pack them?
inline bool isPacked(const ScanView& view) {
  constexpr std::ptrdiff_t kSize = sizeof(float);
  const auto lies = [&](const StridedField<float>& field, std::ptrdiff_t behind_x) {
    return field.data() == view.x.data() + behind_x && field.stride() == view.x.stride();
  };
  return lies(view.y, kSize) && lies(view.z, 2 * kSize) && lies(view.intensity, 3 * kSize);
}

/// x, y, z and intensity of four points from the first on, where isPacked().
inline std::array<FourFloats, 4> fourPoints(const ScanView& view, std::size_t first) {
  const StridedField<FourFloats> points(view.x.data(), view.x.stride());
  return transposed(points[first], points[first + 1], points[first + 2], points[first + 3]);
}

}  // namespace smoke_ground_reconstruction
