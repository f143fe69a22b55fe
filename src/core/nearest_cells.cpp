#include "smoke_ground_reconstruction/nearest_cells.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr int kSide = NearestCells::kSide;

/// A marked cell of a row as far as it is the nearest of a column's cells.
struct Piece {
  int begin;   // row of the column's cells
  int row;     // of the marked cell
  int height;  // (row of a cell)^2 - 2 (row of a cell) row + height is the square of the way
};

std::size_t at(int row, int column) { return static_cast<std::size_t>(row * kSide + column); }

/// The first row from which on a piece is nearer than another whose row comes before.
int firstNearer(const Piece& piece, const Piece& before) {
  const double gain = piece.height - before.height, per_row = 2 * (piece.row - before.row);
  return floorToInt(gain / per_row) + 1;
}

}  // namespace

void NearestCells::take(const std::vector<std::uint8_t>& is_marked) {
  rows_.clear();
  nearest_.resize(is_marked.size());
  for (int row = 0; row < kSide; ++row) {
    const std::uint8_t* const cells = is_marked.data() + at(row, 0);
    if (std::memchr(cells, 1, kSide) == nullptr) continue;
    rows_.push_back(row);
    takeRow(cells, nearest_.data() + at(row, 0));
  }
  is_known_.assign(kWide, 0);
  row_.resize(static_cast<std::size_t>(kWide) * kWide);
}

void NearestCells::takeRow(const std::uint8_t* is_marked, std::uint8_t* nearest) const {
  int left = -kSide;
  for (int column = 0; column < kSide; ++column) {
    if (is_marked[column] == 0) continue;
    // Those from the middle to the last one on are nearer to this one.
    const int middle = left < 0 ? 0 : (left + column) / 2 + 1;
    std::memset(nearest + middle, column, static_cast<std::size_t>(kSide - middle));
    left = column;
  }
}

NearestCells::Found NearestCells::searchRows(int column, int row) const {
  Found best{-1, std::numeric_limits<std::int32_t>::max()};
  for (const int marked_row : rows_) {
    const Found found = inRow(marked_row, column, row);
    if (found.square < best.square) best = found;
  }
  return best;
}

/// Which row holds the nearest marked cell of each of a column's.
void NearestCells::findColumn(int column) {
  std::array<Piece, kSide> pieces;
  std::size_t count = 0;
  for (const int row : rows_) {
    Piece piece{-kMargin, row, inRow(row, column, 0).square};
    for (; count > 0; --count) {
      piece.begin = firstNearer(piece, pieces[count - 1]);
      if (piece.begin > pieces[count - 1].begin) break;
    }
    if (count == 0) piece.begin = -kMargin;
    if (piece.begin < kSide + kMargin) pieces[count++] = piece;
  }
  const auto to_column = static_cast<std::size_t>(column + kMargin);
  std::uint8_t* const nearest = row_.data() + to_column * kWide + kMargin;
  for (std::size_t k = 0; k < count; ++k) {
    const int end = k + 1 < count ? pieces[k + 1].begin : kSide + kMargin;
    std::memset(nearest + pieces[k].begin, pieces[k].row,
                static_cast<std::size_t>(end - pieces[k].begin));
  }
  is_known_[to_column] = 1;
}

}  // namespace smoke_ground_reconstruction
