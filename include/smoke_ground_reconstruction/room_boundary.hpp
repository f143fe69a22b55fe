#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/floor_completion.hpp"
#include "smoke_ground_reconstruction/floor_model.hpp"
#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/room.hpp"
#include "smoke_ground_reconstruction/room_boundary_params.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"
#include "smoke_ground_reconstruction/visibility.hpp"

namespace smoke_ground_reconstruction {

/// The floor and what it was made from.
struct RoomBoundaryResult {
  FloorSurface
      surface;  ///< measured points, then the beams' own, then what fills between the rings
  std::vector<Label> labels;  ///< per input point: ground, wall (the boundary's), noise, other
  FloorModel floor;           ///< in the level frame
  Profile profile;            ///< of the walls, in the upright frame
  DropOffs drops;
  std::vector<double> limit;  ///< how far floor is claimed in each column [m]
  Visibility visibility;
};

/// The full floor of a room from its floor plane, its walls and its drop-offs.
///
/// What the thesis names as the limits of its own method (Section 6.2) is what this one is built
/// against: a boundary per 0.4 deg column instead of one distance per 10 deg segment, a robust
/// plane instead of lowest wall points, the sensor's own beams cut with floor and boundary instead
/// of evenly spaced radii, a merge per cell instead of per segment, and what is not known stays
/// unknown. Keeps the last good floor plane and its buffers; use one per sensor.
class RoomBoundary {
 public:
  /// \throws std::invalid_argument on bad parameters.
  explicit RoomBoundary(const RoomBoundaryParams& params = RoomBoundaryParams());
  RoomBoundary(const RoomBoundary&) = delete;
  RoomBoundary& operator=(const RoomBoundary&) = delete;

  /// From the next scan on; what was learned of the sensor's room is kept.
  /// \throws std::invalid_argument on bad parameters.
  void setParams(const RoomBoundaryParams& params);

  /// The floor of one scan, from all of its points in the sensor frame. It has its own denoising:
  /// posts and lines are found among all returns, and smoke's soft returns near the sensor are told
  /// by their weakness beside the floor's. O(n).
  /// \param result  overwritten; handed in again, it is filled without allocation.
  void reconstruct(const ScanView& scan, const SensorModel& sensor, const Mounting& mounting,
                   RoomBoundaryResult* result);

 private:
  void takeIn(const ScanView& scan, const Mounting& mounting);
  Room& findFloor(const Mounting& mounting, FloorModel* floor);
  Room& look(const FloorModel& floor);
  void pickWedges();
  void label(const Room& room, const FloorClaim& claim, std::vector<Label>* labels) const;

  RoomBoundaryParams params_;
  AzimuthBins bins_;
  ColumnDirections directions_;
  FloorFitter floor_fitter_;
  std::optional<FloorModel> floor_;  // the last good one
  std::vector<std::uint32_t> valid_;
  Points sensed_, level_;  // in the sensor's frame, where that is not level, and in the level one
  Points off_posts_;       // of the latter, what stands where no post does
  std::vector<float> intensity_;
  std::vector<std::uint16_t> ring_;
  std::array<Room, 2> rooms_;
  std::vector<std::uint32_t> bin_;         // columns in the level frame
  std::vector<std::uint8_t> is_in_wedge_;  // per return
  std::vector<std::uint32_t> wedge_;       // some of the returns
  Points wedges_;
  std::vector<float> wedge_intensity_;
  FloorCompletion completion_;
  VisibilityEstimator visibility_;
};

}  // namespace smoke_ground_reconstruction
