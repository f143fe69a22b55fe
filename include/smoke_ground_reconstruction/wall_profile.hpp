#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "smoke_ground_reconstruction/floor_surface.hpp"
#include "smoke_ground_reconstruction/wall_lines.hpp"

namespace smoke_ground_reconstruction {

/// The boundary of each column.
struct Profile {
  std::vector<double> distance;    ///< planar range [m]; 0 where none is known
  std::vector<BoundaryKind> kind;  ///< limit of knowledge where none is known
  std::vector<std::int32_t> line;  ///< index of the wall; -1 where none

  std::size_t columns() const { return distance.size(); }
};

/// Finds the boundary from posts and walls: the nearest wall that reaches the ceiling bounds the
/// floor (furniture does not), gaps are bridged along walls seen on both sides and up to the corner
/// where two of them meet. Keeps its buffers.
class ProfileFinder {
 public:
  using LevelFloor = std::function<const std::vector<double>&()>;

  /// \param beyond  per column: how far floor or ceiling was measured [m]; no wall stands nearer,
  ///                unless it is seen.
  /// \param level_floor  per column: how far floor was measured that goes on as level as the
  ///                     room's [m]. Asked for only where a wall may have an opening.
  /// \param max_bridge_ratio  a wall is drawn on to a corner at most so many times its seen length.
  /// \param spread  how far walls' returns stray, see SpreadFinder [m].
  void find(const Posts& posts, const WallSupport& support, const UpwardView& view,
            const std::vector<double>& beyond, const LevelFloor& level_floor,
            const ColumnDirections& directions, double max_bridge_ratio, double spread,
            Profile* profile);

 private:
  /// What a gap between two known columns would be bridged with.
  struct Bridge {
    std::size_t first, after;  // known columns
    const double* a;           // reach of the first one's wall
    const double* b;           // and of the other's
    double ratio;              // to its seen length, by which each may be drawn on to a corner
  };

  void takeNearestWalls(const WallSupport& support, Profile* profile) const;
  void addFullPosts(const Posts& posts, const UpwardView& view, Profile* profile);
  void findOutermost(const Posts& posts, const WallSupport& support);
  void follow(Profile* profile);
  bool findChain(const Profile& profile, std::size_t first, std::size_t after, std::size_t length);
  void takeOutermost(const WallSupport& support, const ColumnDirections& directions,
                     Profile* profile);
  void takeLines(const WallSupport& support, const ColumnDirections& directions, Profile* profile);
  void closeOpenings(const WallSupport& support, const UpwardView& view,
                     const LevelFloor& level_floor, Profile* profile);
  void closeOpening(const double* reach, const UpwardView& view, const LevelFloor& level_floor,
                    std::int32_t line, Profile* profile);
  void bridge(const WallSupport& support, const ColumnDirections& directions, Profile* profile);
  void collectGap(const Bridge& bridge, const Profile& profile);
  bool isBridged(const Bridge& bridge, const ColumnDirections& directions,
                 const Profile& profile) const;
  bool isCorner(const Bridge& bridge, const ColumnDirections& directions,
                const Profile& profile) const;
  bool isTorn(const Bridge& bridge) const;
  bool passesWall(const Bridge& bridge) const;

  /// A place of a chain of posts: columns from its begin, and planar range [m].
  struct Link {
    std::size_t place;
    double planar;
  };

  double max_bridge_ratio_ = 0.0, widening_ = 1.0, on_line_ = 0.0;
  std::vector<Link> chain_;
  std::vector<double> beyond_, nearest_, outermost_, candidate_;
  std::vector<double> tall_;  // where what is no furniture begins in each column [m]
  std::vector<std::uint8_t> is_rest_, is_on_;
  std::vector<std::size_t> known_, gap_;
  ColumnRuns runs_;
};

}  // namespace smoke_ground_reconstruction
