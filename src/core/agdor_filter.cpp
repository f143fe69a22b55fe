#include "smoke_ground_reconstruction/agdor_filter.hpp"

#include <limits>
#include <utility>

#include "multiversion.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/raster_crowds.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/window_counter.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// The columns of the raster that the segmenter has, too.
const AzimuthBins& columns() {
  static const AzimuthBins bins(ChannelSegmentationParams().column_width_deg);
  return bins;
}

/// No branches: smoke decides which points are low.
void findCandidates(const Scan& scan, double intensity_threshold, std::vector<std::uint32_t>* low) {
  low->resize(scan.size() + 1);
  const float* const intensity = scan.intensity.data();
  const std::uint8_t* const valid = scan.valid.data();
  std::uint32_t* next = low->data();
  for (std::uint32_t i = 0, size = static_cast<std::uint32_t>(scan.size()); i < size; ++i) {
    const bool is_low = static_cast<double>(intensity[i]) < intensity_threshold;
    *next = i;
    next += (valid[i] != 0) & is_low ? 1 : 0;
  }
  low->resize(static_cast<std::size_t>(next - low->data()));
}

/// Low points that are in no crowd become noise.
SMOKE_GROUND_MULTIVERSION
void labelNoise(const float* intensity, const std::uint8_t* is_outside, std::size_t size,
                double intensity_threshold, Label* labels) {
  for (std::size_t i = 0; i < size; ++i) {
    const bool is_low = static_cast<double>(intensity[i]) < intensity_threshold;
    labels[i] = is_low & (is_outside[i] != 0) ? Label::kNoise : labels[i];
  }
}

/// Layers of a raster that would be filled well enough to pay; 0: none. Where sensors fire once per
/// ring and column, most places have a point, and as many a second one in dual returns. Where they
/// fire a little more often, a second layer is mostly empty; where twice, many places have three.
std::size_t worthwhileLayers(const Scan& scan) {
  const auto places = static_cast<double>(ScanRaster::rowsFor(scan) * columns().count());
  const double filled = static_cast<double>(scan.size()) / places;
  if (filled > 0.3 && filled < 1.02) return 1;
  return filled > 1.25 && filled < 1.7 ? 2 : 0;
}

/// On the raster; false where it does not serve.
bool removeOnRaster(const Scan& scan, double intensity_threshold, const Crowd& crowd,
                    std::vector<Label>* labels, std::optional<ScanRaster>* raster) {
  const std::size_t layers = worthwhileLayers(scan);
  if (layers == 0 || !mayFindOutsiders(crowd, columns().count())) return false;
  raster->emplace(scan, *labels, columns(), layers);
  Recycled<std::uint8_t> is_outside;
  if ((*raster)->is_crowded || !findOutsiders(scan, **raster, crowd, &is_outside)) return false;
  labelNoise(scan.intensity.data(), is_outside.data(), scan.size(), intensity_threshold,
             labels->data());
  return true;
}

}  // namespace

double AgdorParams::radiusPerRange() const {
  const double theta = theta_unit == ThetaUnit::kDegrees ? theta_deg : theta_deg * (M_PI / 180.0);
  return alpha * theta;
}

void AgdorParams::validate() const {
  require(intensity_threshold >= 0.0, "intensity_threshold", ">= 0", intensity_threshold);
  require(alpha > 0.0, "alpha", "> 0", alpha);
  require(theta_deg > 0.0, "theta_deg", "> 0", theta_deg);
  require(min_neighbors >= 0, "min_neighbors", ">= 0", min_neighbors);
  require(max_neighbors == 0 || max_neighbors > min_neighbors, "max_neighbors",
          "0 (unlimited) or above min_neighbors", max_neighbors);
}

AgdorFilter::AgdorFilter(const AgdorParams& params, NeighborCounterFactory kdtree)
    : params_(params), make_counter_(std::move(kdtree)) {
  params_.validate();
  if (params_.engine == DenoiserEngine::kWindow) {
    make_counter_ = [k = params_.radiusPerRange()](const Scan& scan) {
      return std::make_unique<WindowCounter>(scan, k);
    };
  }
  require(static_cast<bool>(make_counter_), "engine", "window in a build without PCL", "kdtree");
}

std::vector<Label> AgdorFilter::classify(const Scan& scan,
                                         std::optional<ScanRaster>* raster) const {
  std::optional<ScanRaster> own;
  if (raster == nullptr) raster = &own;
  raster->reset();
  std::vector<Label> labels(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    labels[i] = scan.valid[i] != 0 ? Label::kKept : Label::kInvalid;
  }
  const Crowd crowd = {params_.radiusPerRange(), static_cast<std::size_t>(params_.min_neighbors),
                       params_.max_neighbors == 0
                           ? std::numeric_limits<std::size_t>::max()
                           : static_cast<std::size_t>(params_.max_neighbors)};
  const bool may_be_on_raster = params_.engine == DenoiserEngine::kWindow;
  if (may_be_on_raster &&
      removeOnRaster(scan, params_.intensity_threshold, crowd, &labels, raster)) {
    return labels;
  }
  Recycled<std::uint32_t> low;
  findCandidates(scan, params_.intensity_threshold, &low);
  if (low.empty()) return labels;
  Recycled<std::uint32_t> lonely;
  make_counter_(scan)->findOutsiders(low, crowd, &lonely);
  for (const std::uint32_t i : lonely) labels[i] = Label::kNoise;
  return labels;
}

}  // namespace smoke_ground_reconstruction
