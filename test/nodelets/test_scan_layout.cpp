#include <gtest/gtest.h>
#include <sensor_msgs/PointField.h>

#include <boost/make_shared.hpp>
#include <boost/pointer_cast.hpp>
#include <cstring>
#include <vector>

#include "smoke_ground_reconstruction/ros/scan_layout.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointCloud2ConstPtr;
using sensor_msgs::PointField;

// Points (i + 1, 2, 3) of ring i, packed to 18 bytes; coordinates of a datatype.
PointCloud2ConstPtr makeCloud(std::size_t size, std::uint8_t ring_type = PointField::UINT16) {
  const auto cloud = boost::make_shared<PointCloud2>();
  const std::vector<const char*> names = {"x", "y", "z", "intensity", "ring"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    PointField field;
    field.name = names[i];
    field.offset = static_cast<std::uint32_t>(4 * i);
    field.datatype = i < 4 ? std::uint8_t{PointField::FLOAT32} : ring_type;
    field.count = 1;
    cloud->fields.push_back(field);
  }
  cloud->point_step = 18;
  cloud->width = static_cast<std::uint32_t>(size);
  cloud->height = 1;
  cloud->row_step = cloud->width * cloud->point_step;
  cloud->data.resize(cloud->row_step);
  for (std::size_t i = 0; i < size; ++i) {
    const float values[] = {static_cast<float>(i + 1), 2.0F, 3.0F, 4.0F};
    const auto ring = static_cast<std::uint16_t>(i);
    std::memcpy(&cloud->data[18 * i], values, sizeof(values));
    std::memcpy(&cloud->data[18 * i + 16], &ring, sizeof(ring));
  }
  return cloud;
}

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

TEST(CarrierPool, SendsALayoutAlongWithAMessage) {
  LayoutPool layouts;
  CarrierPool carriers;
  const auto layout = takenOf(layouts, makeCloud(3));
  // As ROS hands messages over in a process.
  const boost::shared_ptr<const void> on_the_way = carriers.take(layout);
  EXPECT_EQ(layoutOf(boost::static_pointer_cast<const PointCloud2>(on_the_way)), layout);
}

TEST(CarrierPool, SendsNoneWhereThereIsNone) {
  LayoutPool layouts;
  CarrierPool carriers;
  EXPECT_FALSE(layoutOf(carriers.take(nullptr)));
  EXPECT_TRUE(layoutOf(carriers.take(takenOf(layouts, makeCloud(3)))));
  EXPECT_FALSE(layoutOf(carriers.take(nullptr)));  // the same message
  EXPECT_FALSE(layoutOf(makeCloud(3)));            // of somebody else
}

TEST(CarrierPool, HoldsNoLayoutsOfMessagesThatWereLetGo) {
  LayoutPool layouts;
  CarrierPool carriers;
  std::vector<std::weak_ptr<ScanLayout>> seen;
  {
    std::vector<PointCloud2ConstPtr> held;
    for (int i = 0; i < 8; ++i) {
      const auto layout = takenOf(layouts, makeCloud(1));
      seen.push_back(layout);
      held.push_back(carriers.take(layout));
    }
    EXPECT_FALSE(takenOf(layouts, makeCloud(1)));
  }
  const auto next = carriers.take(nullptr);
  for (const auto& layout : seen) EXPECT_EQ(layout.use_count(), 1);  // the pool's
}

}  // namespace
}  // namespace smoke_ground_reconstruction
