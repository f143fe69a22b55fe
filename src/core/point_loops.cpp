#include "point_loops.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "lanes.hpp"
#include "lanes_of_bits.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"
#include "packed_view.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// The single with which a single compares, as an upper bound, as it does with a double.
float upper(double bound) {
  const auto rounded = static_cast<float>(bound);
  return static_cast<double>(rounded) < bound
             ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
             : rounded;
}

/// ... as a lower bound.
float lower(double bound) { return -upper(-bound); }

/// Bounds of kinds in single precision.
struct SingleBounds {
  explicit SingleBounds(const KindBounds& of)
      : low(upper(of.low)),
        low_range(upper(of.low_range)),
        lift_square(static_cast<float>(of.lift_square)),
        deep(upper(of.deep)),
        near_lowest(lower(of.near_lowest)),
        near_highest(upper(of.near_highest)),
        above(lower(of.above)),
        wall_highest(upper(of.wall_highest)),
        wall_nearest(lower(of.wall_nearest)),
        wall_farthest(upper(of.wall_farthest)),
        ceiling_lowest(lower(of.ceiling_lowest)),
        ceiling_highest(upper(of.ceiling_highest)),
        soft_square(static_cast<float>(of.soft_square)) {}

  float low, low_range, lift_square, deep, near_lowest, near_highest, above, wall_highest,
      wall_nearest, wall_farthest, ceiling_lowest, ceiling_highest, soft_square;
};

SMOKE_GROUND_PART Ints kindWhere(const Ints& is_of_kind, ReturnKind::Bit kind) {
  return is_of_kind & static_cast<std::int32_t>(kind);
}

/// Kinds of eight returns.
SMOKE_GROUND_PART Bytes kindsOf(const Floats& planar, const Floats& z, const Floats& height,
                                const SingleBounds& by) {
  const Floats square = planar * planar + z * z;
  const Ints is_above = height > by.above;
  const Ints is_on = (magnitudeOf(height) < by.low) | (height * height * square < by.lift_square);
  const Ints is_near = (height > by.near_lowest) & (height < by.near_highest);
  const Ints is_within = (planar > by.wall_nearest) & (planar < by.wall_farthest);
  const Ints is_at_ceiling = (height > by.ceiling_lowest) & (height < by.ceiling_highest);
  return bytesOf(
      kindWhere(is_on & (planar < by.low_range), ReturnKind::kLow) |
      kindWhere(is_above & (square < by.soft_square), ReturnKind::kSoft) |
      kindWhere(height < by.deep, ReturnKind::kDeep) | kindWhere(is_near, ReturnKind::kNear) |
      kindWhere(is_above & (height < by.wall_highest) & is_within, ReturnKind::kMayBeWall) |
      kindWhere(is_above & is_at_ceiling, ReturnKind::kAtCeiling));
}

/// Are all of four points isReturn()?
bool areReturns(const FourFloats& x, const FourFloats& y, const FourFloats& z) {
  constexpr FourFloats kFarthest = {kFarthestReturn, kFarthestReturn, kFarthestReturn,
                                    kFarthestReturn};
  const FourInts is_in_reach =
      (magnitudeOf(x) <= kFarthest) & (magnitudeOf(y) <= kFarthest) & (magnitudeOf(z) <= kFarthest);
  const FourInts is_off_origin = (x != 0.0F) | (y != 0.0F) | (z != 0.0F);
  const FourInts is_return = is_in_reach & is_off_origin;
  std::array<std::uint64_t, 2> bits{};
  std::memcpy(bits.data(), &is_return, sizeof(bits));
  return (bits[0] & bits[1]) == std::numeric_limits<std::uint64_t>::max();
}

constexpr std::size_t kFlags = 2 * kLanes;  // looked at at once

