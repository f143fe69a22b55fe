#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/floor_model.hpp"

namespace smoke_ground_reconstruction {

class Sample;

/// Returns of a scan in an upright frame, structure of arrays.
struct UprightReturns {
  const Points* points;
  std::vector<float> planar, height;  ///< planar range and height above the floor [m]
  std::vector<std::uint16_t> column;

  std::size_t size() const { return column.size(); }
};

/// Where in one column the returns within some distance of one line can lie: planar ranges, a hair
/// wide [m]; lowest above highest where none can.
struct RangeWindow {
  float lowest, highest;

  bool isEmpty() const { return lowest > highest; }
};

/// Returns that can be wall: column by column, each column by whole millimetres of planar range,
/// then in the order of the scan.
struct WallReturns {
  const UprightReturns* of = nullptr;       ///< all returns
  std::vector<std::uint32_t> index;         ///< among these
  std::vector<std::uint32_t> column_begin;  ///< of each column, and the end
  /// Column and millimetres in one number, 65536 a column: ranges of two columns lie farther apart
  /// than anything is near, for walls end at kFarthestWall.
  std::vector<std::uint32_t> key;

  std::size_t size() const { return index.size(); }
  /// The first of a column that may lie in a window of planar range.
  std::size_t firstIn(std::size_t of_column, const RangeWindow& window) const;
  /// The keys of the first and the last that may.
  static std::uint32_t firstKeyIn(std::size_t of_column, const RangeWindow& window);
  static std::uint32_t lastKeyIn(std::size_t of_column, const RangeWindow& window);
  /// Takes the `chosen` of some returns, which must stay. O(n).
  void take(const UprightReturns& returns, const std::vector<std::uint32_t>& chosen,
            std::size_t columns);

 private:
  void divide(const std::vector<std::uint32_t>& chosen, std::size_t columns);
  void placeEach(const std::vector<std::uint32_t>& chosen);
  void sort(std::size_t column);
  void rankMany(const std::int16_t* millimetres, std::size_t size);

  std::vector<std::uint32_t> next_, chosen_;  // by column; returns by their column
  std::vector<std::int16_t> millimetres_;     // of these, less 32768
  std::vector<std::uint32_t> rank_, order_;   // of those of one column
};

/// Farther returns are no wall [m].
constexpr float kFarthestWall = 65.0F;

/// Tells how far walls' returns stray, as a range's noise makes them, from the walls themselves.
/// Keeps its buffers.
class SpreadFinder {
 public:
  /// 0.7 to 0.9 sigma [m] of normal noise; 0 where too few columns tell. A column is as wide as the
  /// narrowest half of its returns; a twentieth of the columns see nothing but wall.
  double find(const WallReturns& returns);

 private:
  std::vector<std::uint32_t> widths_;  // by column that tells [mm]
};

/// How many times as wide as usual the places of walls are taken to be, where their returns stray
/// by so much [m].
double wideningFor(double spread);

/// How little behind a line a post is part of its wall [m], where returns stray by so much.
double onLineFor(double spread);

/// Vertical structures in single columns, ordered by column and distance; one entry per post.
struct Posts {
  std::vector<std::uint16_t> column;
  std::vector<std::uint32_t> count;  ///< returns
  std::vector<double> distance;      ///< planar range [m]
  std::vector<double> low, high;     ///< lowest and highest return above the floor [m]
  std::vector<double> x, y;          ///< mean place [m]

  std::size_t size() const { return column.size(); }
  void clear();
};

constexpr double kPostShare = 0.6;  ///< of the returns around that belong to a post
constexpr std::size_t kPostPoints = 4;
constexpr double kPostExtent = 0.12;  ///< least height of a post [m]

/// Finds posts; keeps its buffers.
class PostFinder {
 public:
  /// \param widening  see wideningFor().
  void find(const WallReturns& returns, double widening, Posts* posts);

 private:
  void findDense(const std::vector<std::uint32_t>& key, std::size_t begin, std::size_t end);
  void keepMiddle(const std::vector<std::uint32_t>& key, std::size_t begin, std::size_t end,
                  std::size_t fewest);
  void addPosts(const WallReturns& returns, Posts* posts) const;
  void addPost(const WallReturns& returns, std::size_t begin, std::size_t end, Posts* posts) const;

  std::uint32_t half_ = 0;            // a post's returns lie this near to each other [mm]
  std::uint32_t around_ = 0;          // what lies this near counts as around [mm]
  std::vector<std::uint32_t> dense_;  // of a stretch: places in the order of `returns`
};

/// Finds the ceiling; keeps its buffers.
class CeilingFinder {
 public:
  /// Height above the floor [m]; infinite where none is seen. The strongest slot of heights, each
  /// return weighted by its range (near ones are dense). A column shows a ceiling at several
  /// ranges, but of a wall only one ring hits a level: so a sensor that looks no higher than the
  /// walls sees none. Some thousand returns stand for all, if they show one. O(n).
  double find(const UprightReturns& returns, std::size_t columns);

  static constexpr double kLowest = 1.6;  ///< above the floor [m]

 private:
  double findAmong(const UprightReturns& returns, const Sample& sample, std::size_t columns);
  void collectHigh(const UprightReturns& returns, const Sample& sample);
  bool isWide() const;

  std::vector<float> nearest_, farthest_;  // of the level, by column
  std::vector<float> height_;              // of a sample
  std::vector<std::uint8_t> is_high_;
  std::vector<std::uint32_t> high_;  // returns that are high enough to be ceiling
  std::vector<int> slot_;            // of each of these
};

}  // namespace smoke_ground_reconstruction
