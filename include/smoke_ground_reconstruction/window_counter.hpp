#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/neighbor_counter.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"

namespace smoke_ground_reconstruction {

/// Exact neighbour counts without a tree. A radius proportional to range is a fixed angle: whatever
/// lies within k * r of a point at range r lies within asin(k) of its direction. Points are
/// bucketed by (range, elevation, azimuth); a query looks through the buckets that its ball can
/// touch, nearest first. Candidates are screened in single precision against a radius a hair
/// smaller and one a hair larger; only where the two disagree squaredDistance() is asked. Exact for
/// any radius: a query whose window passes a pole, or whose radius reaches the sensor, takes all
/// azimuths or all directions.
class WindowCounter : public NeighborCounter {
 public:
  /// Places [begin, end) in the order of the buckets.
  struct Run {
    std::uint32_t begin;
    std::uint32_t end;
  };

  /// \param radius_per_range  the k that sizes the buckets; queries of any other radius stay exact.
  WindowCounter(const Scan& scan, double radius_per_range);

  /// \param index  of a valid point.
  std::size_t count(std::size_t index, double squared_radius, std::size_t limit) const override;
  bool isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                 std::size_t at_most) const override;
  void findOutsiders(const std::vector<std::uint32_t>& points, const Crowd& crowd,
                     std::vector<std::uint32_t>* outsiders) const override;

 private:
  struct Spot;
  struct Queries;
  enum class Answer : std::uint8_t { kInside, kAsked, kOutside };  // the crowd
  /// Rows, and columns to either side, that a window reaches; half of all columns: every one.
  struct Reach {
    int first_row;
    int last_row;
    float columns;
  };
  void chooseBuckets();
  void fillBuckets();
  void sortPoints(const std::vector<std::uint32_t>& bucket);
  const std::uint32_t* rowBegin(int shell, int row) const;
  Spot spotOf(std::size_t index) const;
  double radiusPerRange(std::size_t index, double squared_radius) const;
  Reach reachOf(double lowest_sine, double highest_sine, double radius_per_range) const;
  Reach reachOf(const Spot& spot, double radius_per_range) const;

  void collectRuns(std::size_t index, double radius_per_range, std::vector<Run>* runs) const;
  void collectShell(int shell, int row, float column, const Reach& reach,
                    std::vector<Run>* runs) const;
  void collectRow(int shell, int row, float column, float columns, std::vector<Run>* runs) const;
  void collectRuns(const Queries& queries, const Reach& reach, double radius_per_range,
                   std::vector<Run>* runs) const;
  int shellAt(float squared_range, double times) const;
  std::size_t countRuns(std::size_t index, double squared_radius, const std::vector<Run>& runs,
                        std::size_t limit) const;
  bool isBetween(std::size_t index, double squared_radius, std::size_t more_than,
                 std::size_t at_most, const std::vector<Run>& runs) const;
  template <typename Part>
  void forEachPart(float column, float to_the_side, const Part& part) const;
  void answerBeside(const Crowd& crowd, std::vector<Answer>* answers) const;
  void answerAsked(const Crowd& crowd, std::vector<Answer>* answers) const;
  void listAsked(const std::vector<Answer>& answers, std::vector<std::uint32_t>* asked) const;
  const std::uint32_t* answerRow(int shell, int row, const Reach& reach, const Crowd& crowd,
                                 const std::uint32_t* asked, std::vector<Answer>* answers) const;
  void answer(const Reach& reach, const Crowd& crowd, std::vector<Run>* runs, Queries* queries,
              std::vector<Answer>* answers) const;

  double radius_per_range_;
  int rows_ = 0;
  int columns_ = 0;
  int shells_ = 1;
  Recycled<Reach> reaches_;               // for radius_per_range_, by parts of a row
  Recycled<std::uint32_t> bucket_begin_;  // shell by shell, row by row
  Recycled<std::uint32_t> place_;         // of each valid point in the buckets
  Recycled<float> x_, y_, z_;             // bucket by bucket, nothing at both ends
};

}  // namespace smoke_ground_reconstruction