/// Which of kFlags flags are as wanted under a mask, one bit each.
#if defined(__SSE2__)
SMOKE_GROUND_PART std::uint32_t whereIn(const std::uint8_t* flags, std::uint8_t mask,
                                        std::uint8_t wanted) {
  using Flags = char __attribute__((vector_size(kFlags)));
  Flags some;
  std::memcpy(&some, flags, sizeof(some));
  some = (some & static_cast<char>(mask)) == static_cast<char>(wanted);
  return static_cast<std::uint32_t>(__builtin_ia32_pmovmskb128(some));
}
#else
SMOKE_GROUND_PART std::uint32_t whereIn(const std::uint8_t* flags, std::uint8_t mask,
                                        std::uint8_t wanted) {
  constexpr std::uint64_t kEach = 0x0101010101010101U, kRest = 0x7F * kEach;
  std::uint32_t bits = 0;
  for (std::uint32_t begin = 0; begin < kFlags; begin += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, flags + begin, sizeof(word));
    const std::uint64_t other = (word & mask * kEach) ^ wanted * kEach;
    const std::uint64_t none_other = ~((((other & kRest) + kRest) | other) | kRest) >> 7;
    bits |= static_cast<std::uint32_t>(none_other * 0x0102040810204080U >> 56) << begin;
  }
  return bits;
}
#endif

SMOKE_GROUND_PART std::size_t countWhere(const std::uint8_t* flags, std::size_t size,
                                         std::uint8_t mask, std::uint8_t wanted) {
  constexpr std::size_t kBytes = 32, kMost = 255 * kBytes;  // as much as counts can hold
  std::size_t count = 0;
  for (std::size_t begin = 0; begin < size; begin += kMost) {
    const std::size_t end = std::min(size, begin + kMost);
    std::array<std::uint8_t, kBytes> counts{};
    std::size_t i = begin;
    for (; i + kBytes <= end; i += kBytes) {
      for (std::size_t k = 0; k < kBytes; ++k) {
        const int is_wanted = (flags[i + k] & mask) == wanted ? 1 : 0;
        counts[k] = static_cast<std::uint8_t>(counts[k] + is_wanted);
      }
    }
    for (; i < end; ++i) count += (flags[i] & mask) == wanted ? 1U : 0U;
    for (const std::uint8_t some : counts) count += some;
  }
  return count;
}

constexpr std::size_t kAtOnce = 64;  // flags, of which often none is wanted

/// Is any of some returns of a kind? No more of them than kAtOnce.
SMOKE_GROUND_PART bool hasKind(const std::uint8_t* kinds, std::size_t size, std::uint8_t kind) {
  std::array<std::uint64_t, kAtOnce / 8> words{};
  std::memcpy(words.data(), kinds, size);
  std::uint64_t all = 0;
  for (const std::uint64_t word : words) all |= word;
  return (all & kind * 0x0101010101010101U) != 0;
}

/// Takes the points [begin, end) one by one.
std::size_t takeEach(const ScanView& scan, std::size_t begin, std::size_t end, std::size_t count,
                     const TakenReturns& to) {
  for (std::size_t i = begin; i < end; ++i) {
    const float x = to.x[count] = scan.x[i];
    const float y = to.y[count] = scan.y[i];
    const float z = to.z[count] = scan.z[i];
    to.intensity[count] = scan.intensity[i];
    to.ring[count] = scan.ring[i];
    to.index[count] = static_cast<std::uint32_t>(i);
    count += isReturn(x, y, z) ? 1U : 0U;
  }
  return count;
}

}  // namespace

std::size_t takeReturns(const ScanView& scan, const TakenReturns& to) {
  const ScanView from = scan;  // which nothing that is written can be part of
  const TakenReturns at = to;
  if (!isPacked(from)) return takeEach(from, 0, from.size, 0, at);
  std::size_t count = 0, i = 0;
  for (; i + kFour <= from.size; i += kFour) {
    const auto [x, y, z, intensity] = fourPoints(from, i);
    if (!areReturns(x, y, z)) {
      if (count == i) std::iota(at.index, at.index + count, 0U);
      count = takeEach(from, i, i + kFour, count, at);
      continue;
    }
    const auto first = static_cast<std::uint32_t>(i);
    const std::array<std::uint16_t, kFour> ring = {from.ring[i], from.ring[i + 1], from.ring[i + 2],
                                                   from.ring[i + 3]};
    std::memcpy(at.x + count, &x, sizeof(x));
    std::memcpy(at.y + count, &y, sizeof(y));
    std::memcpy(at.z + count, &z, sizeof(z));
    std::memcpy(at.intensity + count, &intensity, sizeof(intensity));
    std::memcpy(at.ring + count, ring.data(), sizeof(ring));
    if (count != i) std::iota(at.index + count, at.index + count + kFour, first);
    count += kFour;
  }
  const std::size_t all = takeEach(from, i, from.size, count, at);
  if (count == i && all < from.size) std::iota(at.index, at.index + count, 0U);
  return all;
}

