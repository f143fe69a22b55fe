#include "smoke_ground_reconstruction/scan.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "lanes.hpp"
#include "multiversion.hpp"
#include "packed_view.hpp"

namespace smoke_ground_reconstruction {

namespace {

float weightedSum(double a, float x, double b, float y, double c, float z) {
  return static_cast<float>((a * static_cast<double>(x) + b * static_cast<double>(y)) +
                            c * static_cast<double>(z));
}

/// Copies the points [begin, end).
void copyFields(const ScanView& view, std::size_t begin, std::size_t end, float* x, float* y,
                float* z, float* intensity, std::uint16_t* ring) {
  const ScanView from = view;  // which nothing that is written can be part of
  for (std::size_t i = begin; i < end; ++i) {
    x[i] = from.x[i];
    y[i] = from.y[i];
    z[i] = from.z[i];
    intensity[i] = from.intensity[i];
    ring[i] = from.ring[i];
  }
}

/// The same where isPacked(), of a multiple of four points.
void copyPacked(const ScanView& view, std::size_t begin, std::size_t end, float* x, float* y,
                float* z, float* intensity, std::uint16_t* ring) {
  const StridedField<std::uint16_t> from_ring = view.ring;
  for (std::size_t i = begin; i < end; i += 4) {
    const auto fields = fourPoints(view, i);
    std::memcpy(x + i, &fields[0], sizeof(FourFloats));
    std::memcpy(y + i, &fields[1], sizeof(FourFloats));
    std::memcpy(z + i, &fields[2], sizeof(FourFloats));
    std::memcpy(intensity + i, &fields[3], sizeof(FourFloats));
    const std::array<std::uint16_t, 4> rings = {from_ring[i], from_ring[i + 1], from_ring[i + 2],
                                                from_ring[i + 3]};
    std::memcpy(ring + i, rings.data(), sizeof(rings));
  }
}

SMOKE_GROUND_MULTIVERSION
void findReturns(const float* x, const float* y, const float* z, std::size_t size,
                 std::uint8_t* valid) {
  for (std::size_t i = 0; i < size; ++i) valid[i] = isReturn(x[i], y[i], z[i]) ? 1 : 0;
}

/// Stable counting sort of `items` by key(item) < key_count; also where each key begins.
template <typename Key>
void sortByKey(const std::vector<std::uint32_t>& items, std::size_t key_count, const Key& key,
               std::vector<std::uint32_t>* begin, std::vector<std::uint32_t>* sorted) {
  begin->assign(key_count + 1, 0);
  for (const std::uint32_t item : items) ++(*begin)[key(item)];
  std::uint32_t sum = 0;
  for (std::uint32_t& end : *begin) end = sum += end;
  sorted->resize(items.size());
  for (std::size_t i = items.size(); i-- > 0;) {  // backwards: the end moves to the begin
    (*sorted)[--(*begin)[key(items[i])]] = items[i];
  }
}

/// Ranks of points, kNoRank of those that are not used.
void rankPoints(const Scan& scan, const std::uint8_t* use, const SensorModel& sensor,
                std::uint16_t* rank) {
  Recycled<std::uint16_t> rank_of_ring;
  for (const std::uint16_t ring : sensor.ringsByElevation()) {
    if (ring >= rank_of_ring.size()) rank_of_ring.resize(ring + 1U, SensorModel::kNoRank);
    rank_of_ring[ring] = sensor.rank(ring);
  }
  const std::uint16_t* const ranks = rank_of_ring.data();
  const std::uint16_t* const ring = scan.ring.data();
  const std::uint8_t* const valid = scan.valid.data();
  const std::size_t rings = rank_of_ring.size();
  for (std::size_t i = 0, size = scan.size(); i < size; ++i) {
    const bool is_ranked = (use[i] != 0) & (valid[i] != 0) & (ring[i] < rings);
    rank[i] = is_ranked ? ranks[ring[i]] : SensorModel::kNoRank;
  }
}

constexpr std::size_t kAtOnce = 2048;  // points, which fit into the fastest memory

// More places for a column and a ring are sorted in two steps.
constexpr std::size_t kMostPlaces = 1 << 19;

}  // namespace

std::array<float, 3> Mounting::toLevel(float x, float y, float z) const {
  if (isLevel()) return {x, y, z};
  const auto& r = rotation;
  return {weightedSum(r[0], x, r[1], y, r[2], z), weightedSum(r[3], x, r[4], y, r[5], z),
          weightedSum(r[6], x, r[7], y, r[8], z)};
}

std::array<float, 3> Mounting::toSensor(float x, float y, float z) const {
  if (isLevel()) return {x, y, z};
  const auto& r = rotation;
  return {weightedSum(r[0], x, r[3], y, r[6], z), weightedSum(r[1], x, r[4], y, r[7], z),
          weightedSum(r[2], x, r[5], y, r[8], z)};
}

Scan::Scan(const ScanView& view, const Mounting& mounting) { assign(view, mounting); }

void Scan::assign(const ScanView& view, const Mounting& mounting) {
  for (auto* values : {&x, &y, &z, &intensity}) values->resize(view.size);
  ring.resize(view.size);
  valid.resize(view.size);
  const bool is_packed = isPacked(view);
  for (std::size_t begin = 0; begin < view.size; begin += kAtOnce) {
    const std::size_t size = std::min(kAtOnce, view.size - begin);
    const std::size_t by_four = is_packed ? size / 4 * 4 : 0;
    copyPacked(view, begin, begin + by_four, x.data(), y.data(), z.data(), intensity.data(),
               ring.data());
    copyFields(view, begin + by_four, begin + size, x.data(), y.data(), z.data(), intensity.data(),
               ring.data());
    findReturns(&x[begin], &y[begin], &z[begin], size, &valid[begin]);
  }
  if (mounting.isLevel()) return;
  for (std::size_t i = 0; i < view.size; ++i) {
    const auto level = mounting.toLevel(x[i], y[i], z[i]);
    x[i] = level[0];
    y[i] = level[1];
    z[i] = level[2];
  }
}

ScanView Scan::view() const { return ScanView::of(x, y, z, intensity, ring); }

ScanColumns::ScanColumns(const Scan& scan, const std::vector<std::uint8_t>& use,
                         const AzimuthBins& columns, const SensorModel& sensor) {
  Recycled<std::uint32_t> bin(scan.size());
  columns.indices(scan.x.data(), scan.y.data(), scan.size(), bin.data());
  Recycled<std::uint16_t> point_rank(scan.size());
  rankPoints(scan, use.data(), sensor, point_rank.data());
  const std::size_t ranks = sensor.ringsByElevation().size();
  if (columns.count() * ranks <= kMostPlaces) {
    sortAtOnce(bin, point_rank, columns.count(), ranks);
  } else {
    sortTwice(bin, point_rank, columns.count(), ranks);
  }
}

void ScanColumns::sortAtOnce(const std::vector<std::uint32_t>& bin,
                             const std::vector<std::uint16_t>& point_rank, std::size_t columns,
                             std::size_t ranks) {
  const std::size_t places = columns * ranks;  // and one for all points that are not used
  Recycled<std::uint32_t> place(bin.size());
  Recycled<std::uint32_t> next;
  next.assign(places + 2, 0);
  for (std::size_t i = 0; i < bin.size(); ++i) {
    const bool is_used = point_rank[i] != SensorModel::kNoRank;
    place[i] = static_cast<std::uint32_t>(is_used ? bin[i] * ranks + point_rank[i] : places);
    ++next[place[i] + 1];
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  column_begin.resize(columns + 1);
  for (std::size_t c = 0; c <= columns; ++c) column_begin[c] = next[c * ranks];
  order.resize(bin.size());
  rank.resize(bin.size());
  for (std::uint32_t i = 0; i < bin.size(); ++i) {
    const std::uint32_t at = next[place[i]]++;
    order[at] = i;
    rank[at] = point_rank[i];
  }
  order.resize(column_begin.back());
  rank.resize(column_begin.back());
}

void ScanColumns::sortTwice(const std::vector<std::uint32_t>& bin,
                            const std::vector<std::uint16_t>& point_rank, std::size_t columns,
                            std::size_t ranks) {
  Recycled<std::uint32_t> used;
  for (std::uint32_t i = 0; i < bin.size(); ++i) {
    if (point_rank[i] != SensorModel::kNoRank) used.push_back(i);
  }
  Recycled<std::uint32_t> rank_begin;
  Recycled<std::uint32_t> by_rank;
  sortByKey(
      used, ranks, [&](std::uint32_t i) { return point_rank[i]; }, &rank_begin, &by_rank);
  sortByKey(
      by_rank, columns, [&](std::uint32_t i) { return bin[i]; }, &column_begin, &order);
  rank.reserve(order.size());
  for (const std::uint32_t i : order) rank.push_back(point_rank[i]);
}

}  // namespace smoke_ground_reconstruction
