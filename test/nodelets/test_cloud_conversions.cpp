#include <gtest/gtest.h>
#include <sensor_msgs/PointField.h>

#include <cstring>
#include <limits>
#include <stdexcept>

#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

void addField(PointCloud2& cloud, const std::string& name, std::uint8_t datatype,
              std::uint32_t offset) {
  PointField field;
  field.name = name;
  field.offset = offset;
  field.datatype = datatype;
  field.count = 1;
  cloud.fields.push_back(field);
}

template <typename Value>
void put(PointCloud2& cloud, std::size_t at, Value value) {
  std::memcpy(&cloud.data.at(at + sizeof(Value) - 1) - (sizeof(Value) - 1), &value, sizeof(Value));
}

// Three points (i, 10 + i, 20 + i) of intensity 30 + i and ring 40 + i, packed to 18 bytes.
PointCloud2 makeCloud() {
  PointCloud2 cloud;
  cloud.header.frame_id = "lidar";
  cloud.header.stamp = ros::Time(1, 23);
  addField(cloud, "x", PointField::FLOAT32, 0);
  addField(cloud, "y", PointField::FLOAT32, 4);
  addField(cloud, "z", PointField::FLOAT32, 8);
  addField(cloud, "intensity", PointField::FLOAT32, 12);
  addField(cloud, "ring", PointField::UINT16, 16);
  cloud.point_step = 18;
  cloud.width = 3;
  cloud.height = 1;
  cloud.row_step = 54;
  cloud.data.resize(54);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = static_cast<float>(i);
    put(cloud, i * 18, number);
    put(cloud, i * 18 + 4, number + 10);
    put(cloud, i * 18 + 8, number + 20);
    put(cloud, i * 18 + 12, number + 30);
    put(cloud, i * 18 + 16, static_cast<std::uint16_t>(i + 40));
  }
  return cloud;
}

std::string reasonToRefuse(const PointCloud2& cloud) {
  try {
    const CloudView view(cloud);
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

PointCloud2 selected(const CloudView& cloud, const std::vector<Label>& labels, Label label,
                     const std::vector<AppendedField>& appended = {}) {
  PointCloud2 cut;
  selectPoints(cloud, labels, label, appended, &cut);
  return cut;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(CloudView, ReadsPackedPointsWhereTheyLie) {
  const PointCloud2 cloud = makeCloud();
  const CloudView view(cloud);
  ASSERT_EQ(view.size(), 3U);
  EXPECT_EQ(view.scan().x[2], 2.0F);
  EXPECT_EQ(view.scan().y[2], 12.0F);
  EXPECT_EQ(view.scan().z[1], 21.0F);
  EXPECT_EQ(view.scan().intensity[1], 31.0F);
  EXPECT_EQ(view.scan().ring[2], 42);
  EXPECT_EQ(view.point(1), cloud.data.data() + 18);  // nothing was copied
}

TEST(CloudView, SkipsPaddingBetweenRows) {
  PointCloud2 cloud = makeCloud();
  cloud.width = 1;
  cloud.height = 3;
  cloud.row_step = 18 + 5;
  for (std::size_t row = 1; row < 3; ++row) {
    cloud.data.insert(cloud.data.begin() + static_cast<std::ptrdiff_t>(row * 23 - 5), 5, 0xAB);
  }
  cloud.data.resize(3 * 23);
  const CloudView view(cloud);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(view.scan().ring[i], 40 + i);
  EXPECT_EQ(view.scan().z[2], 22.0F);
}

TEST(CloudView, ConvertsOtherNumbers) {
  PointCloud2 cloud = makeCloud();
  cloud.fields[3].datatype = PointField::INT16;
  cloud.fields[4].datatype = PointField::UINT8;
  for (std::size_t i = 0; i < 3; ++i) put(cloud, i * 18 + 12, static_cast<std::int16_t>(i + 7));
  const CloudView view(cloud);
  EXPECT_EQ(view.scan().intensity[2], 9.0F);
  EXPECT_EQ(view.scan().ring[2], 42);
}

TEST(CloudView, ReadsDoubleCoordinates) {
  PointCloud2 cloud = makeCloud();
  addField(cloud, "time", PointField::FLOAT64, 18);
  cloud.fields[0] = cloud.fields.back();
  cloud.fields[0].name = "x";
  cloud.fields.pop_back();
  cloud.point_step = 26;
  cloud.row_step = 78;
  cloud.data.assign(78, 0);
  put(cloud, 2 * 26 + 18, 0.1);
  const CloudView view(cloud);
  EXPECT_EQ(view.scan().x[2], 0.1F);
  EXPECT_EQ(view.scan().x[1], 0.0F);
}

TEST(CloudView, CountOfZeroMeansOne) {
  PointCloud2 cloud = makeCloud();
  for (auto& field : cloud.fields) field.count = 0;
  EXPECT_EQ(CloudView(cloud).scan().ring[2], 42);
}

TEST(CloudView, DerivesMissingRings) {
  PointCloud2 cloud = makeCloud();
  cloud.fields.pop_back();
  const CloudView view(cloud);
  EXPECT_FALSE(view.hasRing());
  EXPECT_EQ(view.derivedRings().size(), 3U);
  EXPECT_TRUE(CloudView(makeCloud()).hasRing());
}

TEST(CloudView, ListsTheFieldsWhereOneIsMissing) {
  PointCloud2 cloud = makeCloud();
  cloud.fields.erase(cloud.fields.begin() + 1);
  EXPECT_EQ(reasonToRefuse(cloud),
            "no single field 'y' of FLOAT32 or FLOAT64; fields: x FLOAT32 @0, z FLOAT32 @8, "
            "intensity FLOAT32 @12, ring UINT16 @16");
}

TEST(CloudView, RefusesCoordinatesThatAreNoSingleFloat) {
  PointCloud2 cloud = makeCloud();
  cloud.fields[0].datatype = PointField::INT32;
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "no single field 'x'"));
  cloud = makeCloud();
  cloud.fields[0].count = 3;
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "x FLOAT32[3] @0"));
}

