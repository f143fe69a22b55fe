#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <vector>

#include "numbered_cloud.hpp"
#include "smoke_ground_reconstruction/ros/cut_cloud.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;

// What another process gets.
template <typename To>
To sent(const CutCloud& cloud) {
  const ros::SerializedMessage wire = ros::serialization::serializeMessage(cloud);
  ros::serialization::IStream stream(wire.message_start,
                                     static_cast<std::uint32_t>(wire.num_bytes - 4));
  To received;
  ros::serialization::deserialize(stream, received);
  EXPECT_EQ(stream.getLength(), 0U);
  return received;
}

PointFindingsConstPtr findingsOf(const std::vector<Label>& labels) {
  const auto findings = std::make_shared<PointFindings>();
  findings->labels = labels;
  for (std::uint32_t i = 0; i < labels.size(); ++i) findings->clusters.push_back(100 + i);
  return findings;
}

// The walls of five points, the first, third and fourth, with their clusters.
class Walls : public testing::Test {
 protected:
  CutCloudPtr cut(const ScanLayoutConstPtr& layout) {
    return cutter_.cut(view_, layout, findings_, Label::kWall,
                       {AppendedField::of("cluster", findings_->clusters)});
  }

  const sensor_msgs::PointCloud2ConstPtr scan_ = makeCloud(5);
  const CloudView view_{*scan_};
  const PointFindingsConstPtr findings_ =
      findingsOf({Label::kWall, Label::kGround, Label::kWall, Label::kWall, Label::kInvalid});
  LayoutPool layouts_;
  CloudCutter cutter_;
};

TEST_F(Walls, CarryTheLayoutWithinAProcessAndNoPoints) {
  const auto layout = layouts_.take(scan_, view_);
  const auto walls = cut(layout);
  EXPECT_EQ(walls->layout, layout);
  EXPECT_EQ(walls->message.width, 3U);
  EXPECT_TRUE(walls->message.data.empty());
}

TEST_F(Walls, AreAPointCloud2ToOthers) {
  const auto received = sent<PointCloud2>(*cut(layouts_.take(scan_, view_)));
  EXPECT_EQ(received.width, 3U);
  EXPECT_EQ(received.height, 1U);
  EXPECT_EQ(received.point_step, 22U);
  EXPECT_EQ(received.row_step, 66U);
  EXPECT_TRUE(received.is_dense);
  EXPECT_EQ(received.fields.back().name, "cluster");
  ASSERT_EQ(received.data.size(), 66U);
  const StridedField<std::uint32_t> cluster(received.data.data() + 18, 22);
  const CloudView view(received);
  const std::size_t kept[] = {0, 2, 3};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(view.scan().x[i], static_cast<float>(kept[i] + 1));
    EXPECT_EQ(view.scan().ring[i], kept[i]);
    EXPECT_EQ(cluster[i], 100 + kept[i]);
  }
}

TEST_F(Walls, AreTheSameToOthersWithoutALayout) {
  const auto with = sent<PointCloud2>(*cut(layouts_.take(scan_, view_)));
  const auto without = cut(nullptr);
  EXPECT_FALSE(without->layout);
  EXPECT_EQ(without->message.data, with.data);
  EXPECT_EQ(sent<PointCloud2>(*without).data, with.data);
}

TEST_F(Walls, ComeWithoutALayoutFromOtherProcesses) {
  const auto received = sent<CutCloud>(*cut(layouts_.take(scan_, view_)));
  EXPECT_FALSE(received.layout);
  EXPECT_EQ(received.message.data, cut(nullptr)->message.data);
}

TEST_F(Walls, AreReadAlikeWithALayoutAndWithout) {
  const auto with = cut(layouts_.take(scan_, view_));
  const auto without = cut(nullptr);
  for (const auto& cloud : {with, without}) {
    const CutView view(*cloud);
    ASSERT_EQ(view.scan().size, 3U);
    const std::size_t kept[] = {0, 2, 3};
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(view.scan().x[i], static_cast<float>(kept[i] + 1));
      EXPECT_EQ(view.scan().y[i], 2.0F);
      EXPECT_EQ(view.scan().z[i], 3.0F);
      EXPECT_EQ(view.scan().intensity[i], 4.0F);
      EXPECT_EQ(view.scan().ring[i], kept[i]);
    }
  }
}

TEST_F(Walls, HoldTheLayoutAsLongAsTheyAreHeld) {
  auto walls = cut(layouts_.take(scan_, view_));
  const std::weak_ptr<const ScanLayout> layout = walls->layout;
  EXPECT_EQ(layout.use_count(), 2);  // the pool's and theirs
  walls.reset();
  EXPECT_EQ(layout.use_count(), 1);
}

TEST_F(Walls, LieInTheMemoryOfThoseThatWereLetGo) {
  const void* memory = cut(nullptr)->message.data.data();
  EXPECT_EQ(cut(nullptr)->message.data.data(), memory);
}

TEST_F(Walls, AreRefusedWhereAFieldIsThereAlready) {
  EXPECT_THROW(cutter_.cut(view_, layouts_.take(scan_, view_), findings_, Label::kWall,
                           {AppendedField::of("ring", findings_->clusters)}),
               std::invalid_argument);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
