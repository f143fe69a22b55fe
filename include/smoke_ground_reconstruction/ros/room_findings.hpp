#pragma once

#include <string>

#include "smoke_ground_reconstruction/floor_model.hpp"
#include "smoke_ground_reconstruction/ros/stage_health.hpp"
#include "smoke_ground_reconstruction/visibility.hpp"

namespace smoke_ground_reconstruction {

/// What a scan of a room shows, for /diagnostics: heights, and how far the sensor sees.
/// \param sensor_height  as given [m].
Findings findingsOf(const FloorModel& floor, const Visibility& visibility, double sensor_height);

/// What is wrong with the height given [m], in one line; empty where nothing is.
std::string heightWarning(const FloorModel& floor, double sensor_height);

}  // namespace smoke_ground_reconstruction
