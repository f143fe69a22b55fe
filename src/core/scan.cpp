#include "smoke_ground_reconstruction/scan.hpp"

#include <cmath>

namespace smoke_ground_reconstruction {

namespace {

float weightedSum(double a, float x, double b, float y, double c, float z) {
  return static_cast<float>((a * static_cast<double>(x) + b * static_cast<double>(y)) +
                            c * static_cast<double>(z));
}

/// Stable counting sort of `items` by key(item) < key_count; also where each key begins.
template <typename Key>
std::vector<std::uint32_t> sortByKey(const std::vector<std::uint32_t>& items, std::size_t key_count,
                                     const Key& key, std::vector<std::uint32_t>* begin) {
  begin->assign(key_count + 1, 0);
  for (const std::uint32_t item : items) ++(*begin)[key(item) + 1];
  for (std::size_t k = 0; k < key_count; ++k) (*begin)[k + 1] += (*begin)[k];
  std::vector<std::uint32_t> next(begin->begin(), begin->end() - 1);
  std::vector<std::uint32_t> sorted(items.size());
  for (const std::uint32_t item : items) sorted[next[key(item)]++] = item;
  return sorted;
}

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

bool isReturn(float x, float y, float z) {
  // False for NaN as well.
  const bool is_in_reach = std::fabs(x) <= kFarthestReturn && std::fabs(y) <= kFarthestReturn &&
                           std::fabs(z) <= kFarthestReturn;
  return is_in_reach && !(x == 0.0F && y == 0.0F && z == 0.0F);
}

Scan::Scan(const ScanView& view, const Mounting& mounting)
    : x(view.size),
      y(view.size),
      z(view.size),
      intensity(view.size),
      ring(view.size),
      valid(view.size) {
  const bool is_level = mounting.isLevel();
  for (std::size_t i = 0; i < view.size; ++i) {
    x[i] = view.x[i];
    y[i] = view.y[i];
    z[i] = view.z[i];
    intensity[i] = view.intensity[i];
    ring[i] = view.ring[i];
    valid[i] = isReturn(x[i], y[i], z[i]) ? 1 : 0;
    if (is_level) continue;
    const auto level = mounting.toLevel(x[i], y[i], z[i]);
    x[i] = level[0];
    y[i] = level[1];
    z[i] = level[2];
  }
}

ScanView Scan::view() const { return ScanView::of(x, y, z, intensity, ring); }

ScanColumns::ScanColumns(const Scan& scan, const std::vector<std::uint8_t>& use,
                         const AzimuthBins& columns, const SensorModel& sensor) {
  std::vector<std::uint16_t> point_rank(scan.size());
  std::vector<std::uint32_t> point_column(scan.size());
  std::vector<std::uint32_t> used;
  used.reserve(scan.size());
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    if (use[i] == 0 || scan.valid[i] == 0) continue;
    point_rank[i] = sensor.rank(scan.ring[i]);
    if (point_rank[i] == SensorModel::kNoRank) continue;
    point_column[i] = static_cast<std::uint32_t>(columns.index(scan.x[i], scan.y[i]));
    used.push_back(i);
  }
  std::vector<std::uint32_t> rank_begin;
  const auto by_rank = sortByKey(
      used, sensor.ringsByElevation().size(), [&](std::uint32_t i) { return point_rank[i]; },
      &rank_begin);
  order = sortByKey(
      by_rank, columns.count(), [&](std::uint32_t i) { return point_column[i]; }, &column_begin);
  rank.reserve(order.size());
  for (const std::uint32_t i : order) rank.push_back(point_rank[i]);
}

}  // namespace smoke_ground_reconstruction
