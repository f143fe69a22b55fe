#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/column_ranges.hpp"
#include "smoke_ground_reconstruction/drop_offs.hpp"
#include "smoke_ground_reconstruction/floor_cells.hpp"
#include "smoke_ground_reconstruction/floor_model.hpp"
#include "smoke_ground_reconstruction/floor_relief.hpp"
#include "smoke_ground_reconstruction/hidden_drops.hpp"
#include "smoke_ground_reconstruction/posts.hpp"
#include "smoke_ground_reconstruction/return_kind.hpp"
#include "smoke_ground_reconstruction/room_boundary_params.hpp"
#include "smoke_ground_reconstruction/visibility.hpp"
#include "smoke_ground_reconstruction/wall_lines.hpp"
#include "smoke_ground_reconstruction/wall_profile.hpp"
#include "smoke_ground_reconstruction/wall_ramps.hpp"

namespace smoke_ground_reconstruction {

class OrderedSum;
class Sample;

/// How far some returns are seen in each column: the third farthest of the column, or of one
/// beside it, tells. Not all rings fire in each column.
class FarthestReturns {
 public:
  void clear(std::size_t columns);
  void add(std::size_t column, float planar) { ranges_[column].insert(planar); }
  /// Adds those of a list that count.
  /// \param counts  tells whether a return does; asked about each once, in no known order.
  template <typename Counts>
  void addAll(const std::vector<std::uint32_t>& list, const UprightReturns& returns,
              const Counts& counts);
  /// Planar range [m] per column, 0 where too few are seen; `beside` columns to either side tell.
  void find(std::size_t beside, std::vector<double>* farthest);

 private:
  struct Ranges {
    float first = 0.0F, second = 0.0F, third = 0.0F;

    void insert(float planar) {
      if (!(planar > third)) return;
      const float behind_first = std::min(first, planar);
      const float behind_second = std::min(second, behind_first);
      first = std::max(first, planar);
      second = std::max(second, behind_first);
      third = std::max(third, behind_second);
    }
  };
  /// Do the returns of a column come from near to far, mostly?
  static bool isRising(const std::vector<std::uint32_t>& list, const UprightReturns& returns);

  std::vector<Ranges> ranges_;
  std::vector<double> own_;  // of each column alone
};

template <typename Counts>
void FarthestReturns::addAll(const std::vector<std::uint32_t>& list, const UprightReturns& returns,
                             const Counts& counts) {
  const std::uint16_t* const column = returns.column.data();
  const float* const planar = returns.planar.data();
  Ranges* const ranges = ranges_.data();
  const auto add = [&](std::uint32_t i) {
    if (counts(i)) ranges[column[i]].insert(planar[i]);
  };
  // All but the first three of a column are passed over where these are the farthest.
  if (isRising(list, returns)) {
    std::for_each(list.rbegin(), list.rend(), add);
  } else {
    std::for_each(list.begin(), list.end(), add);
  }
}

/// What one scan shows of its room, in the frame that stands its walls upright. Keeps its buffers.
class Room {
 public:
  static constexpr double kBeyond = 0.15;  ///< floor so far behind the boundary: an opening [m]

  explicit Room(const AzimuthBins& bins);

  /// Takes the returns of a scan (level frame) into an upright frame and finds its posts.
  /// \param level  must stay as they are as long as the room is asked.
  /// \param intensity  on the sensor's own scale.
  /// \param rotation  from the level to the upright frame, row by row.
  void look(const Points& level, const std::vector<float>& intensity, const FloorModel& floor,
            const std::array<double, 9>& rotation, const RoomBoundaryParams& params);
  /// Relief, lines, the profile of the boundary and the drop-offs.
  void findWalls(const ColumnDirections& directions);
  /// The smoke's extinction from the boundary's walls.
  /// \param intensity  as in look().
  Visibility visibility(const std::vector<float>& intensity, VisibilityEstimator* estimator);

  /// Number of returns that stand in posts.
  std::size_t postReturns() const;
  /// Does the plane pass through the feet of walls, not through a floor? A fifth of its returns
  /// stand where a post of their column does, as may be on a floor that few rings meet; but some of
  /// these lie below the plane, where no wall goes on below a floor.
  bool standsOnWalls() const;
  /// Is a return where a post stands in its column or in the two to either side?
  bool isAtPost(std::size_t i) const;

  const RoomBoundaryParams& params() const { return params_; }
  std::size_t size() const { return returns_.size(); }
  const Points& points() const { return *returns_.points; }
  const std::array<double, 9>& rotation() const { return rotation_; }
  const std::array<double, 3>& plane() const { return plane_; }
  /// Height of a place on the plane [m].
  double floorAt(double x, double y) const { return (plane_[0] * x + plane_[1] * y) + plane_[2]; }
  std::size_t column(std::size_t i) const { return returns_.column[i]; }
  const UprightReturns& returns() const { return returns_; }
  float planar(std::size_t i) const { return returns_.planar[i]; }
  float height(std::size_t i) const { return returns_.height[i]; }
  /// Returns on the floor or where its relief carries them, in order.
  const std::vector<std::uint32_t>& low() const { return low_; }
  bool isSoft(std::size_t i) const { return (flags_[i] & ReturnKind::kSoft) != 0; }
  /// Does a low return lie on the line of a wall?
  bool isAtWall(std::size_t i) const { return (flags_[i] & ReturnKind::kAtWall) != 0; }
  /// Is a return's cell as level as the floor?
  bool goesOnLevel(std::size_t i) const;
  /// Is a return's cell one of floor?
  bool isFloorCell(std::size_t i) const;
  /// Returns on the line of their column's boundary, column by column.
  const std::vector<std::uint32_t>& onWalls() const { return on_walls_; }
  /// How far a return lies beyond the line of its column's boundary [m]; negative infinity where
  /// that is no line.
  double pastWall(std::size_t i) const;
  /// What lies nearer than this [m] surely lies before that line by more than walls' feet do.
  float nearestWall(std::size_t column) const;

