#include "window_tallies.hpp"

#include <algorithm>
#include <cstring>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::uint32_t kGroupsBetweenSums = 6;  // of kLanes
constexpr std::uint32_t kBetweenLooks = 16;      // at what eight queries have found

/// Numbers of those up to kAlongRow places before and behind eight places that are surely nearer
/// than a radius proportional to their ranges; fewer once all have found more than enough.
SMOKE_GROUND_PART Ints countAlong(const float* x, const float* y, const float* z,
                                  float squared_radius_per_range, std::int32_t more_than) {
  constexpr auto kLeast = static_cast<float>(kLeastScreened);
  const Floats here_x = loadLanes(x), here_y = loadLanes(y), here_z = loadLanes(z);
  const Floats square = squaredRangeOf(here_x, here_y, here_z) * squared_radius_per_range;
  const Floats limit = square < kLeast ? Floats{} : square;
  Ints found = {};
  for (std::ptrdiff_t step = 1; step <= static_cast<std::ptrdiff_t>(kAlongRow); ++step) {
    for (const std::ptrdiff_t k : {-step, step}) {
      const Floats dx = loadLanes(x + k) - here_x;
      const Floats dy = loadLanes(y + k) - here_y;
      const Floats dz = loadLanes(z + k) - here_z;
      found -= (dx * dx + dy * dy) + dz * dz < limit;  // true is -1
    }
    if (isNone(found <= more_than)) break;
  }
  return found;
}

}  // namespace

SMOKE_GROUND_MULTIVERSION
Tally tally(const float* x, const float* y, const float* z, const Run* runs, std::size_t run_count,
            const BallScreen& screen, std::size_t enough) {
  const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
  Ints surely = {};
  Ints possibly = {};
  const auto sum_of = [](const Ints& lanes) {
    std::int32_t sum = 0;
    for (std::uint32_t k = 0; k < kLanes; ++k) sum += lanes[k];
    return static_cast<std::uint32_t>(sum);
  };
  std::uint32_t unsummed = 0;  // groups
  for (std::size_t run = 0; run < run_count; ++run) {
    for (std::uint32_t i = runs[run].begin; i < runs[run].end; i += kLanes) {
      Floats dx, dy, dz;
      std::memcpy(&dx, x + i, sizeof(dx));
      std::memcpy(&dy, y + i, sizeof(dy));
      std::memcpy(&dz, z + i, sizeof(dz));
      dx -= screen.x;
      dy -= screen.y;
      dz -= screen.z;
      const Floats d2 = (dx * dx + dy * dy) + dz * dz;
      const Ints is_candidate = lane < static_cast<std::int32_t>(runs[run].end - i);
      surely -= (d2 < screen.surely_below) & is_candidate;  // true is -1
      possibly -= (d2 < screen.possibly_below) & is_candidate;
      if (++unsummed < kGroupsBetweenSums) continue;
      unsummed = 0;
      if (sum_of(surely) >= enough) return {sum_of(surely), sum_of(possibly)};
    }
  }
  return {sum_of(surely), sum_of(possibly)};
}

SMOKE_GROUND_MULTIVERSION
void findCrowded(const float* x, const float* y, const float* z, std::size_t begin, std::size_t end,
                 float squared_radius_per_range, std::int32_t more_than, std::int32_t* is_crowded) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const Ints found = countAlong(x + i, y + i, z + i, squared_radius_per_range, more_than);
    const Ints is_enough = found > more_than;
    std::memcpy(is_crowded + i, &is_enough, sizeof(is_enough));
  }
}

SMOKE_GROUND_MULTIVERSION
bool tallyTogether(const float* x, const float* y, const float* z, const Run* runs,
                   std::size_t run_count, const LaneQueries& queries, std::int32_t enough,
                   std::int32_t most, std::int32_t left, Tallies* tallies) {
  Floats px, py, pz, surely_below, possibly_below;
  std::memcpy(&px, queries.x.data(), sizeof(px));
  std::memcpy(&py, queries.y.data(), sizeof(py));
  std::memcpy(&pz, queries.z.data(), sizeof(pz));
  std::memcpy(&surely_below, queries.surely_below.data(), sizeof(px));
  std::memcpy(&possibly_below, queries.possibly_below.data(), sizeof(px));
  Ints surely = {};
  Ints possibly = {};
  for (std::size_t run = 0; run < run_count; ++run) {
    std::uint32_t i = runs[run].begin;
    while (i < runs[run].end) {
      const std::uint32_t pause = std::min(runs[run].end, i + kBetweenLooks);
      left -= static_cast<std::int32_t>(pause - i);
      for (; i < pause; ++i) {
        const Floats dx = px - x[i];
        const Floats dy = py - y[i];
        const Floats dz = pz - z[i];
        const Floats d2 = (dx * dx + dy * dy) + dz * dz;
        surely -= d2 < surely_below;  // true is -1
        possibly -= d2 < possibly_below;
      }
      if (isNone((surely < enough) | (possibly > most - left))) return true;
    }
  }
  std::memcpy((*tallies)[0].data(), &surely, sizeof(surely));
  std::memcpy((*tallies)[1].data(), &possibly, sizeof(possibly));
  return false;
}

}  // namespace smoke_ground_reconstruction