SMOKE_GROUND_MULTIVERSION
void turnPoints(const PointArrays& points, const std::array<double, 9>& rotation, float* x,
                float* y, float* z) {
  const Matrix3 r = rotation;
  for (std::size_t i = 0; i < points.size; ++i) {
    const double px = points.x[i];
    const double py = points.y[i];
    const double pz = points.z[i];
    x[i] = static_cast<float>((r[0] * px + r[1] * py) + r[2] * pz);
    y[i] = static_cast<float>((r[3] * px + r[4] * py) + r[5] * pz);
    z[i] = static_cast<float>((r[6] * px + r[7] * py) + r[8] * pz);
  }
}

SMOKE_GROUND_MULTIVERSION
void rangesAndHeights(const PointArrays& points, const std::array<double, 3>& plane, float* planar,
                      float* height) {
  const auto a = static_cast<float>(plane[0]);
  const auto b = static_cast<float>(plane[1]);
  const auto c = static_cast<float>(plane[2]);
  for (std::size_t i = 0; i < points.size; ++i) {
    const float x = points.x[i];
    const float y = points.y[i];
    planar[i] = std::sqrt(x * x + y * y);
    height[i] = points.z[i] - ((a * x + b * y) + c);
  }
}

SMOKE_GROUND_MULTIVERSION
void findKinds(const float* planar, const float* z, const float* height, std::size_t size,
               const KindBounds& bounds, std::uint8_t* kind) {
  const SingleBounds by(bounds);
  std::size_t i = 0;
  for (; i + kLanes <= size; i += kLanes) {
    const Bytes kinds = kindsOf(loadLanes(planar + i), loadLanes(z + i), loadLanes(height + i), by);
    std::memcpy(kind + i, &kinds, sizeof(kinds));
  }
  if (i == size) return;
  std::array<float, 3 * kLanes> rest{};
  std::copy(planar + i, planar + size, rest.data());
  std::copy(z + i, z + size, rest.data() + kLanes);
  std::copy(height + i, height + size, rest.data() + 2 * kLanes);
  const Bytes kinds = kindsOf(loadLanes(rest.data()), loadLanes(rest.data() + kLanes),
                              loadLanes(rest.data() + 2 * kLanes), by);
  std::memcpy(kind + i, &kinds, size - i);
}

SMOKE_GROUND_MULTIVERSION
void judgeSoft(const float* planar, const float* z, const float* intensity, std::size_t size,
               double gate, std::uint8_t* kind) {
  const auto least = static_cast<float>(gate);
  for (std::size_t begin = 0; begin < size; begin += kAtOnce) {
    const std::size_t end = std::min(size, begin + kAtOnce);
    if (!hasKind(kind + begin, end - begin, ReturnKind::kSoft)) continue;
    for (std::size_t i = begin; i < end; ++i) {
      const float square = planar[i] * planar[i] + z[i] * z[i];
      const int is_soft =
          (kind[i] & ReturnKind::kSoft) & (intensity[i] * square < least ? ReturnKind::kSoft : 0);
      const int not_wall = is_soft * (ReturnKind::kMayBeWall / ReturnKind::kSoft);
      kind[i] = static_cast<std::uint8_t>((kind[i] & ~(ReturnKind::kSoft | not_wall)) | is_soft);
    }
  }
}

SMOKE_GROUND_MULTIVERSION
void listWhere(const std::uint8_t* flags, std::size_t size, std::uint8_t mask, std::uint8_t wanted,
               std::vector<std::uint32_t>* list) {
  const std::uint8_t* const in = flags;
  // Of the right size at once: to make it longer costs as much as to fill it.
  const std::size_t count = countWhere(in, size, mask, wanted);
  list->resize(count == 0 ? 0 : count + kLanes);
  if (count == 0) return;
  std::uint32_t* out = list->data();
  std::size_t i = 0;
  for (; i + kFlags <= size; i += kFlags) {
    const std::uint32_t which = whereIn(in + i, mask, wanted);
    if (which == 0) continue;
    out = putPlaces(which & 0xFFU, i, out);
    out = putPlaces(which >> 8, i + kLanes, out);
  }
  for (; i < size; ++i) {
    *out = static_cast<std::uint32_t>(i);
    out += (in[i] & mask) == wanted ? 1 : 0;
  }
  list->resize(static_cast<std::size_t>(out - list->data()));
}

}  // namespace smoke_ground_reconstruction
