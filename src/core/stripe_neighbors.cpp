#include "stripe_neighbors.hpp"

#include <cstring>

#include "lanes.hpp"
#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kWidth = ScanRaster::kWidth;

/// Points and the balls around them, lane by lane.
struct Balls {
  Floats x, y, z;
  Floats surely_below, possibly_below;  // squared distances
};

SMOKE_GROUND_PART Balls ballsAround(const Floats& x, const Floats& y, const Floats& z,
                                    const ScreenFactors& factors) {
  const Floats square = squaredRangeOf(x, y, z);
  return {x, y, z, square * factors.surely, square * factors.possibly};
}

/// How many points were found in balls.
struct Found {
  Ints surely = {}, possibly = {};

  SMOKE_GROUND_PART void look(const Balls& balls, const Floats& x, const Floats& y,
                              const Floats& z) {
    const Floats dx = x - balls.x, dy = y - balls.y, dz = z - balls.z;
    const Floats d2 = (dx * dx + dy * dy) + dz * dz;
    surely -= d2 < balls.surely_below;  // true is -1; nothing is less than no number
    possibly -= d2 < balls.possibly_below;
  }
};

SMOKE_GROUND_PART void lookAt(const Around& around, std::size_t at, const Balls& balls,
                              Found* found) {
  found->look(balls, loadLanes(&around.x[at]), loadLanes(&around.y[at]), loadLanes(&around.z[at]));
}

constexpr std::uint64_t kOneEach = 0x0101010101010101;

/// Eight small numbers, a byte each.
SMOKE_GROUND_PART std::uint64_t eightBytesOf(const Ints& lanes) {
  const Bytes bytes = bytesOf(lanes);
  std::uint64_t which;
  std::memcpy(&which, &bytes, sizeof(which));
  return which;
}

/// The sum of eight bytes, if it is a byte.
SMOKE_GROUND_PART std::uint64_t sumOfBytes(std::uint64_t bytes) { return bytes * kOneEach >> 56; }

/// Are so few of eight left that one after the other is looked at?
SMOKE_GROUND_PART bool areFew(std::uint64_t which) {
  constexpr std::uint64_t kFew = 3;
  return sumOfBytes(which) <= kFew;
}

SMOKE_GROUND_PART std::int32_t sumOf(const Ints& lanes) {
  std::int32_t sum = 0;
  for (std::uint32_t k = 0; k < kLanes; ++k) sum += lanes[k];
  return sum;
}

constexpr std::size_t kFirstSteps = 2;  // after which points of even surfaces have found enough

/// Looks along a row for eight points, from the middle to both sides, until all have found enough.
SMOKE_GROUND_PART void lookForAll(const Around& around, std::size_t at, std::uint32_t columns,
                                  const Balls& balls, const Ints& enough, Found* found) {
  lookAt(around, at, balls, found);
  for (std::size_t step = 1; step <= columns; ++step) {
    lookAt(around, at - step, balls, found);
    lookAt(around, at + step, balls, found);
    if (step == kFirstSteps && isNone(found->surely < enough)) return;
  }
}

/// Looks along rows for one point, at eight places at once, until it has found enough.
/// \param at  its place in row 0.
SMOKE_GROUND_PART void lookForOne(const Around& around, std::size_t at, const NearRow* near_row,
                                  const NearRow* end, const Balls& ball, std::int32_t enough,
                                  std::int32_t* surely, std::int32_t* possibly) {
  Found found;
  for (; near_row < end; ++near_row) {
    const std::size_t there = at + near_row->row * kSpan;
    lookAt(around, there - kLanes, ball, &found);
    lookAt(around, there, ball, &found);
    if (near_row->columns == kLanes) lookAt(around, there + kLanes, ball, &found);
    const std::uint64_t sum = sumOfBytes(eightBytesOf(found.surely));  // of few rows: no more come
    if (*surely + static_cast<std::int32_t>(sum) >= enough) break;
  }
  *surely += sumOf(found.surely);
  *possibly += sumOf(found.possibly);
}

