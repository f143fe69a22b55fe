#pragma once

namespace smoke_ground_reconstruction {

/// Parameters of `room_boundary`: what a tuner in the field may turn. The mounting height is the
/// only number it needs to be told; all of these may stay as they are.
struct RoomBoundaryParams {
  int max_floor_tilt_deg = 6;          ///< of floor and mounting together [deg]
  double max_height_deviation = 0.15;  ///< of the floor from the mounting height [m]
  double floor_tolerance = 0.0;        ///< returns so near to the plane are floor [m]; 0: automatic
  double max_slope = 0.16;             ///< rise of a ramp per metre
  double max_step_height = 0.2;        ///< of a platform over the floor [m]
  double drop_depth = 0.0;             ///< so far below the floor is a drop [m]; 0: automatic
  double smoke_gate = 2.0;             ///< weaker near returns are smoke, in strengths of the floor
  double min_wall_height = 0.1;        ///< returns so far above the floor may be wall [m]
  double furniture_height = 3.0;       ///< walls are told where the view is higher [m]
  double max_bridge_ratio = 1.6;       ///< a wall is drawn on to so many times its seen length
  double max_range = 50.0;             ///< no floor is claimed beyond [m]
  double cell_size = 0.1;              ///< measured floor wins in cells of this edge [m]

  /// \throws std::invalid_argument naming the parameter, its value and what it may be.
  void validate() const;
};

}  // namespace smoke_ground_reconstruction
