#pragma once

#include <geometry_msgs/PolygonStamped.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/PointCloud2.h>
#include <smoke_ground_reconstruction/FloorBoundary.h>
#include <std_msgs/Header.h>

#include <boost/make_shared.hpp>

#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

// The results as messages. Every message carries the scan's header whole and lies in its frame.

/// Points of 28 bytes: x, y, z, intensity FLOAT32, ring UINT16, provenance UINT8, confidence
/// and sigma FLOAT32; sigma is NaN where a method states none.
/// \param cloud  overwritten and returned; its memory is used.
sensor_msgs::PointCloud2Ptr toSurfaceMsg(
    const std_msgs::Header& header, const FloorSurface& surface,
    const sensor_msgs::PointCloud2Ptr& cloud = boost::make_shared<sensor_msgs::PointCloud2>());

/// The grid lies on the floor: the mounting turns and lowers its origin. Its cells go over to the
/// message where the grid is a temporary one.
nav_msgs::OccupancyGridPtr toOccupancyMsg(const std_msgs::Header& header, OccupancyGrid grid,
                                          const Mounting& mounting);

FloorBoundaryPtr toBoundaryMsg(const std_msgs::Header& header, const FloorOutline& outline);

/// The outline without its kinds, for display.
geometry_msgs::PolygonStampedPtr toPolygonMsg(const std_msgs::Header& header,
                                              const FloorOutline& outline);

}  // namespace smoke_ground_reconstruction