/// Neighbours of eight points, until each has found enough, itself included.
/// \param at  the first one's place in its row.
SMOKE_GROUND_PART void findNeighbors(const Around& around, std::size_t at, std::uint32_t row,
                                     const RowReach& reach, const NearRow* near_rows,
                                     const ScreenFactors& factors, std::int32_t enough,
                                     std::int32_t* surely, std::int32_t* possibly) {
  const std::size_t in_row_0 = at - row * kSpan;
  const Floats x = loadLanes(&around.x[at]), y = loadLanes(&around.y[at]),
               z = loadLanes(&around.z[at]);
  const Balls balls = ballsAround(x, y, z, factors);
  const Ints is_taken = x == x;
  const Ints enough_each = is_taken & (Ints{} + enough);
  std::uint64_t seeking = eightBytesOf(is_taken) & kOneEach;
  const NearRow* next = near_rows + reach.begin;
  const NearRow* const end = near_rows + reach.end;
  Found found;
  while (!areFew(seeking) && next < end) {
    lookForAll(around, in_row_0 + next->row * kSpan, next->columns, balls, enough_each, &found);
    ++next;
    seeking = eightBytesOf(found.surely < enough_each) & kOneEach;
  }
  std::memcpy(surely, &found.surely, sizeof(found.surely));
  std::memcpy(possibly, &found.possibly, sizeof(found.possibly));
  for (; seeking != 0 && next < end; seeking &= seeking - 1) {
    const auto lane = static_cast<std::uint32_t>(__builtin_ctzll(seeking)) / 8;
    const Floats none = {};
    const Balls ball = ballsAround(none + around.x[at + lane], none + around.y[at + lane],
                                   none + around.z[at + lane], factors);
    lookForOne(around, in_row_0 + lane, next, end, ball, enough, surely + lane, possibly + lane);
  }
}

SMOKE_GROUND_PART Balls ballAround(const Aside& aside, const ScreenFactors& factors) {
  const Floats none = {};
  return ballsAround(none + aside.at[0], none + aside.at[1], none + aside.at[2], factors);
}

}  // namespace

SMOKE_GROUND_MULTIVERSION
void takeRows(const float* from, std::size_t rows, float* to) {
  const std::size_t size = rows * kWidth;
  for (const float* row = from; row < from + size; row += kWidth, to += kSpan) {
    std::memcpy(to, row - size + kWidth - kHalo, kHalo * sizeof(float));
    std::memcpy(to + kHalo, row, kWidth * sizeof(float));
    std::memcpy(to + kHalo + kWidth, row + size, kHalo * sizeof(float));
  }
}

SMOKE_GROUND_MULTIVERSION
void findAllNeighbors(const std::vector<RowReach>& reaches, std::size_t layers,
                      const NearRow* near_rows, const ScreenFactors& by, std::int32_t enough,
                      Around* around) {
  const ScreenFactors factors = by;
  const std::size_t rows = reaches.size();
  for (std::uint32_t row = 0; row < layers * rows; ++row) {
    const RowReach reach = reaches[row % rows];
    for (std::size_t column = 0; reach.begin < reach.end && column < kWidth; column += kLanes) {
      const std::size_t at = row * kWidth + column;
      findNeighbors(*around, row * kSpan + kHalo + column, row, reach, near_rows, factors, enough,
                    &around->surely[at], &around->possibly[at]);
    }
  }
}

SMOKE_GROUND_MULTIVERSION
bool findLonely(const Around& around, std::size_t begin, std::size_t end, std::int32_t enough,
                std::int8_t* is_lonely) {
  Ints all = {};
  for (std::size_t at = begin; at < end; at += kLanes) {
    Ints surely, possibly;
    std::memcpy(&surely, &around.surely[at], sizeof(surely));
    std::memcpy(&possibly, &around.possibly[at], sizeof(possibly));
    const Bytes lonely = bytesOf(surely < enough);
    std::memcpy(is_lonely + at - begin, &lonely, sizeof(lonely));
    all |= (surely < enough) & (possibly >= enough);
  }
  return !isNone(all);
}

SMOKE_GROUND_MULTIVERSION
void countAside(const Aside& aside, std::size_t row, const ScreenFactors& factors, Around* around) {
  const Floats none = {};
  for (std::size_t column = 0; column < kWidth; column += kLanes) {
    const std::size_t at = row * kSpan + kHalo + column;
    Found found;
    std::memcpy(&found.surely, &around->surely[row * kWidth + column], sizeof(found.surely));
    std::memcpy(&found.possibly, &around->possibly[row * kWidth + column], sizeof(found.surely));
    found.look(ballsAround(loadLanes(&around->x[at]), loadLanes(&around->y[at]),
                           loadLanes(&around->z[at]), factors),
               none + aside.at[0], none + aside.at[1], none + aside.at[2]);
    std::memcpy(&around->surely[row * kWidth + column], &found.surely, sizeof(found.surely));
    std::memcpy(&around->possibly[row * kWidth + column], &found.possibly, sizeof(found.surely));
  }
}

}  // namespace smoke_ground_reconstruction
