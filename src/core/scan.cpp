#include "smoke_ground_reconstruction/scan.hpp"

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

float weightedSum(double a, float x, double b, float y, double c, float z) {
  return static_cast<float>((a * static_cast<double>(x) + b * static_cast<double>(y)) +
                            c * static_cast<double>(z));
}

void copyFields(const ScanView& view, float* x, float* y, float* z, float* intensity,
                std::uint16_t* ring) {
  const ScanView from = view;  // which nothing that is written can be part of
  for (std::size_t i = 0; i < from.size; ++i) {
    x[i] = from.x[i];
    y[i] = from.y[i];
    z[i] = from.z[i];
    intensity[i] = from.intensity[i];
    ring[i] = from.ring[i];
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

Scan::Scan(const ScanView& view, const Mounting& mounting)
    : x(view.size),
      y(view.size),
      z(view.size),
      intensity(view.size),
      ring(view.size),
      valid(view.size) {
  copyFields(view, x.data(), y.data(), z.data(), intensity.data(), ring.data());
  findReturns(x.data(), y.data(), z.data(), view.size, valid.data());
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
  Recycled<std::uint32_t> used;
  used.reserve(scan.size());
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    if (use[i] == 0 || scan.valid[i] == 0) continue;
    point_rank[i] = sensor.rank(scan.ring[i]);
    if (point_rank[i] != SensorModel::kNoRank) used.push_back(i);
  }
  const std::size_t ranks = sensor.ringsByElevation().size();
  const auto rank_of = [&](std::uint32_t i) { return point_rank[i]; };
  const auto column_of = [&](std::uint32_t i) { return bin[i]; };
  if (columns.count() * ranks <= kMostPlaces) {
    Recycled<std::uint32_t> begin;
    sortByKey(
        used, columns.count() * ranks,
        [&](std::uint32_t i) { return column_of(i) * ranks + rank_of(i); }, &begin, &order);
    for (std::size_t c = 0; c <= columns.count(); ++c) column_begin.push_back(begin[c * ranks]);
  } else {
    Recycled<std::uint32_t> rank_begin;
    Recycled<std::uint32_t> by_rank;
    sortByKey(used, ranks, rank_of, &rank_begin, &by_rank);
    sortByKey(by_rank, columns.count(), column_of, &column_begin, &order);
  }
  rank.reserve(order.size());
  for (const std::uint32_t i : order) rank.push_back(point_rank[i]);
}

}  // namespace smoke_ground_reconstruction
