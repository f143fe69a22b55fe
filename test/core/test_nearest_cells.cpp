#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "smoke_ground_reconstruction/nearest_cells.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr int kSide = NearestCells::kSide;

std::vector<std::uint8_t> noCells() {
  return std::vector<std::uint8_t>(static_cast<std::size_t>(kSide) * kSide, 0);
}

NearestCells::Found nearestOfAll(const std::vector<std::uint8_t>& is_marked, int column, int row) {
  NearestCells::Found best{-1, std::numeric_limits<std::int32_t>::max()};
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int cell = y * kSide + x;
      const int square = (x - column) * (x - column) + (y - row) * (y - row);
      if (is_marked[static_cast<std::size_t>(cell)] != 0 && square < best.square) {
        best = {cell, square};
      }
    }
  }
  return best;
}

void expectNearestOfAll(const std::vector<std::uint8_t>& is_marked, int column, int row,
                        NearestCells* cells) {
  const NearestCells::Found found = cells->of(column, row);
  const NearestCells::Found expected = nearestOfAll(is_marked, column, row);
  EXPECT_EQ(found.cell, expected.cell) << "column " << column << ", row " << row;
  EXPECT_EQ(found.square, expected.square) << "column " << column << ", row " << row;
}

TEST(NearestCells, AreNoneWhereNoneIsMarked) {
  NearestCells cells;
  cells.take(noCells());
  EXPECT_TRUE(cells.empty());
}

TEST(NearestCells, TakesTheLeastOfThoseAsNear) {
  auto is_marked = noCells();
  for (const int cell : {10 * kSide + 20, 10 * kSide + 24, 14 * kSide + 20, 14 * kSide + 24}) {
    is_marked[static_cast<std::size_t>(cell)] = 1;
  }
  NearestCells cells;
  cells.take(is_marked);
  EXPECT_EQ(cells.of(22, 12).cell, 10 * kSide + 20);
  EXPECT_EQ(cells.of(22, 12).square, 8);
  EXPECT_EQ(cells.of(22, 13).cell, 14 * kSide + 20);
  EXPECT_EQ(cells.of(23, 12).cell, 10 * kSide + 24);
  EXPECT_EQ(cells.of(20, 14).square, 0);
}

TEST(NearestCells, AreThoseThatALookAtAllFinds) {
  std::mt19937 random(7);
  NearestCells cells;
  for (const int count : {1, 2, 5, 40, 400}) {
    auto is_marked = noCells();
    std::uniform_int_distribution<int> any(0, kSide * kSide - 1), place(-300, kSide + 300);
    for (int k = 0; k < count; ++k) is_marked[static_cast<std::size_t>(any(random))] = 1;
    cells.take(is_marked);
    for (int k = 0; k < 300; ++k) {
      expectNearestOfAll(is_marked, place(random), place(random), &cells);
      const int near = any(random);
      expectNearestOfAll(is_marked, near % kSide, near / kSide, &cells);
    }
  }
}

}  // namespace
}  // namespace smoke_ground_reconstruction
