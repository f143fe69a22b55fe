#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "near_rows.hpp"
#include "neighbor_screen.hpp"

namespace smoke_ground_reconstruction {

// Neighbours of the points of one stripe of a ScanRaster, eight points at a time.

/// Width of a stripe with the columns around it.
constexpr std::size_t kSpan = ScanRaster::kWidth + 2 * kHalo;

/// The rows of a stripe, layer by layer, with the columns around it.
struct Around {
  Recycled<float> x, y, z;                  // rows of kSpan
  Recycled<std::int32_t> surely, possibly;  // found so far, rows of kWidth

  explicit Around(std::size_t rows)
      : x(rows * kSpan),
        y(x.size()),
        z(x.size()),
        surely(rows * ScanRaster::kWidth),
        possibly(surely.size()) {}
};

/// The rows of a stripe with the columns around it. \param from  the stripe's first place, between
/// those of others.
void takeRows(const float* from, std::size_t rows, float* to);

/// Neighbours of all points of a stripe, until each has found enough, itself included.
void findAllNeighbors(const std::vector<RowReach>& reaches, std::size_t layers,
                      const NearRow* near_rows, const ScreenFactors& by, std::int32_t enough,
                      Around* around);

/// Which points of a stripe's rows found too few. Returns whether some are in doubt.
bool findLonely(const Around& around, std::size_t begin, std::size_t end, std::int32_t enough,
                std::int8_t* is_lonely);

/// An extra of the raster in or beside a stripe.
struct Aside {
  std::array<float, 3> at;
  std::uint32_t point;
  std::uint32_t row;
  std::size_t column;  // of kSpan

  bool isInStripe() const { return column >= kHalo && column < kHalo + ScanRaster::kWidth; }
};

/// Counts an extra for the points of the stripe in one of its rows.
void countAside(const Aside& aside, std::size_t row, const ScreenFactors& factors, Around* around);

}  // namespace smoke_ground_reconstruction
