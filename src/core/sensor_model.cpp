#include "smoke_ground_reconstruction/sensor_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// Does a point tell its ring's elevation?
bool tellsElevation(const ScanView& scan, std::size_t i) {
  const float x = scan.x[i];
  const float y = scan.y[i];
  return isReturn(x, y, scan.z[i]) && (x != 0.0F || y != 0.0F) &&
         scan.ring[i] != SensorModel::kNoRank;
}

/// How many points of some rings tell their elevation.
void countTelling(const ScanView& scan, const std::vector<std::uint8_t>& is_wanted,
                  std::vector<std::size_t>* points) {
  std::fill(points->begin(), points->end(), 0U);
  for (std::size_t i = 0; i < scan.size; ++i) {
    if (tellsElevation(scan, i) && is_wanted[scan.ring[i]] != 0) ++(*points)[scan.ring[i]];
  }
}

/// Tangents of the elevations of some rings' points, ring by ring from begin[ring] on.
void sortTangents(const ScanView& scan, const std::vector<std::uint8_t>& is_wanted,
                  const std::vector<std::size_t>& begin, std::vector<double>* tangents) {
  Recycled<std::size_t> next;
  next.assign(begin.begin(), begin.end());
  for (std::size_t i = 0; i < scan.size; ++i) {
    if (!tellsElevation(scan, i) || is_wanted[scan.ring[i]] == 0) continue;
    (*tangents)[next[scan.ring[i]]++] =
        static_cast<double>(scan.z[i]) / planarRange(scan.x[i], scan.y[i]);
  }
}

double lowerMedian(double* values, std::size_t size) {
  double* const middle = values + (size - 1) / 2;
  std::nth_element(values, middle, values + size);
  return *middle;
}

constexpr double kDegree = M_PI / 180.0;
constexpr double kRingGap = 0.15 * kDegree;    // beams of known sensors are at least 0.33 deg apart
constexpr double kWidestRing = 1.0 * kDegree;  // wider: beams ran together
constexpr double kElevationStep = 0.5 * kDegree;  // where beams cannot be told apart
constexpr std::uint16_t kMostRings = 256;

struct Elevation {
  double angle;
  std::uint32_t index;
};

std::vector<Elevation> sortedElevations(const ScanView& scan) {
  std::vector<Elevation> elevations;
  elevations.reserve(scan.size);
  for (std::uint32_t i = 0; i < scan.size; ++i) {
    if (!isReturn(scan.x[i], scan.y[i], scan.z[i])) continue;
    const double planar = planarRange(scan.x[i], scan.y[i]);
    elevations.push_back({std::atan2(static_cast<double>(scan.z[i]), planar), i});
  }
  std::sort(elevations.begin(), elevations.end(), [](const Elevation& a, const Elevation& b) {
    return a.angle != b.angle ? a.angle < b.angle : a.index < b.index;
  });
  return elevations;
}

/// Rings split at gaps; false where the beams cannot be told apart.
bool splitAtGaps(const std::vector<Elevation>& sorted, std::vector<std::uint16_t>* rings) {
  std::uint16_t ring = 0;
  double begin = sorted.front().angle;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i].angle - sorted[i - 1].angle > kRingGap) {
      ++ring;
      begin = sorted[i].angle;
    }
    if (ring >= kMostRings || sorted[i].angle - begin > kWidestRing) return false;
    (*rings)[sorted[i].index] = ring;
  }
  return true;
}

void cutIntoSteps(const std::vector<Elevation>& sorted, std::vector<std::uint16_t>* rings) {
  for (const Elevation& e : sorted) {
    const double step = std::floor((e.angle - sorted.front().angle) / kElevationStep);
    (*rings)[e.index] = static_cast<std::uint16_t>(step);
  }
}

}  // namespace

