#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace smoke_ground_reconstruction {

/// Returns that can be wall, column by column, each column by planar range; structure of arrays in
/// an upright frame. sort() brings them into that order.
struct WallReturns {
  std::vector<float> planar, height, x, y;  ///< [m]
  std::vector<std::uint16_t> column;
  std::vector<std::uint32_t> column_begin;  ///< after sort(): of each column, and the end

  std::size_t size() const { return column.size(); }
  void clear();
  void push(std::uint16_t of_column, float range, float above_floor, float at_x, float at_y);
  /// By column, then whole millimetres of planar range, then order of push. O(n).
  void sort(std::size_t columns);

  /// Column and millimetres in one number, 200000 a column.
  std::vector<std::uint32_t> key;

 private:
  struct Item {
    std::uint32_t key, index;
  };
  void reorder();

  std::vector<Item> items_, sorted_;
  std::vector<float> moved_;
};

/// Farther returns are no wall [m].
constexpr float kFarthestWall = 65.0F;

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
  /// \param returns  sorted.
  void find(const WallReturns& returns, Posts* posts);

 private:
  void markDense(const std::vector<std::uint32_t>& key);
  void addPost(const WallReturns& returns, std::size_t begin, std::size_t end, Posts* posts) const;

  std::vector<std::uint32_t> dense_;  // places in the order of `returns`
};

/// Finds the ceiling; keeps its buffers.
class CeilingFinder {
 public:
  /// Height above the floor [m]; infinite where none is seen. The strongest slot of heights, each
  /// return weighted by its range (near ones are dense). A column shows a ceiling at several
  /// ranges, but of a wall only one ring hits a level: so a sensor that looks no higher than the
  /// walls sees none. O(n).
  /// \param height, planar, column  of each return.
  double find(const std::vector<float>& height, const std::vector<float>& planar,
              const std::vector<std::uint16_t>& column, std::size_t columns);

 private:
  bool isWide() const;

  std::vector<float> nearest_, farthest_;  // of the level, by column
};

}  // namespace smoke_ground_reconstruction
