#include "smoke_ground_reconstruction/scan_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {

namespace {

// More places are mostly empty, and cost more to clear and to look at than sorting does.
constexpr std::size_t kMostPlaces = 1 << 19;
constexpr std::size_t kMostPlacesPerPoint = 16;
constexpr std::size_t kFewExtras = 32;   // one point in so many
constexpr std::size_t kManyExtras = 16;  // of the first points: there will not be few of all
constexpr std::size_t kFirstPoints = 4096;
constexpr std::uint32_t kColumns = ScanRaster::kWidth;
constexpr std::size_t kAtOnce = 1024;  // points, whose bins fit into the fastest memory

bool areTooMany(std::size_t places, std::size_t points) {
  return places > kMostPlaces || places > kMostPlacesPerPoint * points;
}

/// Makes places of columns. Points that take no part get no number for their x: the place that they
/// have in common stays free. No branches: which points are used, smoke decides.
SMOKE_GROUND_MULTIVERSION
void toPlaces(const std::uint16_t* ring, const Label* label, const std::uint8_t* valid,
              const float* x, std::size_t size, std::uint32_t none, std::uint32_t stripe_size,
              std::uint32_t* at, float* used_x) {
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t in_raster =
        at[i] / kColumns * stripe_size + ring[i] * kColumns + at[i] % kColumns;
    const bool is_used = (label[i] == Label::kKept) & (valid[i] != 0);
    at[i] = is_used ? in_raster : none;
    used_x[i] = is_used ? x[i] : NAN;
  }
}

}  // namespace

SMOKE_GROUND_MULTIVERSION
std::size_t ScanRaster::rowsFor(const Scan& scan) {
  const std::uint16_t* const ring = scan.ring.data();
  std::uint16_t greatest = 0;
  for (std::size_t i = 0, size = scan.size(); i < size; ++i) greatest = std::max(greatest, ring[i]);
  return greatest + 1U;
}

ScanRaster::ScanRaster(const Scan& scan, const std::vector<Label>& labels, const AzimuthBins& bins,
                       std::size_t most_layers)
    : columns(bins.count()),
      stripes((columns + kWidth - 1) / kWidth),
      rows(rowsFor(scan)),
      is_crowded(areTooMany(nowhere(), scan.size())),
      x(is_crowded ? 0 : nowhere() + 1U),  // and a place for all that take no part
      y(x.size()),
      z(x.size()),
      place(is_crowded ? 0 : scan.size()) {
  if (is_crowded) return;
  std::fill(x.begin(), x.end(), NAN);
  fill(scan, labels, bins, most_layers);
  if (is_crowded) return;
  std::sort(extras.begin(), extras.end(), [](const Extra& a, const Extra& b) {
    return a.place != b.place ? a.place < b.place : a.point < b.point;
  });
}

void ScanRaster::fill(const Scan& scan, const std::vector<Label>& labels, const AzimuthBins& bins,
                      std::size_t most_layers) {
  const std::size_t most_extras = scan.size() / kFewExtras;
  for (std::size_t begin = 0; begin < scan.size() && !is_crowded; begin += kAtOnce) {
    const std::size_t size = std::min(kAtOnce, scan.size() - begin);
    bins.indices(&scan.x[begin], &scan.y[begin], size, &place[begin]);
    std::array<float, kAtOnce> used_x;
    toPlaces(&scan.ring[begin], &labels[begin], &scan.valid[begin], &scan.x[begin], size, nowhere(),
             static_cast<std::uint32_t>(rows) * kColumns, &place[begin], used_x.data());
    has_second ? putInTwo(scan, used_x.data(), begin, size) : put(scan, used_x.data(), begin, size);
    const std::size_t done = begin + size;
    const auto are_many = [&] {
      const bool are_many_so_far = done >= kFirstPoints && extras.size() > done / kManyExtras;
      return extras.size() > most_extras || are_many_so_far;
    };
    if (are_many() && !has_second && most_layers > 1) addSecond(scan);
    is_crowded = are_many();
  }
}

