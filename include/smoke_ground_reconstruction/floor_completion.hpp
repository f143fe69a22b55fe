#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/confidence.hpp"
#include "smoke_ground_reconstruction/floor_cells.hpp"
#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/room.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

/// The returns of a scan as the sensor sent them.
struct SensedReturns {
  const Points& points;  ///< in the sensor frame
  const std::vector<float>& intensity;
  const std::vector<std::uint16_t>& ring;
};

/// What of the floor is claimed.
struct FloorClaim {
  std::vector<double> limit;            ///< how far in each column, drop-offs apart [m]
  std::vector<std::uint32_t> measured;  ///< returns of the room that are floor, in order
};

/// Points of the floor that were not measured, in the room's upright frame: the first `size` of
/// each array.
struct DrawnFloor {
  static constexpr std::uint16_t kNoRing = 0xFFFF;

  Points points;  ///< [m], on plane and relief
  std::vector<std::uint16_t> column;
  std::vector<float> planar;        ///< [m]
  std::vector<std::uint16_t> ring;  ///< of the beam that a point lies on; kNoRing of fill
  std::size_t size = 0, beams = 0;  ///< the latter come first, fill behind them

  /// Makes the arrays long enough for so many more.
  void reserveMore(std::size_t more);
};

/// Completes the floor of a room: how far it is claimed, its points and its outline. Keeps its
/// buffers. Thesis: Algorithm 3 draws evenly spaced radii; here the sensor's own beams are cut with
/// the floor, and what lies between them is filled.
class FloorCompletion {
 public:
  explicit FloorCompletion(const AzimuthBins& bins, const ColumnDirections& directions);

  /// How far the floor of a room is claimed, and which returns are floor.
  const FloorClaim& claim(const Room& room);
  /// The surface: measured points in input order, then claimed floor where none was measured, the
  /// beams' own points before the fill; and the outline, a vertex per column where floor is
  /// claimed, and the foot once where none is.
  /// \param sensed  the room's returns.
  /// \param floor  in the level frame.
  void complete(const SensedReturns& sensed, Room* room, const SensorModel& sensor,
                const Mounting& mounting, const FloorModel& floor, FloorSurface* surface);

 private:
  /// A ring's beams.
  struct Stretch {
    std::vector<float> x, y, z;
    std::vector<double> planar;
    std::vector<std::uint32_t> column;
    std::vector<double> limit, begin, end;  // of the claim in each point's column
    std::vector<std::uint32_t> is_claimed, cell, chosen;

    void reserve(std::size_t size);
  };
  /// The beams in the room's upright frame: one at azimuth i and a tangent of elevation runs along
  /// (x, y, z)[i] + tangent * up.
  struct Beams {
    std::vector<double> x, y, z;
    std::vector<double> slope;  // against the floor
    std::array<double, 3> up, plane;
    double up_slope, lowest;  // of the slopes
    bool is_level;            // does each meet the floor in the column of its azimuth?
  };
  /// What single precision tells of many places at once: whether they need be looked at.
  struct Screen {
    std::vector<float> x, y, slope;  // of beams, padded with such as never meet the floor
    std::vector<float> reach;        // squares of planar ranges: no claim is as far [m2]
    std::vector<std::uint32_t> chosen;
  };

  void findMeasured(const Room& room);
  void findSurelyFloor(const Room& room);
  bool isMeasured(const Room& room, std::uint32_t low) const;
  void drawOn(const Room& room);
  void layBeams(const Room& room, const Mounting& mounting);
  bool mayMeetFloor(double tangent, double farthest) const;
  void layScreen();
  std::size_t chooseBeams(double tangent);
  void cutBeams(double tangent, std::size_t count);
  void raise(FloorRelief* relief);
  void drawBeams(const Room& room, const SensorModel& sensor, const Mounting& mounting);
  void drawFill(const Room& room);
  void fill(const Room& room, std::size_t column, double begin, double spacing,
            std::uint32_t count);
  void lookUpClaim(const DropOffs& drops, std::size_t size);
  bool findClaimed(std::size_t size);
  void keep(std::size_t size, std::uint16_t ring);
  void placeMeasured(const SensedReturns& sensed, const Room& room, const FloorModel& floor,
                     FloorSurface* surface);
  void draw(Room* room, const SensorModel& sensor, const Mounting& mounting);
  void placeDrawn(Room* room, const SensorModel& sensor, const Mounting& mounting,
                  const FloorModel& floor, FloorSurface* surface);
  void placeRings(const SensorModel& sensor, FloorSurface* surface);
  void tellSigma(Room* room, const FloorModel& floor, const Points& level, FloorSurface* surface);
  void outline(const Room& room, const Mounting& mounting, FloorOutline* boundary) const;

  const AzimuthBins& bins_;
  const ColumnDirections& directions_;
  FloorClaim claim_;
  DrawnFloor drawn_;
  Beams beams_ = {};
  Screen screen_;
  Stretch stretch_;
  Points level_;
  std::vector<std::uint16_t> column_;  // of measured returns, and their planar ranges
  std::vector<float> planar_;
  std::vector<float> surely_floor_;  // by column [m]
  CellSet measured_cells_;
  std::vector<std::uint32_t> past_;  // measured returns past the limits
  FarthestReturns farthest_;
  FloorConfidence confidence_;
  std::vector<double> beyond_, between_rings_, tangents_;
};

}  // namespace smoke_ground_reconstruction
