#include "smoke_ground_reconstruction/ros/strange_params.hpp"

#include <set>

namespace smoke_ground_reconstruction {

std::vector<std::string> strangeParams(const ros::NodeHandle& nh,
                                       const std::vector<std::string>& tunable) {
  std::set<std::string> known = {"always_on",  "base_frame",      "base_height", "queue_size",
                                 "tf_timeout", "forward_yaw_deg", "sensor_beams"};
  known.insert(tunable.begin(), tunable.end());
  const std::string prefix = nh.getNamespace() + "/";
  std::vector<std::string> names;
  nh.getParamNames(names);
  std::set<std::string> strange;
  for (const std::string& name : names) {
    if (name.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string own =
        name.substr(prefix.size(), name.find('/', prefix.size()) - prefix.size());
    if (known.count(own) == 0) strange.insert(own);
  }
  return {strange.begin(), strange.end()};
}

}  // namespace smoke_ground_reconstruction
