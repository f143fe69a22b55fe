#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/scan_view.hpp"

namespace smoke_ground_reconstruction {

/// The order of a LiDAR's rings by elevation, whatever the driver's numbering: ring 0 is the lowest
/// beam of a QT128 and the highest of an Ouster, and a QT128's last 32 rings interleave with
/// others. Seeded from the beam table of a known sensor or learned from the scans themselves.
class SensorModel {
 public:
  static constexpr std::uint16_t kNoRank = 0xFFFF;

  SensorModel() = default;

  /// Known beams: `elevation_deg[ring]` [deg] about the sensor's xy plane. Never overruled by
  /// scans.
  /// \throws std::invalid_argument on an elevation not within +-90 deg, or above 65535 beams.
  static SensorModel fromElevations(const std::vector<double>& elevation_deg);

  /// Learns the elevation of each ring in the scan: the lower median of z / planar range of its
  /// points. A ring keeps the median of the scan that showed most points of it, so that a smoky
  /// scan with three returns does not overrule a clear one. Invalid points and points on the
  /// vertical axis tell nothing. O(n).
  void observe(const ScanView& scan);
  /// The same where the points of its rings were counted before.
  void observe(const ScanView& scan, const std::vector<std::size_t>& points_by_ring);

  /// Place of a ring in elevation order, 0 the lowest; kNoRank for a ring never seen.
  /// Equal elevations are ordered by ring number.
  std::uint16_t rank(std::uint16_t ring) const {
    return ring < rank_of_ring_.size() ? rank_of_ring_[ring] : kNoRank;
  }

  /// Ring numbers, lowest beam first.
  const std::vector<std::uint16_t>& ringsByElevation() const { return rings_by_elevation_; }

  /// Tangent of the elevation of a ring that has a rank.
  double tangent(std::uint16_t ring) const { return beams_[ring].tangent; }

 private:
  struct Beam {
    double tangent = 0.0;
    std::size_t points = 0;  // behind the median; 0: never seen
  };

  bool findRisingRings(const std::vector<std::size_t>& points,
                       std::vector<std::uint8_t>* is_rising) const;
  void orderRings();

  std::vector<Beam> beams_;  // by ring number
  std::vector<std::uint16_t> rings_by_elevation_;
  std::vector<std::uint16_t> rank_of_ring_;
};

/// How many points each ring has that may tell its elevation: all but those on the vertical axis,
/// which drivers fill up with where nothing came back. O(n).
void countPointsByRing(const ScanView& scan, std::vector<std::size_t>* points);

/// Ring numbers for a cloud whose driver sends none: points are grouped by elevation, ring 0 the
/// lowest, a new ring wherever two neighbouring elevations are more than 0.15 deg apart. Where the
/// beams cannot be told apart (more than 256 groups, or a group wider than 1 deg), elevation is cut
/// into steps of 0.5 deg instead. Invalid points get ring 0. O(n log n).
std::vector<std::uint16_t> ringsFromElevation(const ScanView& scan);

}  // namespace smoke_ground_reconstruction
