#include "near_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "azimuth.hpp"
#include "lanes.hpp"
#include "multiversion.hpp"
#include "neighbor_screen.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kWidth = ScanRaster::kWidth;
constexpr std::size_t kMostCandidates = 128;  // of a row's points, in the mean
constexpr double kUpright = M_PI / 2.0;

/// Signed squares of the sines of elevations in a row, lane by lane.
struct Sines {
  std::array<float, kLanes> lowest, highest;
};

/// Takes the points of a stripe in. Returns the least squared range.
SMOKE_GROUND_MULTIVERSION
float takeSines(const float* x, const float* y, const float* z, std::size_t rows, Sines* of_rows) {
  Floats nearest = Floats{} + INFINITY;
  for (std::size_t row = 0; row < rows; ++row) {
    Floats lowest = loadLanes(of_rows[row].lowest.data());
    Floats highest = loadLanes(of_rows[row].highest.data());
    for (std::size_t at = row * kWidth; at < (row + 1) * kWidth; at += kLanes) {
      const Floats here_z = loadLanes(z + at);
      const Floats square = squaredRangeOf(loadLanes(x + at), loadLanes(y + at), here_z);
      const Floats sine = here_z * magnitudeOf(here_z) / square;
      lowest = sine < lowest ? sine : lowest;  // no number is not less
      highest = sine > highest ? sine : highest;
      nearest = square < nearest ? square : nearest;
    }
    std::memcpy(of_rows[row].lowest.data(), &lowest, sizeof(lowest));
    std::memcpy(of_rows[row].highest.data(), &highest, sizeof(highest));
  }
  float least = INFINITY;
  for (std::size_t lane = 0; lane < kLanes; ++lane) least = std::min(least, nearest[lane]);
  return least;
}

double elevationOf(float signed_square, double margin) {
  const double square = signed_square;
  const double sine = std::copysign(std::sqrt(std::fabs(square)), square) + margin;
  return std::asin(std::clamp(sine, -1.0, 1.0));
}

/// Lowest and highest elevation in a row [rad]; the other way round in one without points.
struct Span {
  double lowest = INFINITY, highest = -INFINITY;

  bool isEmpty() const { return lowest > highest; }
  double steepest() const { return std::max(-lowest, highest); }
  double distanceTo(const Span& other) const {
    return std::max(other.lowest - highest, lowest - other.highest);
  }
};

/// Greatest difference of azimuth [rad] of two points that far apart, of rows that far apart.
double azimuthBetween(const Span& a, const Span& b, double angle) {
  const double apart = std::sin(std::max(0.0, a.distanceTo(b)) / 2.0);
  const double whole = std::sin(angle / 2.0);
  const double cosines = std::cos(a.steepest()) * std::cos(b.steepest());
  return 2.0 *
         std::asin(std::sqrt(std::clamp((whole * whole - apart * apart) / cosines, 0.0, 1.0)));
}

std::size_t layersOf(const ScanRaster& raster) { return raster.has_second ? 2 : 1; }

/// Elevations of all rows. Returns the least squared range.
float measureRows(const Scan& scan, const ScanRaster& raster, std::vector<Span>* spans) {
  Recycled<Sines> sines(raster.rows);
  for (Sines& row : sines) {
    row.lowest.fill(INFINITY);
    row.highest.fill(-INFINITY);
  }
  float nearest = INFINITY;
  for (std::size_t stripe = 0; stripe < raster.stripes; ++stripe) {
    for (std::size_t layer = 0; layer < layersOf(raster); ++layer) {
      const std::size_t first = stripe * raster.rows * kWidth;
      const std::size_t at = layer == 0 ? first : raster.secondOf(first);
      nearest = std::min(nearest, takeSines(&raster.x[at], &raster.y[at], &raster.z[at],
                                            raster.rows, sines.data()));
    }
  }
  for (const ScanRaster::Extra& extra : raster.extras) {
    const auto [x, y, z] = scan.point(extra.point);
    const float square = squaredRangeOf(x, y, z);
    Sines& row = sines[raster.rowOf(extra.place)];
    row.lowest[0] = std::min(row.lowest[0], z * std::fabs(z) / square);
    row.highest[0] = std::max(row.highest[0], z * std::fabs(z) / square);
    nearest = std::min(nearest, square);
  }
  spans->clear();
  for (const Sines& row : sines) {
    const float lowest = *std::min_element(row.lowest.begin(), row.lowest.end());
    const float highest = *std::max_element(row.highest.begin(), row.highest.end());
    spans->push_back(lowest > highest ? Span()
                                      : Span{elevationOf(lowest, -kSineMargin),
                                             elevationOf(highest, kSineMargin)});
  }
  return nearest;
}

/// The rows near one, the nearest first.
bool findReach(const ScanRaster& raster, std::size_t row, double angle,
               const std::vector<Span>& spans, RowReach* reach, std::vector<NearRow>* near_rows) {
  if (spans[row].steepest() + angle >= kUpright - 1e-3) return false;
  using Near = std::pair<double, std::uint32_t>;
  Recycled<Near> near;
  for (std::uint32_t other = 0; other < raster.rows; ++other) {
    const double distance = spans[row].distanceTo(spans[other]);
    if (distance <= angle) near.push_back({other == row ? -INFINITY : distance, other});
  }
  std::sort(near.begin(), near.end());
  reach->begin = static_cast<std::uint32_t>(near_rows->size());
  for (const auto& [distance, other] : near) {
    const double azimuth = azimuthBetween(spans[row], spans[other], angle) + kAngleMargin;
    const double columns = azimuth / kTwoPi * static_cast<double>(raster.columns) + 1.0;
    if (columns >= kHalo + 1.0) return false;
    for (std::size_t first = 0; first < layersOf(raster) * raster.rows; first += raster.rows) {
      near_rows->push_back(
          {other + static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(columns)});
    }
  }
  reach->end = static_cast<std::uint32_t>(near_rows->size());
  return true;
}

}  // namespace

bool NearRows::find(const Scan& scan, const ScanRaster& raster, double radius_per_range) {
  Recycled<Span> spans;
  const float least = measureRows(scan, raster, &spans) * ScreenFactors(radius_per_range).surely;
  if (!(least >= static_cast<float>(kLeastScreened))) return false;
  const double angle = std::asin(radius_per_range) + kAngleMargin;
  reaches_.assign(raster.rows, RowReach());
  for (std::size_t row = 0; row < raster.rows; ++row) {
    if (spans[row].isEmpty()) continue;
    if (!findReach(raster, row, angle, spans, &reaches_[row], &rows_)) return false;
  }
  return rows_.size() <= kMostCandidates / kLanes * raster.rows;
}

}  // namespace smoke_ground_reconstruction