/// A layer for those that found their places taken so far, but for the third at one.
void ScanRaster::addSecond(const Scan& scan) {
  has_second = true;
  const std::size_t size = secondOf(nowhere());
  x.resize(size);
  std::fill(x.begin() + nowhere() + 1, x.end(), NAN);
  y.resize(size);
  z.resize(size);
  Recycled<Extra> left;
  for (const Extra& extra : extras) {
    const std::size_t at = secondOf(extra.place);
    if (isTaken(at)) {
      left.push_back(extra);
      continue;
    }
    moveTo(at, scan, extra.point);
  }
  extras.swap(left);
}

void ScanRaster::moveTo(std::size_t at, const Scan& scan, std::size_t point) {
  x[at] = scan.x[point];
  y[at] = scan.y[point];
  z[at] = scan.z[point];
  place[point] = static_cast<std::uint32_t>(at);
}

void ScanRaster::keep(const Scan& scan, const std::vector<Label>& labels) {
  const std::uint32_t none = nowhere();
  float* const to_x = x.data();
  std::uint32_t* const goes_to = place.data();
  for (std::size_t i = 0, size = scan.size(); i < size; ++i) {
    const std::uint32_t at = goes_to[i];
    const std::uint32_t if_kept = labels[i] == Label::kKept ? ~0U : 0U;  // bits, not a branch
    goes_to[i] = (at & if_kept) | (none & ~if_kept);
    to_x[(at & ~if_kept) | (none & if_kept)] = NAN;
  }
  for (std::size_t i = 0; has_second && i < scan.size(); ++i) {
    if (goes_to[i] <= none) continue;
    const std::size_t second = goes_to[i];
    if (isTaken(second - secondOf(0))) continue;
    moveTo(second - secondOf(0), scan, i);
    to_x[second] = NAN;
  }
  keepExtras(scan, labels);
}

void ScanRaster::keepExtras(const Scan& scan, const std::vector<Label>& labels) {
  Recycled<Extra> left;
  for (const Extra& extra : extras) {
    if (labels[extra.point] != Label::kKept) continue;
    if (!isTaken(extra.place)) {
      moveTo(extra.place, scan, extra.point);
    } else if (has_second && !isTaken(secondOf(extra.place))) {
      moveTo(secondOf(extra.place), scan, extra.point);
    } else {
      left.push_back(extra);
    }
  }
  extras.swap(left);
}

void ScanRaster::put(const Scan& scan, const float* from_x, std::size_t begin, std::size_t size) {
  const std::uint32_t none = nowhere();
  const float *const from_y = &scan.y[begin], *const from_z = &scan.z[begin];
  float *const to_x = x.data(), *const to_y = y.data(), *const to_z = z.data();
  std::uint32_t* const goes_to = &place[begin];
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t at = goes_to[i];
    if (to_x[at] == to_x[at]) {  // few are taken
      extras.push_back({at, static_cast<std::uint32_t>(begin + i)});
      goes_to[i] = none;
      continue;
    }
    to_x[at] = from_x[i];
    to_y[at] = from_y[i];
    to_z[at] = from_z[i];
  }
}

/// No branches: first and second returns come in any order.
void ScanRaster::putInTwo(const Scan& scan, const float* from_x, std::size_t begin,
                          std::size_t size) {
  const std::uint32_t none = nowhere();
  const std::uint32_t to_second = none + 1U;
  const float *const from_y = &scan.y[begin], *const from_z = &scan.z[begin];
  float *const to_x = x.data(), *const to_y = y.data(), *const to_z = z.data();
  std::uint32_t* const goes_to = &place[begin];
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t first = goes_to[i];
    const bool is_second = to_x[first] == to_x[first];
    const std::uint32_t at = first + (is_second ? to_second : 0U);
    if (is_second & (to_x[at] == to_x[at])) {  // few are
      extras.push_back({first, static_cast<std::uint32_t>(begin + i)});
      goes_to[i] = none;
      continue;
    }
    goes_to[i] = at;
    to_x[at] = from_x[i];
    to_y[at] = from_y[i];
    to_z[at] = from_z[i];
  }
}

}  // namespace smoke_ground_reconstruction