  const Posts& posts() const { return posts_; }
  const Lines& lines() const { return lines_; }
  const UpwardView& view() const { return view_; }
  const Profile& profile() const { return profile_; }
  const DropOffs& drops() const { return drops_; }
  /// What of the floor is not on its plane; remembers what it was asked.
  FloorRelief& relief() { return relief_; }
  /// How far floor, or a ceiling over it, is seen in each column [m].
  const std::vector<double>& seenFloor() const { return seen_floor_; }
  /// How far floor is measured in each column [m], 0 where too little is.
  const std::vector<double>& ownFloor() const { return own_floor_; }
  /// How far something is seen right above the floor in each column [m], 0 where the boundary tells
  /// enough.
  const std::vector<double>& standingLow() const { return standing_low_; }
  /// How far floor may be claimed in each column though smoke may hide a drop [m].
  const std::vector<double>& certainFloor() const { return certain_floor_; }
  /// How far the floor may stray from its plane per metre away from where it is measured [m]. Smoke
  /// that may hide a drop may as well hide a ramp, which rises by two such sigmas.
  double flatness() const;

 private:
  using Indices = std::vector<std::uint32_t>;

  void takeIn(const Points& level);
  double softGate(const std::vector<float>& intensity) const;
  OrderedSum floorStrength(const std::vector<float>& intensity, const Sample& sample) const;
  void sortOut(const std::vector<float>& intensity);
  const Indices& near() const;
  double steepest();
  void placePosts();
  void findRelief();
  void addCarried();
  void findSeen(const ColumnDirections& directions);
  bool isFoot(std::size_t i) const;
  void addRisers();
  bool findRamp();
  void takeFeetOfWalls();
  void fitRamp();
  void fillLevelCells() const;
  const std::vector<double>& levelFloor();
  void findSeenCeiling();
  void findDrops(const ColumnDirections& directions);
  bool seesBelow() const;
  bool isWithinBoundary(std::size_t i) const;
  void addDropReturn(std::size_t i, bool is_floor);
  void findWallFeet();
  void findCertainFloor();
  void findRising();
  void findStanding();
  bool isLowOnWall(std::size_t i) const;
  bool isLowDown(std::size_t i) const;
  void findWallNormals();
  void findOnWalls();

  const AzimuthBins& bins_;
  RoomBoundaryParams params_;
  double tolerance_ = 0.0;  // a return so near to the plane may be floor [m]
  double lift_ = 0.0;       // or one so near times its range [m2]
  DropTolerances drops_by_;
  double spread_ = 0.0;    // of walls' returns [m]
  double widening_ = 1.0;  // and how much wider it makes the places of walls
  Points turned_;
  UprightReturns returns_;
  std::vector<std::uint8_t> flags_;  // what each return may be
  // Returns, in order: on the floor; below it; of those about its height the ones that tell the
  // relief; as high as the ceiling; what can be wall; what is on the boundary's walls.
  Indices low_, deep_, thinned_, at_ceiling_, maybe_wall_, on_walls_;
  mutable Indices near_;  // about its height, of this scan once something asks for them
  mutable bool has_near_ = false;
  std::vector<std::uint8_t> is_thinned_;
  std::array<double, 9> rotation_ = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> plane_ = {0, 0, 0};
  WallReturns wall_returns_;
  CeilingFinder ceiling_finder_;
  mutable LevelCells level_cells_;  // of this scan once something asks for them
  mutable bool has_level_cells_ = false;
  bool has_level_floor_ = false;
  SpreadFinder spread_finder_;
  PostFinder post_finder_;
  ColumnRanges post_places_;
  Posts posts_;
  FloorRelief relief_;
  LineFinder line_finder_;
  Lines lines_;
  WallSupport support_;
  UpwardView view_;
  WallRampFinder ramp_finder_;
  ProfileFinder profile_finder_;
  Profile profile_;
  FarthestReturns farthest_, farthest_low_;
  DropOffReturns drop_returns_;
  WallFeet wall_feet_;
  DropOffFinder drop_finder_;
  DropOffs drops_;
  WallLight wall_light_;
  CertainFloor certain_finder_;
  std::vector<std::uint32_t> low_wall_;  // returns per column
  std::vector<double> seen_floor_, level_floor_, seen_ceiling_, beyond_, own_floor_, certain_floor_,
      rising_, standing_, standing_low_;
  std::vector<std::array<double, 2>> wall_normals_;
  std::vector<ReliefPlace> on_floor_, wall_places_;  // that may tell how a ramp rises
  std::vector<std::uint32_t> slope_counts_;
  LineWindows windows_;              // of returns at walls
  std::vector<float> nearest_foot_;  // of each column: where the first may begin [m]
};

/// The rotation that levels the floor, which may stand the walls upright in place of the level
/// frame; none where the floor is level. A tilted floor in a plumb building has plumb walls; a
/// tilted sensor sees both tilted alike.
std::optional<std::array<double, 9>> levellingRotation(const std::array<double, 3>& plane);

/// How near to the plane floor lies [m], from the unevenness that the scan tells.
double floorTolerance(const FloorModel& floor);

/// The same times the range [m2], where a range's noise lifts the floor: noise times the sine of
/// the grazing angle, the sensor's height over the range.
double floorLift(const FloorModel& floor);

/// z = a x + b y + c in a frame turned by a rotation.
std::array<double, 3> rotatedPlane(const std::array<double, 3>& plane,
                                   const std::array<double, 9>& rotation);

}  // namespace smoke_ground_reconstruction
