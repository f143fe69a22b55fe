#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/posts.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

/// Equal azimuth columns: the directions of their middles and of their first edges.
struct ColumnDirections {
  std::vector<Direction> middle, edge;

  explicit ColumnDirections(std::size_t count);
  std::size_t count() const { return middle.size(); }
};

/// A straight wall in plan: nx x + ny y = rho [m].
struct Line {
  double nx, ny, rho;

  double distance(double x, double y) const { return std::fabs((nx * x + ny * y) - rho); }
};

/// Straight walls in plan with rho >= 0.
struct Lines {
  std::vector<double> nx, ny, rho;

  std::size_t size() const { return rho.size(); }
  void clear();
  Line operator[](std::size_t line) const { return {nx[line], ny[line], rho[line]}; }
  double distance(std::size_t line, double x, double y) const {
    return (*this)[line].distance(x, y);
  }
  /// Planar ranges of a line in some directions [m]; infinite where it is not ahead.
  void reach(std::size_t line, const std::vector<Direction>& directions, double* reach) const;
};

class WallSupport;

/// Where in each column the returns within some distance of lines can lie. Keeps its buffers.
class LineWindows {
 public:
  /// \param sure  a distance, no larger than `half`, of which surelyIn() tells.
  void find(const Lines& lines, const ColumnDirections& directions, double half, double sure);
  RangeWindow of(std::size_t line, std::size_t column) const {
    return {lowest_[line * columns_ + column], highest_[line * columns_ + column]};
  }
  /// The part of a window in which all of a column's returns lie within the sure distance.
  RangeWindow surelyIn(const RangeWindow& window, std::size_t line) const {
    return {window.highest * sure_[line].lowest, window.lowest * sure_[line].highest};
  }
  /// Where the nearest window of each column begins [m], of lines that are seen in some column near
  /// by; infinite where there is none.
  void findNearest(const WallSupport& support, std::vector<float>* nearest) const;

 private:
  void findOf(const Lines& lines, std::size_t line, const ColumnDirections& directions,
              double half);

  std::size_t columns_ = 0;
  std::vector<float> lowest_, highest_;  // by line and column
  std::vector<RangeWindow> sure_;        // by line, in parts of a window's other end
  std::vector<double> ahead_;            // cosines between a line's normal and the columns' edges
};

constexpr double kLineHalf = 0.03;  ///< a wall's returns lie this near to its line, usually [m]

/// Finds straight walls through posts, the best supported first: a Hough transform proposes,
/// reweighted total least squares refines; a wall's posts are taken out before the next is looked
/// for. Votes are counted again only under angles that may have had more than the best has. Keeps
/// its buffers.
class LineFinder {
 public:
  LineFinder();
  /// \param widening  see wideningFor().
  void find(const Posts& posts, double widening, Lines* lines);

 private:
  static constexpr std::size_t kAngles = 180;
  struct Peak {
    std::size_t angle;
    double rho;
    int weight;
  };
  /// By angle: the most votes that two slots side by side have, or had before posts were taken out,
  /// and where they do if that is up to date.
  struct Bests {
    std::array<int, kAngles> most;
    std::array<std::size_t, kAngles> slot;
    std::array<bool, kAngles> is_new;
  };
  enum class Use : std::uint8_t { kNone, kSkipped, kYes };

  void start(const Posts& posts);
  void boundVotes(double farthest);
  void gatherUsed(const Posts& posts);
  Peak strongest();
  void search(std::size_t angle);
  void takeOut(Use use);
  void giveBackSkipped();
  Line refined(const Peak& peak);
  void collectNear(const Line& line, double half);
  bool isWall(const Posts& posts, const Line& line);

