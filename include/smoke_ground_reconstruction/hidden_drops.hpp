#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/drop_offs.hpp"

namespace smoke_ground_reconstruction {

/// How far there is floor for certain where smoke may hide a drop.
///
/// A drop is told by what lies below the floor, a wall behind it by its returns. Where the boundary
/// breaks off, neither was seen, and a ceiling overhead tells nothing of what lies beneath: floor
/// is certain no farther than it is measured. So it is beside a gap or a drop, up to a wall that is
/// seen low down: beams get there, and would have met what lies lower. So they would before
/// furniture seen low down: what stands stands on a floor. A gap in which the floor is measured to
/// rise is a ramp, which leads to something. Keeps its buffers. Not in the thesis.
class CertainFloor {
 public:
  /// Can a drop be hidden at all? If not, find() finds nothing in doubt.
  /// \param distance  per column: planar range of the boundary [m]; 0 where none is known.
  static bool isInDoubt(const std::vector<double>& distance, const DropOffs& drops);
  /// \param floor  per column: how far floor is measured in it alone [m]; 0 where it is not.
  /// \param distance, drops  as before.
  /// \param low_wall  per column: returns of the boundary's walls from low down.
  /// \param stands  per column: how far returns from low down are seen [m]; 0 where they are not.
  /// \param rises  per column: how far floor is measured that rises over the plane [m]; 0 where
  ///               none is.
  /// \param certain  per column: how far floor may be claimed [m]; infinite where nothing speaks
  ///                 against it.
  void find(const std::vector<double>& floor, const std::vector<double>& distance,
            const DropOffs& drops, const std::vector<std::uint32_t>& low_wall,
            const std::vector<double>& stands, const std::vector<double>& rises,
            std::vector<double>* certain);

 private:
  void markGaps(const std::vector<double>& distance, const std::vector<double>& rises);
  void markGap(std::size_t first, std::size_t length, const std::vector<double>& rises);
  void markBeside(const std::vector<std::uint32_t>& low_wall, const std::vector<double>& stands);

  std::vector<std::uint8_t> is_gap_, is_open_, is_doubted_;
  std::vector<double> measured_;  // floor, shared with the columns beside [m]
};

}  // namespace smoke_ground_reconstruction
