#pragma once

#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <optional>

#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// Where a look along the floor leaves the claimed floor.
struct FloorLimit {
  double distance;  ///< along the floor from the point below the sensor [m]
  BoundaryKind kind;
};

/// First limit of the floor in the direction (x, y) of the level frame, a unit vector; nothing
/// where no floor is claimed in that direction. O(vertices).
std::optional<FloorLimit> limitOfFloor(const FloorOutline& outline, const Mounting& mounting,
                                       double x, double y);

/// What an operator is shown: the outline coloured by what ends the floor there (green: a wall was
/// seen, orange: a wall is inferred, red: nothing is known beyond), and in words how far that is to
/// the front, the left, the back and the right. Always the same markers, so that a new scan
/// replaces all of the old; they vanish by themselves when scans stop to come.
visualization_msgs::MarkerArrayPtr toMarkers(const std_msgs::Header& header,
                                             const FloorOutline& outline, const Mounting& mounting);

}  // namespace smoke_ground_reconstruction
