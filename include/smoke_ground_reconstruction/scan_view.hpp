#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace smoke_ground_reconstruction {

/// Read-only look at one field of `size` points that lie `stride` bytes apart.
/// Reads through memcpy, so fields may be unaligned (Hesai's driver packs points to 26 bytes).
template <typename T>
class StridedField {
 public:
  StridedField() = default;
  StridedField(const void* data, std::ptrdiff_t stride_bytes)
      : data_(static_cast<const unsigned char*>(data)), stride_(stride_bytes) {}

  T operator[](std::size_t index) const {
    T value;
    std::memcpy(&value, data_ + static_cast<std::ptrdiff_t>(index) * stride_, sizeof(T));
    return value;
  }

  const unsigned char* data() const { return data_; }
  std::ptrdiff_t stride() const { return stride_; }

 private:
  const unsigned char* data_ = nullptr;
  std::ptrdiff_t stride_ = sizeof(T);
};

/// One scan as it lies in somebody else's memory; nothing is owned or copied.
/// Coordinates in metres in the sensor frame, intensity on the sensor's own scale, `ring` as the
/// driver numbers it. Points come in any order and may be non-finite or zero.
struct ScanView {
  StridedField<float> x, y, z, intensity;
  StridedField<std::uint16_t> ring;
  std::size_t size = 0;

  /// A look at one vector a field, all of the same length; they must outlive the view.
  static ScanView of(const std::vector<float>& x, const std::vector<float>& y,
                     const std::vector<float>& z, const std::vector<float>& intensity,
                     const std::vector<std::uint16_t>& ring) {
    ScanView view;
    view.x = {x.data(), sizeof(float)};
    view.y = {y.data(), sizeof(float)};
    view.z = {z.data(), sizeof(float)};
    view.intensity = {intensity.data(), sizeof(float)};
    view.ring = {ring.data(), sizeof(std::uint16_t)};
    view.size = x.size();
    return view;
  }
};

}  // namespace smoke_ground_reconstruction
