#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

/// Does an angle [deg] divide 360 into 4 to 36,000 bins (1e-6 relative)?
bool dividesCircle(double width_deg);

/// Equal bins of azimuth [a, b) around the vertical, the first beginning at +x, counter-clockwise.
/// Serves the columns of a scan (0.4 deg) and the segments of the polar grid (10 deg).
class AzimuthBins {
 public:
  /// \param width_deg  angle of a bin [deg]; dividesCircle().
  /// \throws std::invalid_argument naming the width otherwise.
  explicit AzimuthBins(double width_deg);

  std::size_t count() const { return edges_.size(); }

  /// Bin of the direction (x, y); the point on the axis (0, 0) is in bin 0. Decided by products
  /// with the bin's edges (Direction), so the answer does not hang on the rounding of atan2.
  std::size_t index(float x, float y) const;

  /// The same of many points; any number where a coordinate is not finite.
  void indices(const float* x, const float* y, std::size_t size, std::uint32_t* index) const;

 private:
  void binsBeforeSlots();
  std::uint32_t beside(std::uint32_t edge, float x, float y) const;
  std::size_t slotOf(double turn) const;

  std::vector<Direction> edges_;
  std::vector<std::uint32_t> bin_before_;  // by slot of turns
};

/// Number of a column counted on beyond the last one. Divides by no number: loops over columns do
/// little else.
inline std::size_t wrapped(std::size_t column, std::size_t columns) {
  while (column >= columns) column -= columns;
  return column;
}

/// The greatest value of each column and of so many to either side; 0 at least.
void greatestBeside(const std::vector<double>& values, std::size_t beside,
                    std::vector<double>* greatest);

}  // namespace smoke_ground_reconstruction
