#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace smoke_ground_reconstruction {

/// The nearest of the marked cells of a square grid, of any cell within and beyond it.
///
/// An exact distance transform in two passes: the nearest marked cell of each row, then, a column
/// at a time and once it is asked for, the lower envelope of what the rows offer (Felzenszwalb and
/// Huttenlocher 2012). O(1) per cell of a column. Keeps its buffers.
class NearestCells {
 public:
  static constexpr int kSide = 128;  ///< cells along each side of the grid

  struct Found {
    std::int32_t cell;    ///< row * kSide + column; the least of those as near
    std::int32_t square;  ///< of the way, in cells
  };

  /// \param is_marked  per cell, 0 or 1, row by row.
  void take(const std::vector<std::uint8_t>& is_marked);
  bool empty() const { return rows_.empty(); }
  /// Of the cell in a column and a row; some cell must be marked.
  Found of(int column, int row);

 private:
  void takeRow(const std::uint8_t* is_marked, std::uint8_t* nearest) const;
  void findColumn(int column);
  Found inRow(int marked_row, int column, int row) const;
  Found searchRows(int column, int row) const;

  std::vector<int> rows_;               // with marked cells
  std::vector<std::uint8_t> nearest_;   // of a row with any: column of the one nearest to each
  std::vector<std::uint8_t> is_known_;  // per column, those beyond the grid as well
  std::vector<std::uint8_t> row_;       // of the nearest of each cell, column by column
};

}  // namespace smoke_ground_reconstruction
