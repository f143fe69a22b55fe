#include "smoke_ground_reconstruction/hidden_drops.hpp"

#include <algorithm>
#include <limits>

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kThick = 3.0;          // sensor heights: floor seen no farther leaves drops unseen
constexpr double kFarthestShare = 0.9;  // of the columns see the floor no farther than it is seen
constexpr double kOpen = 0.5;  // columns tell how far if their wall stands so far behind it [m]
constexpr std::size_t kFloorBeside = 12;   // columns to either side that share what they measure
constexpr double kGoesOn = 0.3;            // floor goes on so far beyond what is measured [m]
constexpr std::size_t kWallBeside = 2;     // columns that share what they see of the wall
constexpr std::uint32_t kWallReturns = 4;  // from low down

/// Calls with each column from some before one to as many after it.
template <typename Use>
void around(std::size_t column, std::size_t beside, std::size_t columns, const Use& use) {
  for (std::size_t k = 0; k <= 2 * beside; ++k) use((column + columns + k - beside) % columns);
}

}  // namespace

bool CertainFloor::isInDoubt(const std::vector<double>& floor, const std::vector<double>& distance,
                             const DropOffs& drops, double sensor_height) {
  const std::size_t columns = floor.size();
  is_open_.resize(columns);
  reach_.clear();
  bool is_any_open = false;
  for (std::size_t c = 0; c < columns; ++c) {
    const bool falls = drops.begin[c] < kInfinity;
    const bool is_open = distance[c] == 0.0 || falls;
    is_open_[c] = is_open ? 1 : 0;
    is_any_open = is_any_open || is_open;
    // Does smoke, not a wall or a drop, end the floor's view?
    if (!(floor[c] > 0.0) || falls) continue;
    if (distance[c] == 0.0 || distance[c] > floor[c] + kOpen) reach_.push_back(floor[c]);
  }
  if (!is_any_open || reach_.empty()) return false;
  const auto place = static_cast<std::size_t>(kFarthestShare * static_cast<double>(reach_.size()));
  const auto farthest = reach_.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(reach_.begin(), farthest, reach_.end());
  return *farthest < kThick * sensor_height;
}

void CertainFloor::find(const std::vector<double>& floor, const std::vector<double>& distance,
                        const DropOffs& drops, const std::vector<std::uint32_t>& low_wall,
                        std::vector<double>* certain) {
  const std::size_t columns = floor.size();
  certain->assign(columns, kInfinity);
  markBeside(low_wall);
  for (std::size_t c = 0; c < columns; ++c) {
    if (distance[c] != 0.0 && is_doubted_[c] == 0) continue;
    double near = 0.0;
    around(c, kFloorBeside, columns, [&](std::size_t at) { near = std::max(near, floor[at]); });
    (*certain)[c] = std::max(near + kGoesOn, drops.floor_to[c]);
  }
}

/// Columns between an open one and the first one to either side that sees its wall low down.
void CertainFloor::markBeside(const std::vector<std::uint32_t>& low_wall) {
  const std::size_t columns = is_open_.size();
  is_doubted_.assign(columns, 0);
  const auto sees_wall = [&](std::size_t column) {
    std::uint32_t returns = 0;
    around(column, kWallBeside, columns, [&](std::size_t at) { returns += low_wall[at]; });
    return returns >= kWallReturns;
  };
  for (std::size_t c = 0; c < columns; ++c) {
    if (is_open_[c] == 0) continue;
    for (const std::size_t step : {std::size_t{1}, columns - 1}) {
      std::size_t at = (c + step) % columns;
      while (is_open_[at] == 0 && is_doubted_[at] == 0 && !sees_wall(at)) {
        is_doubted_[at] = 1;
        at = (at + step) % columns;
      }
    }
  }
}

}  // namespace smoke_ground_reconstruction
