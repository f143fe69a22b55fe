#include "smoke_ground_reconstruction/wall_feet.hpp"

#include <algorithm>
#include <cstddef>

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kNeighbors = 2;  // columns to either side that share what they see
constexpr std::size_t kRows = 10;      // returns of a foot that show that nothing lies below it
constexpr std::size_t kSteady = 12;    // columns side by side: no smoke that hides more is so wide

}  // namespace

void FloorSealer::find(const WallFeet& feet, const std::vector<std::uint8_t>& is_open,
                       double sensor_height, std::vector<double>* sealed) {
  const std::size_t columns = is_open.size();
  sealed->assign(columns, 0.0);
  if (feet.column.empty()) return;
  rows_.clear(columns);
  for (std::size_t i = 0; i < feet.column.size(); ++i) rows_.add(feet.column[i], feet.height[i]);
  rows_.sort();
  for (std::size_t c = 0; c < columns; ++c) {
    if (!(feet.distance[c] > 0.0)) continue;
    around_.clear();
    bool is_told = true;
    for (std::size_t k = 0; k <= 2 * kNeighbors; ++k) {
      const std::size_t at = (c + columns + k - kNeighbors) % columns;
      is_told = is_told && is_open[at] == 0;
      around_.insert(around_.end(), rows_.begin(at), rows_.end(at));
    }
    if (!is_told || around_.size() < kRows) continue;
    std::nth_element(around_.begin(), around_.begin() + (kRows - 1), around_.end());
    (*sealed)[c] = feet.distance[c] * (sensor_height / (sensor_height + around_[kRows - 1]));
  }
}

void FloorSealer::keepSteady(const std::vector<double>& sealed, std::vector<double>* steady) {
  *steady = sealed;
  const std::size_t columns = sealed.size();
  const auto gap = std::find(sealed.begin(), sealed.end(), 0.0);
  if (gap == sealed.end()) return;
  const auto start = static_cast<std::size_t>(gap - sealed.begin());
  std::size_t length = 0;
  for (std::size_t k = 1; k <= columns; ++k) {
    if (sealed[(start + k) % columns] > 0.0) {
      ++length;
      continue;
    }
    for (std::size_t back = 1; length < kSteady && back <= length; ++back) {
      (*steady)[(start + k - back) % columns] = 0.0;
    }
    length = 0;
  }
}

}  // namespace smoke_ground_reconstruction
