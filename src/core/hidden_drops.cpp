#include "smoke_ground_reconstruction/hidden_drops.hpp"

#include <algorithm>
#include <limits>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kWide = 12;          // columns of a gap in which a drop can hide
constexpr double kRisingShare = 0.5;       // of the columns of a gap in which a ramp leads on
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

bool CertainFloor::isInDoubt(const std::vector<double>& distance, const DropOffs& drops) {
  const auto is_drop = [](double begin) { return begin < kInfinity; };
  return std::find(distance.begin(), distance.end(), 0.0) != distance.end() ||
         std::any_of(drops.begin.begin(), drops.begin.end(), is_drop);
}

void CertainFloor::find(const std::vector<double>& floor, const std::vector<double>& distance,
                        const DropOffs& drops, const std::vector<std::uint32_t>& low_wall,
                        const std::vector<double>& stands, const std::vector<double>& rises,
                        std::vector<double>* certain) {
  const std::size_t columns = floor.size();
  markGaps(distance, rises);
  is_open_.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    is_open_[c] = is_gap_[c] != 0 || drops.begin[c] < kInfinity ? 1 : 0;
  }
  greatestBeside(floor, kFloorBeside, &measured_);
  markBeside(low_wall, stands);
  certain->assign(columns, kInfinity);
  for (std::size_t c = 0; c < columns; ++c) {
    if (is_gap_[c] == 0 && is_doubted_[c] == 0 && drops.is_doubted[c] == 0) continue;
    (*certain)[c] = std::max({measured_[c] + kGoesOn, stands[c], drops.floor_to[c]});
  }
}

/// Runs of columns without a boundary, from one known column to the next.
void CertainFloor::markGaps(const std::vector<double>& distance, const std::vector<double>& rises) {
  const std::size_t columns = distance.size();
  is_gap_.assign(columns, 0);
  const auto is_known = [](double reach) { return reach != 0.0; };
  const auto known = std::find_if(distance.begin(), distance.end(), is_known);
  if (known == distance.end()) return markGap(0, columns, rises);
  const auto start = static_cast<std::size_t>(known - distance.begin());
  std::size_t length = 0;
  for (std::size_t k = 1; k <= columns; ++k) {
    const std::size_t c = (start + k) % columns;
    if (!is_known(distance[c])) {
      ++length;
      continue;
    }
    markGap((c + columns - length) % columns, length, rises);
    length = 0;
  }
}

/// If it is wide, and most of its floor does not rise.
void CertainFloor::markGap(std::size_t first, std::size_t length,
                           const std::vector<double>& rises) {
  if (length < kWide) return;
  const std::size_t columns = rises.size();
  std::size_t rising = 0;
  for (std::size_t k = 0; k < length; ++k) {
    bool is_rising = false;
    around((first + k) % columns, kFloorBeside, columns,
           [&](std::size_t at) { is_rising = is_rising || rises[at] > 0.0; });
    rising += is_rising ? 1U : 0U;
  }
  if (static_cast<double>(rising) >= kRisingShare * static_cast<double>(length)) return;
  for (std::size_t k = 0; k < length; ++k) is_gap_[(first + k) % columns] = 1;
}

/// Columns between an open one and the first one to either side that sees its wall, or something
/// behind the measured floor, low down.
void CertainFloor::markBeside(const std::vector<std::uint32_t>& low_wall,
                              const std::vector<double>& stands) {
  const std::size_t columns = is_open_.size();
  is_doubted_.assign(columns, 0);
  const auto is_certain = [&](std::size_t column) {
    if (stands[column] > measured_[column]) return true;
    std::uint32_t returns = 0;
    around(column, kWallBeside, columns, [&](std::size_t at) { returns += low_wall[at]; });
    return returns >= kWallReturns;
  };
  for (std::size_t c = 0; c < columns; ++c) {
    if (is_open_[c] == 0) continue;
    for (const std::size_t step : {std::size_t{1}, columns - 1}) {
      std::size_t at = (c + step) % columns;
      while (is_open_[at] == 0 && is_doubted_[at] == 0 && !is_certain(at)) {
        is_doubted_[at] = 1;
        at = (at + step) % columns;
      }
    }
  }
}

}  // namespace smoke_ground_reconstruction
