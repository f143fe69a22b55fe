#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "smoke_ground_reconstruction/column_ranges.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/wall_feet.hpp"

namespace smoke_ground_reconstruction {

/// Per column, planar ranges [m]: the floor between `begin` and `end` is not to be claimed.
struct DropOffs {
  std::vector<double> begin;     ///< infinite where no drop is seen
  std::vector<double> end;       ///< infinite where no floor is measured beyond, or no drop seen
  std::vector<double> floor_to;  ///< how far there is floor because an edge ends it; 0: none does
  /// Past the end of an edge in doubt, where another one that may stand for it is drawn on but
  /// tells of no floor: the drop may as well go on sideways.
  std::vector<std::uint8_t> is_doubted;

  /// Does a place lie over a drop, or beyond one without floor measured again?
  bool hides(std::size_t column, double planar) const {
    return planar > begin[column] && planar < end[column];
  }
};

/// What may be floor, and how well returns tell where it ends.
struct DropTolerances {
  static constexpr double kDepthSlope = 0.005;  ///< and per metre: a plane off by 0.3 deg

  double depth = 0.04;  ///< a return so far below the floor beneath the sensor is none of it [m]
  double lift = 0.0;    ///< ... if noise does not lower it, by so much times the range [m2]
  double edge = 0.02;   ///< measured floor ends this far before the edge for certain [m]
  double place = 0.03;  ///< of a return's place against an edge [m]

  /// Measured floor lies behind an edge if it is so far behind it [m].
  double clear() const { return edge + place; }
  /// Edges of a noisy sensor, see wideningFor().
  void widen(double widening) {
    edge *= widening;
    place *= widening;
  }
  bool isBelow(double planar, double height, double sensor_height) const {
    const double deep = -height - kDepthSlope * planar;
    const double down = sensor_height - height;
    return deep > depth && deep * deep * (planar * planar + down * down) > lift * lift;
  }
};

/// Returns among which drops are looked for, structure of arrays.
struct DropOffReturns {
  std::vector<std::uint16_t> column;
  std::vector<float> planar, height;   ///< planar range and height above the floor [m]
  std::vector<std::uint8_t> is_floor;  ///< measured floor; feet of walls must not be among it

  void clear() {
    column.clear();
    planar.clear();
    height.clear();
    is_floor.clear();
  }
};

/// A straight edge: its normal away from the sensor, its distance [m], the columns it spans.
struct DropEdge {
  double nx = 0.0, ny = 0.0, rho = 0.0;
  bool is_aligned = false;  ///< along or across a wall
  bool is_sure = false;     ///< ... beyond doubt
  /// Along or across a wall, as others are that may stand for it?
  bool isInDoubt() const { return is_aligned && !is_sure; }
  std::size_t first = 0, count = 0;
  double drop = 0.0;  ///< distance at which the drop begins for certain [m]

  /// Cosine between a direction and the normal.
  double across(const Direction& to) const { return nx * to.cosine + ny * to.sine; }
  /// Place along the edge where it meets a direction [m].
  double along(const Direction& to) const {
    return rho * (nx * to.sine - ny * to.cosine) / across(to);
  }
};

/// What is seen of drops in each column.
struct DropColumns {
  std::vector<double> before;      ///< last floor before the drop [m], 0 where there is none
  std::vector<double> after;       ///< nearest crossing of a beam that fell through [m]
  std::vector<std::uint8_t> sees;  ///< is a drop seen?
};

/// Finds straight edges: lines that in many columns lie between the last measured floor and the
/// first beam that fell through it. Keeps its buffers.
class DropEdgeFinder {
 public:
  DropEdgeFinder();
  /// \param walls  normals of the room's walls: edges along or across them are preferred.
  /// \param place  tolerance of a return's place [m].
  void find(const DropColumns& columns, const std::vector<Direction>& middle,
            const std::vector<std::array<double, 2>>& walls, double place,
            std::vector<DropEdge>* edges);

 private:
  struct Candidate {
    double nx = 0.0, ny = 0.0, rho = 0.0;
    int columns = -1;
    double score = -1.0;
  };
  struct Column {
    double before, after;
    Direction middle;
  };