TEST(CloudView, RefusesMissingIntensityAndRingsOfFloats) {
  PointCloud2 cloud = makeCloud();
  cloud.fields[3].name = "reflectivity";
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "no single field 'intensity' of numbers"));
  cloud = makeCloud();
  cloud.fields[4].datatype = PointField::FLOAT32;
  cloud.fields[4].offset = 14;
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "no single field 'ring' of integers"));
}

TEST(CloudView, RefusesRingsOutsideSixteenBits) {
  PointCloud2 cloud = makeCloud();
  cloud.fields[4].datatype = PointField::INT16;
  put(cloud, 18 + 16, std::int16_t{-1});
  EXPECT_EQ(reasonToRefuse(cloud), "ring -1 of point 1 is outside 0..65535");
}

TEST(CloudView, RefusesSizesThatContradict) {
  PointCloud2 cloud = makeCloud();
  cloud.data.pop_back();
  EXPECT_EQ(reasonToRefuse(cloud), "data holds 53 bytes, height * row_step asks 54");
  cloud = makeCloud();
  cloud.row_step = 53;
  EXPECT_EQ(reasonToRefuse(cloud), "row_step 53 is less than width * point_step = 54");
  cloud = makeCloud();
  cloud.point_step = 0;
  EXPECT_EQ(reasonToRefuse(cloud), "point_step is 0");
  cloud = makeCloud();
  cloud.width = cloud.height = std::numeric_limits<std::uint32_t>::max();
  cloud.row_step = std::numeric_limits<std::uint32_t>::max();
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "row_step"));
}

TEST(CloudView, RefusesFieldsOutsideTheirPoint) {
  for (const std::uint32_t offset : {15U, 18U, 0xFFFFFFFFU}) {
    PointCloud2 cloud = makeCloud();
    cloud.fields[2].offset = offset;
    EXPECT_TRUE(contains(reasonToRefuse(cloud), "field 'z' reaches beyond point_step 18"))
        << offset;
  }
  PointCloud2 cloud = makeCloud();
  cloud.fields[2].count = 0xFFFFFFFFU;
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "field 'z' reaches beyond"));
}

TEST(CloudView, RefusesUnknownTypesAndBigEndian) {
  PointCloud2 cloud = makeCloud();
  cloud.fields[2].datatype = 9;
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "field 'z' has unknown datatype 9"));
  cloud = makeCloud();
  cloud.is_bigendian = true;
  EXPECT_TRUE(contains(reasonToRefuse(cloud), "big-endian"));
}

TEST(CloudView, TakesAnEmptyCloudWhateverItsFields) {
  const PointCloud2 nothing;
  EXPECT_EQ(CloudView(nothing).size(), 0U);
  PointCloud2 cloud = makeCloud();
  cloud.width = 0;
  cloud.data.clear();
  EXPECT_EQ(CloudView(cloud).size(), 0U);
}

TEST(CountPoints, CountsMoreThanAByteHolds) {
  std::vector<Label> labels(1000, Label::kWall);
  EXPECT_EQ(countPoints(labels, Label::kWall), 1000U);
  EXPECT_EQ(countPoints(labels, Label::kKept), 0U);
  labels[0] = labels[254] = labels[255] = labels[999] = Label::kKept;
  EXPECT_EQ(countPoints(labels, Label::kWall), 996U);
  EXPECT_EQ(countPoints(labels, Label::kKept), 4U);
  EXPECT_EQ(countPoints({}, Label::kWall), 0U);
}

