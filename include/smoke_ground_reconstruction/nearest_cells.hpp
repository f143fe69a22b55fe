#pragma once

#include <algorithm>
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
  Found of(int column, int row) {
    const auto to_column = static_cast<std::size_t>(column + kMargin);
    const auto to_row = static_cast<std::size_t>(row + kMargin);
    if (to_column >= kWide || to_row >= kWide) return searchRows(column, row);
    if (is_known_[to_column] == 0) findColumn(column);
    return inRow(row_[to_column * kWide + to_row], column, row);
  }

 private:
  static constexpr int kMargin = 192;                // cells beyond the grid that are remembered
  static constexpr int kWide = kSide + 2 * kMargin;  // with them

  void takeRow(const std::uint8_t* is_marked, std::uint8_t* nearest) const;
  void findColumn(int column);
  /// The marked cell of a row that is nearest to a cell.
  Found inRow(int marked_row, int column, int row) const {
    const int inside = std::clamp(column, 0, kSide - 1);
    const int marked_column = nearest_[static_cast<std::size_t>(marked_row * kSide + inside)];
    const int across = column - marked_column, along = row - marked_row;
    return {marked_row * kSide + marked_column, across * across + along * along};
  }
  Found searchRows(int column, int row) const;

  std::vector<int> rows_;               // with marked cells
  std::vector<std::uint8_t> nearest_;   // of a row with any: column of the one nearest to each
  std::vector<std::uint8_t> is_known_;  // per column, those beyond the grid as well
  std::vector<std::uint8_t> row_;       // of the nearest of each cell, column by column
};

}  // namespace smoke_ground_reconstruction
