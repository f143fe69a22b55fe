#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>

#include <boost/weak_ptr.hpp>
#include <set>
#include <vector>

#include "smoke_ground_reconstruction/ros/message_pool.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointCloud2ConstPtr;

TEST(MessagePool, HandsOutNothingThatSomebodyHolds) {
  MessagePool<PointCloud2> pool;
  std::set<PointCloud2ConstPtr> held;
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(held.insert(pool.take()).second) << i;
}

TEST(MessagePool, HandsOutTheMemoryOfWhatWasLetGo) {
  MessagePool<PointCloud2> pool;
  PointCloud2ConstPtr kept = pool.take();
  const std::uint8_t* memory = nullptr;
  {
    const auto message = pool.take();
    message->data.resize(1000);
    memory = message->data.data();
  }
  const auto again = pool.take();
  EXPECT_EQ(again->data.data(), memory);
  EXPECT_NE(pool.take(), kept);
}

TEST(MessagePool, LetsGoOfWhatOneWhoFallsBehindHasHeld) {
  MessagePool<PointCloud2> pool;
  std::vector<boost::weak_ptr<PointCloud2>> seen;
  {
    std::vector<PointCloud2ConstPtr> held;
    for (int i = 0; i < 100; ++i) {
      const auto message = pool.take();
      seen.push_back(message);
      held.push_back(message);
    }
  }
  std::size_t kept = 0;
  for (const auto& message : seen) kept += message.expired() ? 0 : 1;
  EXPECT_EQ(kept, 8U);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