TEST(SelectPoints, KeepsHeaderFieldsAndOrder) {
  PointCloud2 cloud = makeCloud();
  cloud.width = 1;
  cloud.height = 3;
  cloud.row_step = 18;
  const CloudView view(cloud);
  const auto cut = selected(view, {Label::kGround, Label::kWall, Label::kGround}, Label::kGround);
  EXPECT_EQ(cut.header.frame_id, "lidar");
  EXPECT_EQ(cut.header.stamp, ros::Time(1, 23));
  EXPECT_EQ(cut.width, 2U);
  EXPECT_EQ(cut.height, 1U);
  EXPECT_EQ(cut.row_step, 36U);
  ASSERT_EQ(cut.data.size(), 36U);
  EXPECT_EQ(describeFields(cut), describeFields(cloud));
  const CloudView cut_view(cut);
  EXPECT_EQ(cut_view.scan().ring[0], 40);
  EXPECT_EQ(cut_view.scan().ring[1], 42);
}

TEST(SelectPoints, AppendsTheValuesOfTheKeptPoints) {
  const PointCloud2 cloud = makeCloud();
  const CloudView view(cloud);
  const std::vector<std::uint32_t> clusters = {7, 8, 9};
  const auto cut = selected(view, {Label::kWall, Label::kGround, Label::kWall}, Label::kWall,
                            {AppendedField::of("cluster", clusters)});
  EXPECT_EQ(cut.point_step, 22U);
  EXPECT_EQ(cut.fields.back().offset, 18U);
  EXPECT_EQ(cut.fields.back().datatype, PointField::UINT32);
  const StridedField<std::uint32_t> cluster(cut.data.data() + 18, 22);
  EXPECT_EQ(cluster[0], 7U);
  EXPECT_EQ(cluster[1], 9U);
  const CloudView again(cut);
  EXPECT_THROW(selected(again, {Label::kWall, Label::kWall}, Label::kWall,
                        {AppendedField::of("cluster", clusters)}),
               std::invalid_argument);
}

TEST(SelectPoints, GivesAnEmptyCloudWhereNothingIsLeft) {
  const PointCloud2 cloud = makeCloud();
  const CloudView view(cloud);
  const auto cut = selected(view, std::vector<Label>(3, Label::kInvalid), Label::kWall);
  EXPECT_EQ(cut.width, 0U);
  EXPECT_TRUE(cut.data.empty());
  EXPECT_EQ(cut.fields.size(), 5U);
}

// All neighbours, every second, none, from the first to the last.
TEST(SelectPoints, TakesRunsOfAnyLength) {
  const PointCloud2 cloud = makeCloud();
  const CloudView view(cloud);
  const std::vector<std::uint32_t> clusters = {7, 8, 9};
  for (unsigned chosen = 0; chosen < 8; ++chosen) {
    std::vector<Label> labels(3, Label::kNoise);
    std::vector<std::uint16_t> rings;
    for (std::uint16_t i = 0; i < 3; ++i) {
      if ((chosen >> i & 1U) == 0) continue;
      labels[i] = Label::kKept;
      rings.push_back(static_cast<std::uint16_t>(40 + i));
    }
    for (const auto& appended :
         {std::vector<AppendedField>{}, {AppendedField::of("cluster", clusters)}}) {
      const auto cut = selected(view, labels, Label::kKept, appended);
      const CloudView cut_view(cut);
      ASSERT_EQ(cut_view.size(), rings.size());
      for (std::size_t i = 0; i < rings.size(); ++i) EXPECT_EQ(cut_view.scan().ring[i], rings[i]);
    }
  }
}

TEST(SelectPoints, OverwritesAMessageThatHeldAnother) {
  const PointCloud2 cloud = makeCloud();
  const CloudView view(cloud);
  const std::vector<std::uint32_t> clusters = {7, 8, 9};
  PointCloud2 message = selected(view, std::vector<Label>(3, Label::kKept), Label::kKept,
                                 {AppendedField::of("cluster", clusters)});
  message.is_bigendian = true;
  const std::uint8_t* const memory = message.data.data();
  const std::vector<Label> labels = {Label::kWall, Label::kNoise, Label::kWall};
  selectPoints(view, labels, Label::kWall, {}, &message);
  const PointCloud2 fresh = selected(view, labels, Label::kWall);
  EXPECT_EQ(message.data.data(), memory);
  EXPECT_EQ(ros::serialization::serializationLength(message),
            ros::serialization::serializationLength(fresh));
  EXPECT_EQ(message.data, fresh.data);
  EXPECT_EQ(describeFields(message), describeFields(fresh));
  EXPECT_EQ(message.row_step, fresh.row_step);
  EXPECT_FALSE(message.is_bigendian);
}

TEST(MissingRing, IsAppendedOnlyWhereTheDriverSendsNone) {
  PointCloud2 cloud = makeCloud();
  EXPECT_TRUE(missingRing(CloudView(cloud)).empty());
  cloud.fields.pop_back();
  const CloudView view(cloud);
  const auto fields = missingRing(view);
  ASSERT_EQ(fields.size(), 1U);
  const auto cut = selected(view, std::vector<Label>(3, Label::kKept), Label::kKept, fields);
  EXPECT_EQ(cut.fields.back().name, "ring");
  const CloudView cut_view(cut);
  EXPECT_TRUE(cut_view.hasRing());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(cut_view.scan().ring[i], view.scan().ring[i]);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
