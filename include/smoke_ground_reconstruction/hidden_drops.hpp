#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/drop_offs.hpp"

namespace smoke_ground_reconstruction {

/// How far there is floor for certain where smoke may hide a drop.
///
/// A drop is told by what lies below the floor. In smoke so thick that the floor itself is seen but
/// a few sensor heights away, that is hidden as well. A wall that is seen low down shows that beams
/// get there, and would have met what lies lower. Where the boundary breaks off, or a drop does,
/// floor goes on up to such a wall; before it floor is certain no farther than it is measured.
/// Keeps its buffers. Not in the thesis.
class CertainFloor {
 public:
  /// Can a drop be hidden at all? Is to be asked before find().
  /// \param floor  per column: how far floor is measured in it alone [m]; 0 where it is not.
  /// \param distance  per column: planar range of the boundary [m]; 0 where none is known.
  bool isInDoubt(const std::vector<double>& floor, const std::vector<double>& distance,
                 const DropOffs& drops, double sensor_height);
  /// \param floor, distance, drops  as before.
  /// \param low_wall  per column: returns of the boundary's walls from low down.
  /// \param certain  per column: how far floor may be claimed [m]; infinite where nothing speaks
  ///                 against it.
  void find(const std::vector<double>& floor, const std::vector<double>& distance,
            const DropOffs& drops, const std::vector<std::uint32_t>& low_wall,
            std::vector<double>* certain);

 private:
  void markBeside(const std::vector<std::uint32_t>& low_wall);

  std::vector<std::uint8_t> is_open_, is_doubted_;
  std::vector<double> reach_;
};

}  // namespace smoke_ground_reconstruction