  std::array<Direction, kAngles> normals_;
  double widening_ = 1.0;
  int first_slot_ = 0;
  std::vector<std::uint16_t> votes_;  // of one angle, by slot; 5000 posts would fill two
  Bests bests_, unskipped_;           // the latter of when no post was skipped last
  std::vector<Use> use_;              // by post
  bool are_skipped_ = false;
  std::vector<std::uint32_t> used_;  // posts in use; what follows is of these
  std::vector<double> x_, y_;
  std::vector<std::uint16_t> weight_, slot_;
  std::vector<std::uint8_t> is_near_;
  std::vector<std::uint32_t> near_;  // places of those near to a line
  std::vector<double> along_;
};

/// How far up things can be seen.
struct UpwardView {
  double ceiling = 0.0;           ///< above the floor [m]; infinite where none is seen
  double sensor_height = 0.0;     ///< [m]
  double steepest = 0.0;          ///< tangent of the highest beam's elevation
  double furniture_height = 0.0;  ///< walls are told where the view is higher [m]

  /// Does something of a height at a planar range reach the ceiling, or out of the view?
  bool isFull(double high, double planar) const;
  /// Can a wall at a planar range be told from a cupboard?
  bool tells(double planar) const;
};

/// Stretches of columns, round the circle, that breaks of four columns and more divide.
class ColumnRuns {
 public:
  /// \param is_in  a flag per column.
  void find(const std::uint8_t* is_in, std::size_t columns);
  std::size_t count() const { return end_.size(); }
  const std::uint32_t* begin(std::size_t run) const {
    return columns_.data() + (run == 0 ? 0 : end_[run - 1]);
  }
  const std::uint32_t* end(std::size_t run) const { return columns_.data() + end_[run]; }

  static constexpr std::uint32_t kBreak = 4;

 private:
  std::vector<std::uint32_t> columns_;
  std::vector<std::size_t> end_;
};

/// What each column shows of each wall, by wall and column.
class WallSupport {
 public:
  /// \param returns  sorted.
  /// \param widening  see wideningFor().
  void find(const WallReturns& returns, const Lines& lines, const ColumnDirections& directions,
            const UpwardView& view, double widening);

  std::size_t lines() const { return lines_; }
  std::size_t columns() const { return columns_; }
  const std::uint8_t* seen(std::size_t line) const { return seen_.data() + line * columns_; }
  /// Is a wall seen in a column or in some to either side?
  const std::uint8_t* seenNear(std::size_t line) const { return near_.data() + line * columns_; }
  bool isSeenNear(std::size_t line, std::size_t column) const {
    return seenNear(line)[column] != 0;
  }
  /// ... and up to the ceiling, or as high as the sensor sees.
  const std::uint8_t* full(std::size_t line) const { return full_.data() + line * columns_; }
  /// Does a wall reach the ceiling, or as high as the sensor sees, anywhere?
  bool isTall(std::size_t line) const { return tall_[line] != 0; }
  /// Planar range of the wall at the column's middle [m].
  const double* reach(std::size_t line) const { return reach_.data() + line * columns_; }
  /// Between the normals of two walls.
  double cosine(std::size_t a, std::size_t b) const { return nx_[a] * nx_[b] + ny_[a] * ny_[b]; }

 private:
  void countReturns(const WallReturns& returns, const Line& line, std::size_t number);
  void judge(std::size_t line);
  void markNear(std::size_t line);
  void markFull(std::size_t line, const UpwardView& view);
  void markTall(std::size_t line, const UpwardView& view);

  std::size_t lines_ = 0, columns_ = 0;
  double half_ = kLineHalf;  // a wall's returns lie this near to its line [m]
  LineWindows windows_;
  std::vector<std::uint8_t> seen_, near_, full_, tall_;
  std::vector<std::uint8_t> wide_;  // of one line, and beyond either end of the columns
  std::vector<double> reach_, nx_, ny_;
  std::vector<std::uint32_t> own_, around_;  // of one line, by column
  std::vector<float> low_, high_, highest_;  // the last over neighbours
  ColumnRuns runs_;
};

}  // namespace smoke_ground_reconstruction
