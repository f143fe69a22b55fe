#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "lanes.hpp"
#include "neighbor_screen.hpp"
#include "smoke_ground_reconstruction/window_counter.hpp"

namespace smoke_ground_reconstruction {

// What single precision counts among the points of a WindowCounter, which lie bucket by bucket.

constexpr std::size_t kAlongRow = 8;  ///< places looked at to either side of a point

/// Places [begin, end).
using Run = WindowCounter::Run;

/// What a single-precision look at candidates tells.
struct Tally {
  std::uint32_t surely;
  std::uint32_t possibly;
};

/// A ball a hair smaller and one a hair larger than the one asked about.
struct BallScreen {
  float x, y, z;
  float surely_below;
  float possibly_below;
};

inline BallScreen screenOf(float x, float y, float z, double squared_radius) {
  const bool is_safe = squared_radius >= kLeastScreened && squared_radius <= kGreatestScreened;
  if (!is_safe) return {x, y, z, -1.0F, INFINITY};
  return {x, y, z, static_cast<float>(squared_radius * (1.0 - kScreenMargin)),
          static_cast<float>(squared_radius * (1.0 + kScreenMargin))};
}

/// The same for a radius proportional to the range, which single precision knows as well.
inline BallScreen roughScreenOf(float x, float y, float z, double squared_radius_per_range) {
  const double square = static_cast<double>(squaredRangeOf(x, y, z)) * squared_radius_per_range;
  const bool is_safe = square >= kLeastScreened && square <= kGreatestScreened;
  if (!is_safe) return {x, y, z, -1.0F, INFINITY};
  return {x, y, z, static_cast<float>(square * (1.0 - 4.0 * kScreenMargin)),
          static_cast<float>(square * (1.0 + 4.0 * kScreenMargin))};
}

/// Looks at candidates until `enough` are surely inside. Reads whole groups of kLanes: others may
/// follow a run.
Tally tally(const float* x, const float* y, const float* z, const Run* runs, std::size_t run_count,
            const BallScreen& screen, std::size_t enough);

/// Which places [begin, end) find more than enough beside them; whole groups of kLanes.
void findCrowded(const float* x, const float* y, const float* z, std::size_t begin, std::size_t end,
                 float squared_radius_per_range, std::int32_t more_than, std::int32_t* is_crowded);

/// Queries of one row of buckets, looked at together. Lanes without one find enough at once.
struct LaneQueries {
  int shell;
  int row;
  std::uint32_t size = 0;
  std::array<std::uint32_t, kLanes> place{};
  int first_column = 0;
  int last_column = 0;
  std::array<float, kLanes> x{}, y{}, z{};
  std::array<float, kLanes> surely_below{}, possibly_below{};  // squared radii
  float least_square = 0.0F;                                   // of their ranges
  float greatest_square = 0.0F;

  LaneQueries(int of_shell, int of_row) : shell(of_shell), row(of_row) {}

  void add(std::uint32_t at, int column, const float* px, const float* py, const float* pz,
           double squared_radius_per_range) {
    const BallScreen screen = roughScreenOf(px[at], py[at], pz[at], squared_radius_per_range);
    const float square = squaredRangeOf(screen.x, screen.y, screen.z);
    if (size == 0) {
      first_column = column;
      surely_below.fill(INFINITY);
      possibly_below.fill(0.0F);
      least_square = greatest_square = square;
    }
    last_column = column;
    place[size] = at;
    x[size] = screen.x;
    y[size] = screen.y;
    z[size] = screen.z;
    surely_below[size] = screen.surely_below;
    possibly_below[size] = screen.possibly_below;
    least_square = std::min(least_square, square);
    greatest_square = std::max(greatest_square, square);
    ++size;
  }
};

using Tallies = std::array<std::array<std::int32_t, kLanes>, 2>;  // surely, possibly

/// Looks at candidates for all queries at once, until all are surely inside a crowd: they have
/// found `enough`, and with all `left` they would not have more than `most`. Returns whether they
/// are.
bool tallyTogether(const float* x, const float* y, const float* z, const Run* runs,
                   std::size_t run_count, const LaneQueries& queries, std::int32_t enough,
                   std::int32_t most, std::int32_t left, Tallies* tallies);

}  // namespace smoke_ground_reconstruction
