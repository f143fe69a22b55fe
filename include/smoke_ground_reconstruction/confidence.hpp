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
  void look(const Room& room, const std::vector<double>& limit);

  /// Of points of the room's floor, 0..1.
  /// \param column, planar, confidence  arrays of `size` columns, planar ranges and answers.
  void measured(const std::uint16_t* column, const float* planar, std::size_t size,
                float* confidence) const;
  void drawn(const std::uint16_t* column, const float* planar, std::size_t size,
             float* confidence) const;

 private:
  /// The model in one column, of measured or of drawn points: what is left to tell of a point.
  struct Column {
    double constant;                      // logit
    double end, seen, posts, drop_begin;  // planar ranges [m]; infinite where none is
    double rim_100, rim_500, limit_rim;   // weights of the distance to the end
    double past_post, beyond;             // ... behind the posts and the measured floor

    double logit(double range) const;
  };
  /// What is left of it for points nearer than `before` [m], which most are, in single precision.
  struct Plain {
    float constant, end, rim_500, before;
  };
  /// ... and the way beyond measured floor, of which measured points only have some near drops.
  struct Beyond {
    float seen, weight;
  };
  struct Columns {
    std::vector<Column> all;
    std::vector<Plain> plain;
    std::vector<Beyond> beyond;
    bool any_beyond = false;

    void resize(std::size_t count);
    void set(std::size_t c, const Column& column);
  };
  struct Block;

  void findPosts(const Room& room);
  void findBridges(const Profile& profile);
  void findDrops(const DropOffs& drops);
  Column describe(const Room& room, double limit, std::size_t c, double unknown) const;
  Column ofDrawn(const Column& measured, std::size_t c) const;
  static void tell(const Columns& columns, const std::uint16_t* column, const float* planar,
                   std::size_t size, float* confidence);
  template <typename Numbers>
  static Numbers plainLogit(const Numbers& constant, const Numbers& end, const Numbers& rim_500,
                            const Numbers& range);
  static bool tellPlain(const Plain* plain, const std::uint16_t* column, const float* planar,
                        std::size_t count, float* logit);
  static void tellRims(const Columns& columns, const std::uint16_t* column, const float* planar,
                       std::size_t rims, Block* of);

  Columns measured_, drawn_;
  std::vector<double> seen_, own_post_, post_, bridge_, near_drop_;
  bool has_drop_ = false;
};

}  // namespace smoke_ground_reconstruction
