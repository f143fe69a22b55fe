#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace smoke_ground_reconstruction {

/// Where a surface point comes from. The values are those of the `provenance` field.
enum class Provenance : std::uint8_t { kMeasured = 0, kReconstructed = 1, kMeasuredBefore = 2 };

/// What ends the floor at a vertex of its outline. The values are those of msg/FloorBoundary.msg.
enum class BoundaryKind : std::uint8_t { kWallSeen = 0, kWallInferred = 1, kLimitOfKnowledge = 2 };

/// Closed counter-clockwise outline of the claimed floor in the sensor frame [m]; the last vertex
/// joins the first. Empty where no floor is claimed. (The message FloorBoundary is generated into
/// this namespace, so the struct cannot bear its name.)
struct FloorOutline {
  std::vector<std::array<float, 3>> vertices;
  std::vector<BoundaryKind> kinds;
};

/// The floor: points in the sensor frame [m], one entry per point in every array.
struct FloorSurface {
  std::vector<float> x, y, z;
  std::vector<float> intensity;  ///< 0 where reconstructed
  std::vector<std::uint16_t> ring;
  std::vector<Provenance> provenance;
  std::vector<float> confidence;  ///< 0..1
  /// One sigma of the point's height as that of the floor [m]; empty where a method states none.
  std::vector<float> sigma;
  FloorOutline boundary;
  std::array<double, 3> floor_plane = {0, 0, 0};  ///< a, b, c of z = a x + b y + c, sensor frame

  std::size_t size() const { return x.size(); }
  /// Makes room for so many points, with a sigma each; keeps memory and whatever stands in it.
  void resize(std::size_t points);
  /// Drops the points and the outline, not their memory.
  void clear();
  void push(const std::array<float, 3>& point, float point_intensity, std::uint16_t point_ring,
            Provenance point_provenance, float point_confidence);
};

/// Map of square cells in the level frame, row by row from the corner of smallest x and y.
struct OccupancyGrid {
  static constexpr std::int8_t kFloor = 0;
  static constexpr std::int8_t kWall = 100;
  static constexpr std::int8_t kUnknown = -1;

  double resolution = 0.1;        ///< edge of a cell [m]
  std::int64_t first_column = 0;  ///< x of the grid's corner is first_column * resolution [m]
  std::int64_t first_row = 0;     ///< y of the grid's corner is first_row * resolution [m]
  std::size_t width = 0;          ///< cells along x
  std::size_t height = 0;         ///< cells along y
  std::vector<std::int8_t> cells;
};

}  // namespace smoke_ground_reconstruction