  void findLikely(const std::vector<std::array<double, 2>>& walls);
  void addLikely(const Candidate& line, bool is_aligned);
  Candidate freelyTurned();
  Candidate candidate(double nx, double ny);
  Candidate mostAgreed(double nx, double ny, int first, int last);
  void markExplained(const DropColumns& columns, const std::vector<Direction>& middle,
                     DropEdge* edge);
  bool longestRun(DropEdge* edge);

  double place_ = 0.0;
  std::vector<Direction> normals_;          // of the coarse search
  std::vector<std::uint8_t> left_, still_;  // columns that no edge explains, before and now
  std::vector<DropEdge> likely_;
  std::vector<std::size_t> explained_, against_;  // columns; how many before each speak against
  std::vector<std::uint8_t> joins_;
  std::vector<Column> use_;
  std::vector<Candidate> aligned_;
  std::vector<int> change_;  // of how many agree, by slot of distance; zeros between calls
};

/// Finds where the floor ends at drops. Keeps its buffers.
///
/// A return from below the floor proves that its beam met no floor where it crossed the floor's
/// plane. The floor ends before the first such crossing of a column, or at a straight edge, and
/// goes on only where it is measured again beyond the last. Not in the thesis.
class DropOffFinder {
 public:
  /// \param sensor_height  of the sensor above the floor [m].
  /// \param middle  directions of the columns' middles.
  /// \param walls  normals of the room's walls; only edges along or across them tell of floor that
  ///     was not measured.
  /// \param feet  of the walls: where nothing is seen below them, no drop reaches them.
  void find(const DropOffReturns& returns, double sensor_height,
            const std::vector<Direction>& middle, const std::vector<std::array<double, 2>>& walls,
            const WallFeet& feet, const DropTolerances& by, DropOffs* drops);

 private:
  void collect(const DropOffReturns& returns, double sensor_height, std::size_t columns);
  bool isMirrored(std::size_t column, double crossing) const;
  bool findWitnessed(bool twice);
  void joinNeighbors();
  void endSingleColumns(DropOffs* drops);
  void findColumns();
  void findEdges(const std::vector<Direction>& middle,
                 const std::vector<std::array<double, 2>>& walls);
  void followEdges(const std::vector<Direction>& middle, DropOffs* drops);
  void drawOn(const DropEdge& edge, const std::vector<Direction>& middle);
  ColumnRanges::Beyond floorBehind(const DropEdge& edge, std::size_t column,
                                   const std::vector<Direction>& middle) const;
  double place(const DropEdge& edge, const std::vector<Direction>& middle, DropOffs* drops);
  void tell(const DropEdge& edge, double rho, const std::vector<Direction>& middle,
            DropOffs* drops) const;
  void tellOne(const DropEdge& edge, double rho, std::size_t column, const Direction& to,
               DropOffs* drops) const;
  void doubtPastEnds(std::size_t columns, DropOffs* drops) const;
  void spread(const std::vector<std::uint8_t>& starts, std::size_t widest, DropOffs* drops) const;
  double lastAround(std::size_t column, std::size_t beside, double distance) const;

  DropTolerances by_;
  ColumnRanges floor_, crossings_;
  std::vector<double> first_, last_;  // crossings by column, also of those between
  std::vector<double> again_;
  std::vector<std::size_t> below_;      // returns
  std::vector<std::size_t> seen_, at_;  // columns
  DropColumns columns_;
  DropEdgeFinder edge_finder_;
  std::vector<DropEdge> edges_, sure_edges_;
  std::vector<double> sealed_, steady_;  // how far no drop reaches the wall
  std::vector<double> place_, no_room_;  // where drops are seen, how far none fits before the wall
  FloorSealer sealer_;
  std::vector<std::uint8_t> is_open_;
  std::vector<std::uint8_t> is_taken_, is_explained_;
  std::vector<std::uint8_t> is_alone_, is_known_, is_end_;
  std::array<std::vector<std::size_t>, 2> drawn_;  // columns beyond either end of an edge
  std::vector<std::uint8_t> is_drawn_in_doubt_;
  struct PastEnd {
    std::size_t last, step;
  };
  std::vector<PastEnd> past_ends_;  // last columns of edges in doubt, and the ways on
};

}  // namespace smoke_ground_reconstruction
