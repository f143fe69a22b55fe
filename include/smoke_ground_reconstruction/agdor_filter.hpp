#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/neighbor_counter.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"

namespace smoke_ground_reconstruction {

enum class ThetaUnit { kDegrees, kRadians };
enum class DenoiserEngine { kWindow, kKdTree };

/// Parameters of the denoiser; names, units and defaults as in cfg/Denoiser.cfg.
struct AgdorParams {
  double intensity_threshold =
      25.0;                ///< below it a point is a candidate for removal [sensor scale]
  double alpha = 0.5;      ///< factor of the search radius
  double theta_deg = 0.4;  ///< angle of the search radius: the horizontal resolution [deg]
  ThetaUnit theta_unit = ThetaUnit::kDegrees;  ///< unit in which theta enters alpha * theta * r
  int min_neighbors = 100;   ///< a candidate is kept only with more neighbours than this
  int max_neighbors = 5000;  ///< ... and at most this many; 0: unlimited
  DenoiserEngine engine = DenoiserEngine::kWindow;

  /// alpha * theta: the search radius per metre of range.
  double radiusPerRange() const;
  /// \throws std::invalid_argument naming the parameter, its value and what it may be.
  void validate() const;
};

/// AGDOR: adaptive group of density outlier removal. Thesis: Section 3.2, Algorithm 1.
///
/// Points of intensity >= threshold are kept. Of the others those are kept whose count of
/// neighbours within alpha * theta * range, the point itself not counted, is above min_neighbors
/// and at most max_neighbors. Deviation: the listing has no upper bound; Table A.1 prints "min. /
/// max. cluster size 100 / 5000". Deviation: theta's value and unit are printed nowhere; degrees
/// make the radius 0.2 r, radians 3.5 mm per metre, in which no point has a neighbour.
class AgdorFilter {
 public:
  /// \param kdtree  maker of the KD-tree engine (pcl/engines.hpp); needed for engine kKdTree alone.
  /// \throws std::invalid_argument on bad parameters, or on engine kKdTree without a maker.
  explicit AgdorFilter(const AgdorParams& params, NeighborCounterFactory kdtree = nullptr);

  /// One label per point: kInvalid, kKept or kNoise.
  /// \param raster  where given: gets the raster of all valid points if one was made, which serves
  /// the
  ///                segmentation as well.
  std::vector<Label> classify(const Scan& scan, std::optional<ScanRaster>* raster = nullptr) const;

 private:
  AgdorParams params_;
  NeighborCounterFactory make_counter_;
};

}  // namespace smoke_ground_reconstruction
