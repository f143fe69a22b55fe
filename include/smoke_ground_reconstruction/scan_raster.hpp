#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// The kept points of a scan in a raster: a row per ring, as the driver numbers them, a column per
/// azimuth bin. Of each place the point of the lowest index is in it; where a sensor fires once per
/// ring and bin that is all of them, and nothing needs sorting. Where many places have two points,
/// as with dual returns, a second layer takes the next ones. The raster lies in memory stripe by
/// stripe of kWidth columns, row by row in each: drivers send columns or rows, and with either what
/// follows each other lies close.
struct ScanRaster {
  /// A point whose place is taken in all layers.
  struct Extra {
    std::uint32_t place;
    std::uint32_t point;
  };

  static constexpr std::size_t kWidth = 16;  ///< of a stripe; the last one may have empty columns

  std::size_t columns;
  std::size_t stripes;
  std::size_t rows;
  bool has_second = false;        ///< a second layer, secondOf() each place
  bool is_crowded;                ///< nothing below is of use: there are too many extras, or places
  Recycled<float> x, y, z;        ///< by place; x is NaN where no point lies
  Recycled<std::uint32_t> place;  ///< per point of the scan; nowhere(): in none, or an extra
  Recycled<Extra> extras;         ///< by place, then by point

  /// \param labels  one per point; those other than kKept take no part.
  /// \param most_layers  1 or 2.
  ScanRaster(const Scan& scan, const std::vector<Label>& labels, const AzimuthBins& bins,
             std::size_t most_layers = 2);

  /// Takes all points out that have another label than kKept. Those that had found their places
  /// taken take the places left. \param scan  the one it was made of.
  void keep(const Scan& scan, const std::vector<Label>& labels);

  /// Rows of a scan's raster: one more than its greatest ring.
  static std::size_t rowsFor(const Scan& scan);

  std::uint32_t nowhere() const { return static_cast<std::uint32_t>(stripes * rows * kWidth); }
  std::size_t secondOf(std::size_t at) const { return nowhere() + 1U + at; }
  bool isTaken(std::size_t at) const { return x[at] == x[at]; }
  std::size_t rowOf(std::size_t at) const { return at % (rows * kWidth) / kWidth; }

 private:
  void fill(const Scan& scan, const std::vector<Label>& labels, const AzimuthBins& bins,
            std::size_t most_layers);
  void put(const Scan& scan, const float* from_x, std::size_t begin, std::size_t size);
  void putInTwo(const Scan& scan, const float* from_x, std::size_t begin, std::size_t size);
  void addSecond(const Scan& scan);
  void moveTo(std::size_t at, const Scan& scan, std::size_t point);
  void keepExtras(const Scan& scan, const std::vector<Label>& labels);
};

}  // namespace smoke_ground_reconstruction
