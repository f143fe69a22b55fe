#pragma once

#include <cstddef>
#include <cstdint>

#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {

constexpr std::size_t kHalo = 8;  ///< columns looked at to either side
constexpr double kAngleMargin = 2e-5;

/// A row of any layer where neighbours can lie, so many columns to either side.
struct NearRow {
  std::uint32_t row;
  std::uint32_t columns;
};

/// Where neighbours of a row's points can lie: the places [begin, end) of a list. Those of a row
/// without points: nowhere.
struct RowReach {
  std::uint32_t begin = 0, end = 0;
};

/// The rows of a raster near each of its rows, measured on their points.
class NearRows {
 public:
  /// \return false where points are too near for single precision, or reaches too wide.
  bool find(const Scan& scan, const ScanRaster& raster, double radius_per_range);

  const Recycled<RowReach>& reaches() const { return reaches_; }  ///< by row
  const NearRow* rows() const { return rows_.data(); }            ///< what reaches() are of

 private:
  Recycled<RowReach> reaches_;
  Recycled<NearRow> rows_;
};

}  // namespace smoke_ground_reconstruction
