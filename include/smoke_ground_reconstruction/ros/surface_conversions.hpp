#pragma once

#include <geometry_msgs/PolygonStamped.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/PointCloud2.h>
#include <smoke_ground_reconstruction/FloorBoundary.h>
#include <std_msgs/Header.h>

#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

// The results as messages. Every message carries the scan's header whole and lies in its frame.

/// Points of 28 bytes: x, y, z, intensity FLOAT32, ring UINT16, provenance UINT8, confidence
/// and sigma FLOAT32; sigma is NaN where a method states none.
sensor_msgs::PointCloud2Ptr toSurfaceMsg(const std_msgs::Header& header,
                                         const FloorSurface& surface);

/// The grid lies on the floor: the mounting turns and lowers its origin.
nav_msgs::OccupancyGridPtr toOccupancyMsg(const std_msgs::Header& header, const OccupancyGrid& grid,
                                          const Mounting& mounting);

FloorBoundaryPtr toBoundaryMsg(const std_msgs::Header& header, const FloorOutline& outline);

/// The outline without its kinds, for display.
geometry_msgs::PolygonStampedPtr toPolygonMsg(const std_msgs::Header& header,
                                              const FloorOutline& outline);

}  // namespace smoke_ground_reconstruction
