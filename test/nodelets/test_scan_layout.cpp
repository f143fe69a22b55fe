#include <gtest/gtest.h>
#include <sensor_msgs/PointField.h>

#include <memory>
#include <vector>

#include "numbered_cloud.hpp"
#include "smoke_ground_reconstruction/ros/scan_layout.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2ConstPtr;
using sensor_msgs::PointField;

std::shared_ptr<ScanLayout> takenOf(LayoutPool& pool, const PointCloud2ConstPtr& cloud) {
  return pool.take(cloud, CloudView(*cloud));
}

TEST(LayoutPool, LaysAScanOut) {
  LayoutPool pool;
  const auto cloud = makeCloud(3);
  const auto layout = takenOf(pool, cloud);
  ASSERT_TRUE(layout);
  EXPECT_EQ(layout->message, cloud);
  EXPECT_EQ(layout->scan.x, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(layout->scan.valid, (std::vector<std::uint8_t>{1, 1, 1}));
  EXPECT_EQ(layout->points_by_ring, (std::vector<std::size_t>{1, 1, 1}));
}

TEST(RasterSlot, LendsWhatWasFilledInToTheFirstWhoAsks) {
  RasterSlot slot;
  EXPECT_EQ(slot.take(), nullptr);
  for (int scan = 0; scan < 2; ++scan) {
    auto* const filled = slot.fill();
    EXPECT_EQ(slot.take(), filled);
    EXPECT_EQ(slot.take(), nullptr);
  }
}

TEST(LayoutPool, UsesMemoryThatIsLetGoAndNoOther) {
  LayoutPool pool;
  const auto held = takenOf(pool, makeCloud(3));
  const void* memory = takenOf(pool, makeCloud(5)).get();
  const auto again = takenOf(pool, makeCloud(2));
  EXPECT_EQ(again.get(), memory);
  EXPECT_EQ(again->scan.size(), 2U);
  EXPECT_EQ(again->points_by_ring.size(), 2U);
  EXPECT_EQ(held->scan.size(), 3U);
}

TEST(LayoutPool, LetsGoOfTheMessagesOfScansThatAreOver) {
  LayoutPool pool;
  const auto cloud = makeCloud(3);
  EXPECT_TRUE(takenOf(pool, cloud));
  EXPECT_GT(cloud.use_count(), 1);
  const auto next = takenOf(pool, makeCloud(3));
  EXPECT_EQ(cloud.use_count(), 1);
}

TEST(LayoutPool, GivesNoneWhereTooManyAreUnderWay) {
  LayoutPool pool;
  std::vector<std::shared_ptr<ScanLayout>> held;
  for (int i = 0; i < 8; ++i) held.push_back(takenOf(pool, makeCloud(1)));
  EXPECT_TRUE(held.back());
  EXPECT_FALSE(takenOf(pool, makeCloud(1)));
  held.pop_back();
  EXPECT_TRUE(takenOf(pool, makeCloud(1)));
}

TEST(LayoutPool, GivesNoneOfAScanThatIsConvertedToBeRead) {
  LayoutPool pool;
  EXPECT_FALSE(takenOf(pool, makeCloud(3, PointField::INT16)));
}

}  // namespace
}  // namespace smoke_ground_reconstruction
