#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace smoke_ground_reconstruction {

/// Planar ranges by column, in no order within it. Keeps its buffers.
class ColumnRanges {
 public:
  /// How many ranges lie beyond a distance, and the nearest of them; infinite where none does.
  struct Beyond {
    std::size_t count = 0;
    double nearest = std::numeric_limits<double>::infinity();
  };

  void clear(std::size_t columns);
  void add(std::uint16_t column, double range) { items_.push_back({column, range}); }
  void sort();  ///< by column; to be called after the last add() and before anything else

  std::size_t columns() const { return begin_.size() - 1; }
  bool isEmpty() const { return items_.empty(); }
  const double* begin(std::size_t column) const { return ranges_.data() + begin_[column]; }
  const double* end(std::size_t column) const { return ranges_.data() + begin_[column + 1]; }
  /// The farthest range of a column nearer than a distance; 0 where there is none.
  double lastBefore(std::size_t column, double distance) const;
  Beyond beyond(std::size_t column, double distance) const;
  /// Is a range of a column at most so far from a distance?
  bool isNear(std::size_t column, double distance, double tolerance) const;

 private:
  struct Item {
    std::uint16_t column;
    double range;
  };
  std::vector<Item> items_;
  std::vector<double> ranges_;
  std::vector<std::size_t> begin_;
};

}  // namespace smoke_ground_reconstruction
