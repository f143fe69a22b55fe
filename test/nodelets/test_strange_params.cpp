#include <gtest/gtest.h>
#include <ros/ros.h>

#include <string>
#include <vector>

#include "smoke_ground_reconstruction/ros/strange_params.hpp"

namespace smoke_ground_reconstruction {
namespace {

TEST(StrangeParams, AreThoseThatNobodyReads) {
  const ros::NodeHandle nh("/stages/first");
  nh.setParam("alpha", 0.5);
  nh.setParam("queue_size", 3);
  nh.setParam("sensor_beams/rings", std::vector<double>{1.0});
  EXPECT_TRUE(strangeParams(nh, {"alpha"}).empty());

  nh.setParam("alhpa", 0.5);
  nh.setParam("group/alpha", 0.5);
  nh.setParam("group/beta", 0.5);
  ros::NodeHandle("/stages/first_of_others").setParam("gamma", 0.5);
  EXPECT_EQ(strangeParams(nh, {"alpha"}), (std::vector<std::string>{"alhpa", "group"}));
}

}  // namespace
}  // namespace smoke_ground_reconstruction
