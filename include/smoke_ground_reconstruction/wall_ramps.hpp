#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "smoke_ground_reconstruction/floor_relief.hpp"
#include "smoke_ground_reconstruction/wall_lines.hpp"

namespace smoke_ground_reconstruction {

/// A ramp that the feet of walls show where smoke hides its floor. It stops the beams that would
/// meet a wall below it: the wall's lowest returns rise along it as the ramp does, from the floor's
/// plane on. Keeps its buffers. Not in the thesis.
class WallRampFinder {
 public:
  void clear(std::size_t lines);
  /// A return at a wall: its line's number, its place along it, which is nx y - ny x, and its
  /// height over the plane [m].
  void add(std::size_t line, double along, double height);
  /// The longest ramp along a wall, if one is seen. Called once after the returns were added.
  std::optional<WallRamp> find(const Lines& lines, double max_slope);
  /// The lowest returns of all walls, one wall after the other.
  void listFeet(const Lines& lines, std::vector<ReliefPlace>* feet);

 private:
  /// The lowest return of a bin.
  struct Foot {
    double height, along;
  };

  void takeFeetOf(std::size_t line);
  void findLowerHull();
  static std::size_t sumOver(const Foot& first, const Foot& last, double slope, double* sum);

  std::vector<Foot> bins_;         // by line and place along it; infinitely high where empty
  std::vector<Foot> feet_;         // of one wall, by place
  std::vector<std::size_t> hull_;  // of one wall, by number of its feet
};

}  // namespace smoke_ground_reconstruction
