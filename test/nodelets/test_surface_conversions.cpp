#include <gtest/gtest.h>

#include <cmath>

#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/floor_markers.hpp"
#include "smoke_ground_reconstruction/ros/mounting_source.hpp"
#include "smoke_ground_reconstruction/ros/surface_conversions.hpp"

namespace smoke_ground_reconstruction {
namespace {

using visualization_msgs::Marker;

std_msgs::Header makeHeader() {
  std_msgs::Header header;
  header.frame_id = "lidar";
  header.stamp = ros::Time(5, 987654321);
  return header;
}

Mounting levelAt(double height) { return levelMounting(0.0, height); }

// A rectangle from (-1, -2) to (4, 3), 0.7 m below the sensor; its edges in turn: right, front,
// left, back.
FloorOutline rectangle(BoundaryKind right, BoundaryKind front) {
  FloorOutline outline;
  outline.vertices = {{-1, -2, -0.7F}, {4, -2, -0.7F}, {4, 3, -0.7F}, {-1, 3, -0.7F}};
  outline.kinds = {right, right, front, BoundaryKind::kWallSeen};
  return outline;
}

TEST(SurfaceMessage, HasTheAgreedLayout) {
  FloorSurface surface;
  surface.x = {1, 2};
  surface.y = {3, 4};
  surface.z = {5, 6};
  surface.intensity = {7, 0};
  surface.ring = {300, 2};
  surface.provenance = {Provenance::kMeasured, Provenance::kReconstructed};
  surface.confidence = {1, 0.25F};
  surface.sigma = {0.01F, 0.02F};
  const auto cloud = toSurfaceMsg(makeHeader(), surface);
  EXPECT_EQ(describeFields(*cloud),
            "x FLOAT32 @0, y FLOAT32 @4, z FLOAT32 @8, intensity FLOAT32 @12, ring UINT16 @16, "
            "provenance UINT8 @18, confidence FLOAT32 @20, sigma FLOAT32 @24");
  EXPECT_EQ(cloud->header.stamp, ros::Time(5, 987654321));
  const CloudView view(*cloud);
  ASSERT_EQ(view.size(), 2U);
  EXPECT_EQ(view.scan().y[1], 4.0F);
  EXPECT_EQ(view.scan().ring[0], 300);
  EXPECT_EQ(view.point(1)[18], 1);
  EXPECT_EQ((StridedField<float>(view.point(0) + 20, 28)[1]), 0.25F);
  EXPECT_EQ((StridedField<float>(view.point(0) + 24, 28)[1]), 0.02F);
}

TEST(SurfaceMessage, StatesNoSigmaInTheMemoryOfOneThatDid) {
  FloorSurface surface;
  surface.push({1, 2, 3}, 4, 5, Provenance::kReconstructed, 0.5F);
  surface.push({1, 2, 3}, 4, 5, Provenance::kReconstructed, 0.5F);
  surface.sigma = {0.01F, 0.02F};
  const auto message = toSurfaceMsg(makeHeader(), surface);
  const std::uint8_t* const memory = message->data.data();
  surface.clear();
  surface.push({7, 8, 9}, 6, 5, Provenance::kMeasuredBefore, 0.25F);
  EXPECT_EQ(toSurfaceMsg(makeHeader(), surface, message)->data.data(), memory);
  const CloudView view(*message);
  ASSERT_EQ(view.size(), 1U);
  EXPECT_EQ(message->data.size(), 28U);
  EXPECT_EQ(view.scan().z[0], 9.0F);
  EXPECT_EQ(view.point(0)[18], 2);
  EXPECT_TRUE(std::isnan(StridedField<float>(view.point(0) + 24, 28)[0]));
}

TEST(OccupancyMessage, LiesOnTheFloorOfALevelSensor) {
  OccupancyGrid grid;
  grid.resolution = 0.5;
  grid.first_column = -4;
  grid.first_row = 2;
  grid.width = 2;
  grid.height = 1;
  grid.cells = {OccupancyGrid::kFloor, OccupancyGrid::kUnknown};
  const auto message = toOccupancyMsg(makeHeader(), grid, levelAt(0.7));
  EXPECT_EQ(message->info.origin.position.x, -2.0);
  EXPECT_EQ(message->info.origin.position.y, 1.0);
  EXPECT_EQ(message->info.origin.position.z, -0.7);
  EXPECT_EQ(message->info.origin.orientation.w, 1.0);
  EXPECT_EQ(message->info.width, 2U);
  EXPECT_EQ(message->data[0], 0);
  EXPECT_EQ(message->data[1], -1);
}

TEST(OccupancyMessage, TurnsWithTheMounting) {
  // Forward is the sensor's +y: the level frame's +x lies along +y, its +y along -x.
  OccupancyGrid grid;
  grid.resolution = 1.0;
  grid.first_column = 3;
  const auto message = toOccupancyMsg(makeHeader(), grid, levelMounting(90.0, 0.7));
  EXPECT_NEAR(message->info.origin.position.x, 0.0, 1e-12);
  EXPECT_NEAR(message->info.origin.position.y, 3.0, 1e-12);
  EXPECT_NEAR(message->info.origin.orientation.z, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(message->info.origin.orientation.w, std::sqrt(0.5), 1e-12);
}

TEST(BoundaryMessage, KeepsVerticesAndKinds) {
  const auto outline = rectangle(BoundaryKind::kLimitOfKnowledge, BoundaryKind::kWallInferred);
  const auto message = toBoundaryMsg(makeHeader(), outline);
  ASSERT_EQ(message->points.size(), 4U);
  EXPECT_EQ(message->points[2].x, 4.0F);
  EXPECT_EQ(message->points[2].z, -0.7F);
  EXPECT_EQ(message->kinds[2], FloorBoundary::WALL_INFERRED);
  EXPECT_EQ(toPolygonMsg(makeHeader(), outline)->polygon.points.size(), 4U);
}

TEST(LimitOfFloor, IsTheEdgeInThatDirection) {
  const auto outline = rectangle(BoundaryKind::kWallInferred, BoundaryKind::kWallSeen);
  const Mounting level = levelAt(0.7);
  EXPECT_NEAR(limitOfFloor(outline, level, 1, 0)->distance, 4.0, 1e-6);
  EXPECT_NEAR(limitOfFloor(outline, level, 0, 1)->distance, 3.0, 1e-6);
  EXPECT_NEAR(limitOfFloor(outline, level, -1, 0)->distance, 1.0, 1e-6);
  EXPECT_EQ(limitOfFloor(outline, level, 0, -1)->kind, BoundaryKind::kWallInferred);
  // The front edge has an inferred and a seen end: the less certain speaks.
  EXPECT_EQ(limitOfFloor(outline, level, 1, 0)->kind, BoundaryKind::kWallInferred);
  EXPECT_EQ(limitOfFloor(outline, level, 0, 1)->kind, BoundaryKind::kWallSeen);
}

TEST(LimitOfFloor, FollowsForward) {
  const auto outline = rectangle(BoundaryKind::kWallSeen, BoundaryKind::kWallSeen);
  const auto limit = limitOfFloor(outline, levelMounting(90.0, 0.7), 1, 0);
  EXPECT_NEAR(limit->distance, 3.0, 1e-6);  // forward is the sensor's +y
}

TEST(LimitOfFloor, IsUnknownWhereNoFloorIsClaimed) {
  EXPECT_FALSE(limitOfFloor(FloorOutline(), levelAt(0.7), 1, 0));
  auto ahead = rectangle(BoundaryKind::kWallSeen, BoundaryKind::kWallSeen);
  for (auto& vertex : ahead.vertices) vertex[0] += 2;  // begins 1 m ahead of the sensor
  EXPECT_FALSE(limitOfFloor(ahead, levelAt(0.7), 1, 0));
  EXPECT_FALSE(limitOfFloor(ahead, levelAt(0.7), -1, 0));
}

const Marker& find(const visualization_msgs::MarkerArray& array, const std::string& ns, int id) {
  for (const Marker& marker : array.markers) {
    if (marker.ns == ns && marker.id == id) return marker;
  }
  throw std::out_of_range(ns);
}

TEST(Markers, TellKindsAndDistances) {
  const auto outline = rectangle(BoundaryKind::kWallSeen, BoundaryKind::kLimitOfKnowledge);
  const auto array = toMarkers(makeHeader(), outline, levelAt(0.7));
  EXPECT_EQ(find(*array, "distance", 0).text, "FRONT\nunknown beyond 4.0 m");
  EXPECT_EQ(find(*array, "distance", 1).text, "LEFT\nunknown beyond 3.0 m");
  EXPECT_EQ(find(*array, "distance", 2).text, "BACK\nwall 1.0 m");
  EXPECT_EQ(find(*array, "distance", 3).text, "RIGHT\nwall 2.0 m");
  EXPECT_EQ(find(*array, "outline", 0).points.size(), 4U);  // back and right
  EXPECT_EQ(find(*array, "outline", 1).action, Marker::DELETE);
  EXPECT_EQ(find(*array, "outline", 2).points.size(), 4U);
  for (const Marker& marker : array->markers) {
    EXPECT_EQ(marker.header.stamp, ros::Time(5, 987654321));
    EXPECT_GT(marker.lifetime.toSec(), 0.0);
  }
}

TEST(Markers, AreTheSameSetWhateverTheFloor) {
  const auto none = toMarkers(makeHeader(), FloorOutline(), levelAt(0.7));
  const auto some = toMarkers(
      makeHeader(), rectangle(BoundaryKind::kWallSeen, BoundaryKind::kWallSeen), levelAt(0.7));
  EXPECT_EQ(none->markers.size(), some->markers.size());
  EXPECT_EQ(find(*none, "legend", 0).text, "NO FLOOR KNOWN");
  EXPECT_EQ(find(*none, "distance", 0).text, "FRONT\nunknown");
  EXPECT_EQ(find(*none, "look", 0).action, Marker::DELETE);
}

TEST(Mounting, ComesFromTheTransform) {
  geometry_msgs::Transform T_base_sensor;
  T_base_sensor.translation.z = 0.5;
  T_base_sensor.rotation.y = std::sin(0.1);  // pitched down by 0.2 rad about +y
  T_base_sensor.rotation.w = std::cos(0.1);
  const Mounting mounting = mountingFrom(T_base_sensor, 0.2);
  EXPECT_DOUBLE_EQ(mounting.sensor_height, 0.7);
  // The sensor's +x points down by 0.2 rad.
  const auto ahead = mounting.toLevel(1, 0, 0);
  EXPECT_NEAR(ahead[0], std::cos(0.2), 1e-6);
  EXPECT_NEAR(ahead[2], -std::sin(0.2), 1e-6);
}

TEST(Mounting, IsExactForIdentityAndQuarterTurns) {
  geometry_msgs::Transform identity;
  identity.rotation.w = 1.0;
  identity.translation.z = 0.7;
  EXPECT_TRUE(mountingFrom(identity, 0.0).isLevel());
  EXPECT_TRUE(levelAt(0.7).isLevel());
  const auto left = levelMounting(90.0, 0.7).toLevel(0, 1, 0);
  EXPECT_EQ(left[0], 1.0F);
  EXPECT_EQ(left[1], 0.0F);
}

TEST(Mounting, RefusesASensorBelowTheFloor) {
  geometry_msgs::Transform T_base_sensor;
  T_base_sensor.rotation.w = 1.0;
  T_base_sensor.translation.z = -0.1;
  EXPECT_THROW(mountingFrom(T_base_sensor, 0.0), std::runtime_error);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
