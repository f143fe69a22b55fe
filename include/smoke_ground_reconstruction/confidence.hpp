#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/room.hpp"

namespace smoke_ground_reconstruction {

/// How sure each point of the floor is: the probability that there is floor in its cell.
///
/// A logistic model of what the scan shows around a point. Its weights stand in
/// config/confidence.yaml, where `smoke_ground calibrate` writes them; they are compiled in. Not in
/// the thesis. Keeps its buffers.
class FloorConfidence {
 public:
  /// What each column of a room shows.
  /// \param limit  how far floor is claimed in each column [m].
  /// \param measured  returns of the room that are floor.
  void look(const Room& room, const std::vector<double>& limit,
            const std::vector<std::uint32_t>& measured);

  /// Of a point of the room's floor, 0..1.
  float measured(std::size_t column, double planar) const { return of(column, planar, false); }
  float drawn(std::size_t column, double planar) const { return of(column, planar, true); }

 private:
  /// The model in one column: weights of what is left to tell of a point.
  struct Column {
    double constant, drawn;                  // logits
    double end, seen, posts, drop_begin;     // planar ranges [m]; posts are NaN where none is
    double rim_100, rim_500, limit_rim;      // weights of the distance to the end
    double past_post, beyond, beyond_drawn;  // ... behind the posts and the measured floor
  };

  float of(std::size_t column, double planar, bool is_drawn) const;
  void findSeen(const Room& room, const std::vector<std::uint32_t>& measured);
  void findPosts(const Room& room);
  void findBridges(const Profile& profile);
  void findDrops(const DropOffs& drops);
  Column describe(const Room& room, double limit, std::size_t c, double unknown) const;

  std::vector<Column> columns_;
  FarthestReturns farthest_;
  std::vector<double> seen_, own_post_, post_, bridge_, near_drop_;
  bool has_drop_ = false;
};

}  // namespace smoke_ground_reconstruction
