// The three nodelets in one process of their own, without a manager:
//   rosrun smoke_ground_reconstruction standalone cloud:=/lidar_points
// Topics and parameters are those of launch/ground_reconstruction.launch: the node's name, by
// default ground_reconstruction, is the namespace, so the floor is at
// /ground_reconstruction/reconstructor/ground_surface.
#include <nodelet/loader.h>
#include <ros/ros.h>

#include <map>
#include <string>

namespace {

using Remappings = std::map<std::string, std::string>;

bool load(nodelet::Loader& loader, const std::string& ns, const std::string& stage,
          const std::string& type, const Remappings& inputs) {
  const std::string name = ns + "/" + stage;
  Remappings remappings;
  for (const auto& [input, topic] : inputs) remappings[name + "/" + input] = topic;
  const bool is_loaded = loader.load(name, "smoke_ground_reconstruction/" + type, remappings, {});
  if (!is_loaded) ROS_FATAL("Cannot load nodelet %s", type.c_str());
  return is_loaded;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "ground_reconstruction");
  const std::string ns = ros::this_node::getName();
  const std::string cloud = ros::names::resolve("cloud");
  nodelet::Loader loader(false);
  const bool is_loaded =
      load(loader, ns, "denoiser", "Denoiser", {{"input", cloud}}) &&
      load(loader, ns, "segmenter", "Segmenter", {{"input", ns + "/denoiser/denoised"}}) &&
      load(loader, ns, "reconstructor", "Reconstructor",
           {{"input", cloud},
            {"ground", ns + "/segmenter/ground"},
            {"walls", ns + "/segmenter/walls"}});
  if (!is_loaded) return 1;
  ros::spin();
  return 0;
}
