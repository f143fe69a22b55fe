#pragma once

#include <ros/node_handle.h>

#include <string>
#include <vector>

namespace smoke_ground_reconstruction {

/// Private parameters that nobody reads: misspelt ones, and those of another stage.
/// \param nh  private handle of a stage.
/// \param tunable  names of its tunable parameters; those that stages read once are known.
std::vector<std::string> strangeParams(const ros::NodeHandle& nh,
                                       const std::vector<std::string>& tunable);

}  // namespace smoke_ground_reconstruction
