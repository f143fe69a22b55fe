#pragma once

#include <string>

#include "smoke_ground_reconstruction/floor_model.hpp"
#include "smoke_ground_reconstruction/ros/stage_health.hpp"
#include "smoke_ground_reconstruction/visibility.hpp"

namespace smoke_ground_reconstruction {

/// Height of the sensor above the floor [m] as it is given, and by what.
struct GivenHeight {
  double height;
  std::string from;  ///< MountingSource::heightIsFrom()
};

/// What a scan of a room shows, for /diagnostics: heights, and how far the sensor sees.
Findings findingsOf(const FloorModel& floor, const Visibility& visibility,
                    const GivenHeight& given);

/// What is wrong with the height given, in one line; empty where nothing is.
std::string heightWarning(const FloorModel& floor, const GivenHeight& given);

}  // namespace smoke_ground_reconstruction
