#include "smoke_ground_reconstruction/column_ranges.hpp"

#include <algorithm>
#include <cmath>

namespace smoke_ground_reconstruction {

void ColumnRanges::clear(std::size_t columns) {
  items_.clear();
  ranges_.clear();
  begin_.assign(columns + 1, 0);
}

void ColumnRanges::sort() {
  for (const Item& item : items_) ++begin_[item.column + 1U];
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) begin_[c + 1] += begin_[c];
  ranges_.resize(items_.size());
  for (const Item& item : items_) ranges_[begin_[item.column]++] = item.range;
  for (std::size_t c = begin_.size() - 1; c > 0; --c) begin_[c] = begin_[c - 1];
  begin_[0] = 0;
}

double ColumnRanges::lastBefore(std::size_t column, double distance) const {
  double last = 0.0;
  for (const double* range = begin(column); range != end(column); ++range) {
    if (*range < distance) last = std::max(last, *range);
  }
  return last;
}

bool ColumnRanges::isNear(std::size_t column, double distance, double tolerance) const {
  return std::any_of(begin(column), end(column),
                     [&](double range) { return std::fabs(distance - range) <= tolerance; });
}

ColumnRanges::Beyond ColumnRanges::beyond(std::size_t column, double distance) const {
  Beyond found;
  for (const double* range = begin(column); range != end(column); ++range) {
    if (!(*range > distance)) continue;
    ++found.count;
    found.nearest = std::min(found.nearest, *range);
  }
  return found;
}

}  // namespace smoke_ground_reconstruction
