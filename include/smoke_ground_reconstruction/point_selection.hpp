#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/scan_view.hpp"

namespace smoke_ground_reconstruction {

/// Structure-of-arrays copy of some points of a view, in its order and frame.
class PointSelection {
 public:
  void append(const ScanView& scan, std::size_t i) {
    x_.push_back(scan.x[i]);
    y_.push_back(scan.y[i]);
    z_.push_back(scan.z[i]);
    intensity_.push_back(scan.intensity[i]);
    ring_.push_back(scan.ring[i]);
  }
  /// The points of one label.
  /// \param labels  one per point.
  void appendAll(const ScanView& scan, const std::vector<Label>& labels, Label label) {
    for (std::size_t i = 0; i < scan.size; ++i) {
      if (labels[i] == label) append(scan, i);
    }
  }
  ScanView view() const { return ScanView::of(x_, y_, z_, intensity_, ring_); }

 private:
  Recycled<float> x_, y_, z_, intensity_;
  Recycled<std::uint16_t> ring_;
};

}  // namespace smoke_ground_reconstruction
