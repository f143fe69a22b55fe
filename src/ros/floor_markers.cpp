#include "smoke_ground_reconstruction/ros/floor_markers.hpp"

#include <algorithm>
#include <array>
#include <boost/make_shared.hpp>
#include <cstdio>
#include <string>
#include <vector>

namespace smoke_ground_reconstruction {
namespace {

using visualization_msgs::Marker;

constexpr double kLifetime = 1.0;    // [s]; a floor that is not renewed must not stay in sight
constexpr double kLineWidth = 0.06;  // [m]
constexpr double kTextHeight = 0.3;  // [m]
constexpr double kTextLift = 1.0;    // of a text's middle above the floor [m]
constexpr std::array<BoundaryKind, 3> kKinds = {
    BoundaryKind::kWallSeen, BoundaryKind::kWallInferred, BoundaryKind::kLimitOfKnowledge};

struct Look {
  const char* name;
  double x, y;
};
constexpr std::array<Look, 4> kLooks = {Look{"FRONT", 1, 0}, Look{"LEFT", 0, 1},
                                        Look{"BACK", -1, 0}, Look{"RIGHT", 0, -1}};

std_msgs::ColorRGBA makeColor(float red, float green, float blue) {
  std_msgs::ColorRGBA color;
  color.r = red;
  color.g = green;
  color.b = blue;
  color.a = 1.0F;
  return color;
}

std_msgs::ColorRGBA colorOf(BoundaryKind kind) {
  switch (kind) {
    case BoundaryKind::kWallSeen:
      return makeColor(0.1F, 0.8F, 0.3F);
    case BoundaryKind::kWallInferred:
      return makeColor(1.0F, 0.6F, 0.0F);
    default:
      return makeColor(0.9F, 0.1F, 0.1F);
  }
}

geometry_msgs::Point toPoint(const std::array<float, 3>& xyz) {
  geometry_msgs::Point point;
  point.x = static_cast<double>(xyz[0]);
  point.y = static_cast<double>(xyz[1]);
  point.z = static_cast<double>(xyz[2]);
  return point;
}

geometry_msgs::Point pointOnFloor(const Mounting& mounting, double x, double y, double lift) {
  return toPoint(mounting.toSensor(static_cast<float>(x), static_cast<float>(y),
                                   static_cast<float>(lift - mounting.sensor_height)));
}

Marker makeMarker(const std_msgs::Header& header, const char* ns, int id, int type,
                  const std_msgs::ColorRGBA& color) {
  Marker marker;
  marker.header = header;
  marker.ns = ns;
  marker.id = id;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.color = color;
  marker.lifetime = ros::Duration(kLifetime);
  return marker;
}

// Which is the more careful thing to say of an edge between two vertices.
BoundaryKind lessCertain(BoundaryKind a, BoundaryKind b) { return std::max(a, b); }

Marker outlineOf(const std_msgs::Header& header, const FloorOutline& outline, BoundaryKind kind) {
  Marker lines =
      makeMarker(header, "outline", static_cast<int>(kind), Marker::LINE_LIST, colorOf(kind));
  lines.scale.x = kLineWidth;
  for (std::size_t i = 0; i < outline.vertices.size(); ++i) {
    const std::size_t next = (i + 1) % outline.vertices.size();
    if (lessCertain(outline.kinds[i], outline.kinds[next]) != kind) continue;
    lines.points.push_back(toPoint(outline.vertices[i]));
    lines.points.push_back(toPoint(outline.vertices[next]));
  }
  if (lines.points.empty()) lines.action = Marker::DELETE;
  return lines;
}

std::string describe(const std::optional<FloorLimit>& limit) {
  if (!limit) return "unknown";
  const char* format = "unknown beyond %.1f m";
  if (limit->kind == BoundaryKind::kWallSeen) format = "wall %.1f m";
  if (limit->kind == BoundaryKind::kWallInferred) format = "wall inferred %.1f m";
  char text[64];
  std::snprintf(text, sizeof(text), format, limit->distance);
  return text;
}

Marker textOf(const std_msgs::Header& header, const char* ns, int id,
              const std_msgs::ColorRGBA& color, const std::string& text) {
  Marker marker = makeMarker(header, ns, id, Marker::TEXT_VIEW_FACING, color);
  marker.scale.z = kTextHeight;
  marker.text = text;
  return marker;
}

void appendLook(const std_msgs::Header& header, const FloorOutline& outline,
                const Mounting& mounting, int id, std::vector<Marker>& markers) {
  const Look& look = kLooks[static_cast<std::size_t>(id)];
  const auto limit = limitOfFloor(outline, mounting, look.x, look.y);
  const double distance = limit ? limit->distance : 1.0;
  const auto color = colorOf(limit ? limit->kind : BoundaryKind::kLimitOfKnowledge);

  Marker line = makeMarker(header, "look", id, Marker::LINE_STRIP, color);
  line.scale.x = kLineWidth / 3;
  line.points = {pointOnFloor(mounting, 0, 0, 0),
                 pointOnFloor(mounting, look.x * distance, look.y * distance, 0)};
  if (!limit) line.action = Marker::DELETE;
  markers.push_back(line);

  Marker text =
      textOf(header, "distance", id, color, std::string(look.name) + "\n" + describe(limit));
  text.pose.position = pointOnFloor(mounting, look.x * distance, look.y * distance, kTextLift);
  markers.push_back(text);
}

Marker legend(const std_msgs::Header& header, const FloorOutline& outline,
              const Mounting& mounting) {
  const bool claims_floor = !outline.vertices.empty();
  Marker text =
      textOf(header, "legend", 0,
             claims_floor ? makeColor(1, 1, 1) : colorOf(BoundaryKind::kLimitOfKnowledge),
             claims_floor ? "green: wall seen   orange: wall inferred   red: unknown beyond"
                          : "NO FLOOR KNOWN");
  text.scale.z = kTextHeight * 2 / 3;
  text.pose.position = pointOnFloor(mounting, 0, 0, mounting.sensor_height + kTextLift);
  return text;
}

}  // namespace

std::optional<FloorLimit> limitOfFloor(const FloorOutline& outline, const Mounting& mounting,
                                       double x, double y) {
  std::optional<FloorLimit> nearest;
  bool is_inside = false;  // an odd number of crossings: the look begins on claimed floor
  const std::size_t n = outline.vertices.size();
  for (std::size_t i = 0; i < n; ++i) {
    const auto& v = outline.vertices[i];
    const auto& w = outline.vertices[(i + 1) % n];
    const auto a = mounting.toLevel(v[0], v[1], v[2]);
    const auto b = mounting.toLevel(w[0], w[1], w[2]);
    const double side_a = x * double{a[1]} - y * double{a[0]};
    const double side_b = x * double{b[1]} - y * double{b[0]};
    if ((side_a > 0) == (side_b > 0)) continue;
    const double along_a = x * double{a[0]} + y * double{a[1]};
    const double along_b = x * double{b[0]} + y * double{b[1]};
    const double distance = along_a + (along_b - along_a) * side_a / (side_a - side_b);
    if (distance <= 0) continue;
    is_inside = !is_inside;
    const auto kind = lessCertain(outline.kinds[i], outline.kinds[(i + 1) % n]);
    if (!nearest || distance < nearest->distance) nearest = FloorLimit{distance, kind};
  }
  return is_inside ? nearest : std::nullopt;
}

visualization_msgs::MarkerArrayPtr toMarkers(const std_msgs::Header& header,
                                             const FloorOutline& outline,
                                             const Mounting& mounting) {
  auto message = boost::make_shared<visualization_msgs::MarkerArray>();
  for (const BoundaryKind kind : kKinds) {
    message->markers.push_back(outlineOf(header, outline, kind));
  }
  for (int id = 0; id < static_cast<int>(kLooks.size()); ++id) {
    appendLook(header, outline, mounting, id, message->markers);
  }
  message->markers.push_back(legend(header, outline, mounting));
  return message;
}

}  // namespace smoke_ground_reconstruction
