#include "smoke_ground_reconstruction/channel_segmentation.hpp"

#include <string>

#include "column_pairs.hpp"
#include "pair_tests.hpp"
#include "raster_pairs.hpp"
#include "smoke_ground_reconstruction/scan_raster.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

void requireWindow(const std::string& name, double from_deg, double to_deg) {
  require(from_deg >= -180.0 && from_deg <= to_deg, "min_" + name,
          "at least -180 and at most max_" + name, from_deg);
  require(to_deg <= 180.0 && to_deg - from_deg < 180.0, "max_" + name,
          "at most 180 and less than 180 above min_" + name, to_deg);
}

}  // namespace

void ChannelSegmentationParams::validate() const {
  require(dividesCircle(column_width_deg), "column_width_deg", kCircleDivisor, column_width_deg);
  requireWindow("ground_angle_deg", min_ground_angle_deg, max_ground_angle_deg);
  requireWindow("wall_angle_deg", min_wall_angle_deg, max_wall_angle_deg);
  require(max_ground_step_height >= 0.0, "max_ground_step_height", ">= 0", max_ground_step_height);
  require(max_wall_step_height >= 0.0, "max_wall_step_height", ">= 0", max_wall_step_height);
  require(min_range_step >= 0.0, "min_range_step", ">= 0", min_range_step);
  require(relative_distance_margin > 0.0, "relative_distance_margin", "> 0",
          relative_distance_margin);
}

ChannelSegmentation::ChannelSegmentation(const ChannelSegmentationParams& params)
    : params_(validated(params)), columns_(params.column_width_deg) {}

std::vector<Label> ChannelSegmentation::classify(const Scan& scan, const std::vector<Label>& labels,
                                                 const SensorModel& sensor,
                                                 std::optional<ScanRaster>* raster) const {
  const PairTests tests(params_);
  std::vector<Label> result = labels;
  std::optional<ScanRaster> own;  // memory of the one given stays with who gave it
  const bool is_of_use = raster != nullptr && *raster && !(*raster)->is_crowded &&
                         (*raster)->columns == columns_.count();
  if (is_of_use) {
    (*raster)->keep(scan, labels);
  } else {
    own.emplace(scan, labels, columns_);
  }
  const ScanRaster& kept = is_of_use ? **raster : *own;
  if (!kept.is_crowded) {
    labelRaster(scan, kept, sensor, tests, params_.label_point, &result);
    return result;
  }
  Recycled<std::uint8_t> use(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) use[i] = labels[i] == Label::kKept ? 1 : 0;
  const ScanColumns columns(scan, use, columns_, sensor);
  labelColumns(scan, columns, tests, params_.label_point, &result);
  return result;
}

}  // namespace smoke_ground_reconstruction
