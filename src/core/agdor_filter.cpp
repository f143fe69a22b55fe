#include "smoke_ground_reconstruction/agdor_filter.hpp"

#include <limits>
#include <utility>

#include "smoke_ground_reconstruction/recycled.hpp"
#include "smoke_ground_reconstruction/window_counter.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

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

std::vector<Label> AgdorFilter::classify(const Scan& scan) const {
  std::vector<Label> labels(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    labels[i] = scan.valid[i] != 0 ? Label::kKept : Label::kInvalid;
  }
  Recycled<std::uint32_t> low;
  findCandidates(scan, params_.intensity_threshold, &low);
  if (low.empty()) return labels;
  const Crowd crowd = {params_.radiusPerRange(), static_cast<std::size_t>(params_.min_neighbors),
                       params_.max_neighbors == 0
                           ? std::numeric_limits<std::size_t>::max()
                           : static_cast<std::size_t>(params_.max_neighbors)};
  Recycled<std::uint32_t> lonely;
  make_counter_(scan)->findOutsiders(low, crowd, &lonely);
  for (const std::uint32_t i : lonely) labels[i] = Label::kNoise;
  return labels;
}

}  // namespace smoke_ground_reconstruction