void countPointsByRing(const ScanView& scan, std::vector<std::size_t>* points) {
  const ScanView from = scan;  // which no count can be part of
  points->clear();
  std::size_t* count = points->data();
  std::size_t rings = 0;
  for (std::size_t i = 0; i < from.size; ++i) {
    const std::uint16_t ring = from.ring[i];
    if (ring >= rings) {  // seldom
      if (ring == SensorModel::kNoRank) continue;
      rings = ring + 1U;
      points->resize(rings);
      count = points->data();
    }
    const bool is_off_axis = (from.x[i] != 0.0F) | (from.y[i] != 0.0F);
    count[ring] += is_off_axis ? 1 : 0;
  }
}

SensorModel SensorModel::fromElevations(const std::vector<double>& elevation_deg) {
  require(elevation_deg.size() <= kNoRank, "the number of beams", "at most 65535",
          elevation_deg.size());
  SensorModel model;
  for (const double elevation : elevation_deg) {
    require(std::fabs(elevation) < 90.0, "the elevation of a beam", "within -90 and 90 deg",
            elevation);
    model.beams_.push_back(
        {std::tan(elevation * kDegree), std::numeric_limits<std::size_t>::max()});
  }
  model.orderRings();
  return model;
}

void SensorModel::observe(const ScanView& scan) {
  Recycled<std::size_t> points;
  countPointsByRing(scan, &points);
  observe(scan, points);
}

void SensorModel::observe(const ScanView& scan, const std::vector<std::size_t>& points_by_ring) {
  if (points_by_ring.size() > beams_.size()) beams_.resize(points_by_ring.size());
  Recycled<std::uint8_t> is_wanted;
  // Few rings of few scans have more than ever.
  if (!findRisingRings(points_by_ring, &is_wanted)) return;
  Recycled<std::size_t> points(points_by_ring.size());
  countTelling(scan, is_wanted, &points);
  if (!findRisingRings(points, &is_wanted)) return;
  Recycled<std::size_t> begin;
  std::size_t wanted = 0;
  for (std::size_t ring = 0; ring < points.size(); ++ring) {
    begin.push_back(wanted);
    if (is_wanted[ring] != 0) wanted += points[ring];
  }
  Recycled<double> tangents(wanted);
  sortTangents(scan, is_wanted, begin, &tangents);
  for (std::size_t ring = 0; ring < points.size(); ++ring) {
    if (is_wanted[ring] == 0) continue;
    beams_[ring] = {lowerMedian(&tangents[begin[ring]], points[ring]), points[ring]};
  }
  orderRings();
}

/// Which rings have more points than ever before; false: none.
bool SensorModel::findRisingRings(const std::vector<std::size_t>& points,
                                  std::vector<std::uint8_t>* is_rising) const {
  is_rising->clear();
  for (std::size_t ring = 0; ring < points.size(); ++ring) {
    is_rising->push_back(points[ring] > beams_[ring].points ? 1 : 0);
  }
  return std::find(is_rising->begin(), is_rising->end(), 1) != is_rising->end();
}

void SensorModel::orderRings() {
  rings_by_elevation_.clear();
  for (std::size_t ring = 0; ring < beams_.size(); ++ring) {
    if (beams_[ring].points > 0) rings_by_elevation_.push_back(static_cast<std::uint16_t>(ring));
  }
  std::stable_sort(
      rings_by_elevation_.begin(), rings_by_elevation_.end(),
      [this](std::uint16_t a, std::uint16_t b) { return beams_[a].tangent < beams_[b].tangent; });
  rank_of_ring_.assign(beams_.size(), kNoRank);
  for (std::size_t rank = 0; rank < rings_by_elevation_.size(); ++rank) {
    rank_of_ring_[rings_by_elevation_[rank]] = static_cast<std::uint16_t>(rank);
  }
}

std::vector<std::uint16_t> ringsFromElevation(const ScanView& scan) {
  std::vector<std::uint16_t> rings(scan.size, 0);
  const auto sorted = sortedElevations(scan);
  if (sorted.empty()) return rings;
  if (!splitAtGaps(sorted, &rings)) cutIntoSteps(sorted, &rings);
  return rings;
}

}  // namespace smoke_ground_reconstruction
