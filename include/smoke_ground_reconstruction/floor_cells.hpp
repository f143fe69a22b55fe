#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace smoke_ground_reconstruction {

/// Square grid of cells around the sensor, 512 to each side; gives each cell a number.
class CellGrid {
 public:
  static constexpr std::size_t kAcross = 1024;
  static constexpr std::size_t kCells = kAcross * kAcross;
  static constexpr std::uint32_t kOutside = kCells;

  /// \param size  edge of a cell [m].
  explicit CellGrid(double size) : size_(size) {}
  double size() const { return size_; }
  /// The cell of a place; kOutside beyond the grid.
  std::uint32_t cellOf(double x, double y) const;
  /// The same of `size` places.
  void cellsOf(const float* x, const float* y, std::size_t size, std::uint32_t* cells) const;

 private:
  double size_;
};

/// Some cells of a grid of square cells.
class CellSet {
 public:
  /// Stands for a cell that always is among them.
  static constexpr std::uint32_t kAlways = CellGrid::kOutside + 1;

  CellSet();
  /// \param size  edge of a cell [m].
  void clear(double size);
  /// The cells of `size` places.
  void insert(const float* x, const float* y, std::size_t size);
  /// \param cell  as grid() numbers them; kOutside never is.
  bool contains(std::uint32_t cell) const { return is_in_[cell] != 0; }
  /// 1 if it is, else 0.
  std::uint32_t bit(std::uint32_t cell) const { return is_in_[cell]; }
  const CellGrid& grid() const { return grid_; }

 private:
  CellGrid grid_;
  std::vector<std::uint8_t> is_in_;  // by cell
  std::uint32_t lowest_, highest_;   // of the cells
  std::vector<std::uint32_t> cells_;
};

/// Cells of 0.2 m that are as level as the floor, or floor, by the median of their low returns.
/// Where these are few the cells around must be level, too.
class LevelCells {
 public:
  LevelCells();
  /// \param level, floor  the median of a level cell, and of one of floor, lies so near to the
  ///                      plane [m].
  void clear(double level, double floor);
  /// A low return at a height over the floor [m].
  void add(double x, double y, double height);
  bool isLevel(double x, double y) const;
  /// The same of a cell with few returns, together with those around it.
  bool isLevelAround(double x, double y) const;
  bool isFloor(double x, double y) const;
  /// The same of a cell with few returns, together with those around it.
  bool isFloorAround(double x, double y) const;

 private:
  template <typename Number>
  struct BandOf {
    Number below_top = 0, below_bottom = 0;  // returns
  };
  using Band = BandOf<std::uint16_t>;
  struct Counts {
    std::uint16_t all = 0;
    Band level, floor;
  };
  static void count(double height, double half, Band* band);
  template <typename Number>
  static bool isMedianIn(const BandOf<Number>& band, Number all);
  bool isMedianAround(double x, double y, std::uint16_t few, Band Counts::*of) const;
  const Counts* find(double x, double y, std::uint16_t least) const;

  CellGrid grid_;
  double level_ = 0.0, floor_ = 0.0;
  std::vector<Counts> counts_;
  std::vector<std::uint32_t> touched_;
};

}  // namespace smoke_ground_reconstruction
