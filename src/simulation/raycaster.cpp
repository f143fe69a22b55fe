#include "smoke_ground_reconstruction/simulation/raycaster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace smoke_ground_reconstruction {
namespace simulation {
namespace {

constexpr double kPlaneTolerance = 1e-6;
constexpr double kNearest = 1e-9;
constexpr double kBoxMargin = 1e-9;
constexpr std::uint32_t kLeafSize = 2;

/// Twice the area vector of a polygon (Newell): its direction is the plane's normal.
Eigen::Vector3d areaVector(const FacetMesh::Loop& loop) {
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    area += (loop[i] - loop[0]).cross(loop[(i + 1) % loop.size()] - loop[0]);
  }
  return area;
}

void checkLoop(const FacetMesh::Loop& loop, const Eigen::Vector3d& normal, double offset) {
  for (const auto& vertex : loop) {
    if (!(std::abs(normal.dot(vertex) - offset) <= kPlaneTolerance)) {
      throw std::invalid_argument("a facet's vertex is not finite or lies off its plane");
    }
  }
}

}  // namespace

void FacetMesh::addFacet(const std::vector<Loop>& loops, std::uint16_t material) {
  if (loops.empty() || loops[0].size() < 3) {
    throw std::invalid_argument("a facet needs at least three vertices");
  }
  const Eigen::Vector3d area = areaVector(loops[0]);
  if (!(area.norm() > 1e-12)) {
    throw std::invalid_argument("a facet has no area");
  }
  Facet facet;
  facet.normal = area.normalized();
  facet.offset = facet.normal.dot(loops[0][0]);
  facet.material = material;
  int drop = 0;  // the axis along the normal is dropped, so that the projection is widest
  facet.normal.cwiseAbs().maxCoeff(&drop);
  facet.u_axis = (drop + 1) % 3;
  facet.v_axis = (drop + 2) % 3;
  facet.edge_begin = static_cast<std::uint32_t>(edges_.size());
  for (const auto& loop : loops) {
    checkLoop(loop, facet.normal, facet.offset);
    addEdges(loop, facet);
    for (const auto& vertex : loop) {
      facet.box.low = facet.box.low.min(vertex.array() - kBoxMargin);
      facet.box.high = facet.box.high.max(vertex.array() + kBoxMargin);
    }
  }
  facet.edge_end = static_cast<std::uint32_t>(edges_.size());
  facets_.push_back(facet);
}

void FacetMesh::addEdges(const Loop& loop, const Facet& facet) {
  for (std::size_t i = 0; i < loop.size(); ++i) {
    Eigen::Vector2d from(loop[i][facet.u_axis], loop[i][facet.v_axis]);
    const auto& next = loop[(i + 1) % loop.size()];
    Eigen::Vector2d to(next[facet.u_axis], next[facet.v_axis]);
    if (from.y() == to.y()) {
      continue;  // never crossed by a horizontal line of the even-odd rule
    }
    if (from.y() > to.y()) {
      std::swap(from, to);
    }
    edges_.push_back({from.x(), from.y(), to.y(), (to.x() - from.x()) / (to.y() - from.y())});
  }
}

bool FacetMesh::isInside(const Facet& facet, double u, double v) const {
  bool inside = false;
  for (std::uint32_t i = facet.edge_begin; i < facet.edge_end; ++i) {
    const Edge& edge = edges_[i];
    if (edge.v_low <= v && v < edge.v_high && u < edge.u + (v - edge.v_low) * edge.slope) {
      inside = !inside;
    }
  }
  return inside;
}

void FacetMesh::build() {
  nodes_.clear();
  if (facets_.empty()) {
    return;
  }
  nodes_.reserve(2 * facets_.size());
  nodes_.emplace_back();
  split(0, 0, static_cast<std::uint32_t>(facets_.size()));
}

void FacetMesh::split(std::uint32_t node, std::uint32_t first, std::uint32_t count) {
  Box box, centres;
  for (std::uint32_t i = first; i < first + count; ++i) {
    box.low = box.low.min(facets_[i].box.low);
    box.high = box.high.max(facets_[i].box.high);
    centres.low = centres.low.min(facets_[i].box.low + facets_[i].box.high);
    centres.high = centres.high.max(facets_[i].box.low + facets_[i].box.high);
  }
  nodes_[node] = {box, first, count};
  if (count <= kLeafSize) {
    return;
  }
  int axis = 0;
  (centres.high - centres.low).maxCoeff(&axis);
  const auto begin = facets_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [axis](const Facet& a, const Facet& b) {
    return a.box.low[axis] + a.box.high[axis] < b.box.low[axis] + b.box.high[axis];
  });
  const auto children = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].first = children;
  nodes_[node].count = 0;
  split(children, first, count / 2);
  split(children + 1, first + count / 2, count - count / 2);
}

void FacetMesh::meet(const Facet& facet, const Ray& ray, Hit& nearest) const {
  const double towards = facet.normal.dot(ray.direction);
  if (towards == 0.0) {
    return;
  }
  const double range = (facet.offset - facet.normal.dot(ray.origin)) / towards;
  if (!(range > kNearest && range < nearest.range)) {
    return;
  }
  const double u = ray.origin[facet.u_axis] + range * ray.direction[facet.u_axis];
  const double v = ray.origin[facet.v_axis] + range * ray.direction[facet.v_axis];
  if (isInside(facet, u, v)) {
    nearest = {range, std::abs(towards), facet.material};
  }
}

Hit FacetMesh::cast(const Ray& ray, double limit) const {
  Hit nearest;
  nearest.range = limit;
  if (nodes_.empty()) {
    return Hit();
  }
  const Eigen::Array3d inverse = ray.direction.array().inverse();
  const Eigen::Array3d origin = ray.origin.array();
  const auto entry = [&](const Box& box) {  // infinite where the ray misses the box
    const Eigen::Array3d a = (box.low - origin) * inverse;
    const Eigen::Array3d b = (box.high - origin) * inverse;
    const double enter = a.min(b).maxCoeff();
    const double leave = a.max(b).minCoeff();
    const bool is_met = enter <= leave && leave >= 0.0;
    return is_met ? enter : std::numeric_limits<double>::infinity();
  };
  std::array<std::uint32_t, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!(entry(node.box) < nearest.range)) {
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      meet(facets_[i], ray, nearest);
    }
    if (node.count == 0) {
      const bool left_first = entry(nodes_[node.first].box) <= entry(nodes_[node.first + 1].box);
      stack[depth++] = node.first + (left_first ? 1 : 0);
      stack[depth++] = node.first + (left_first ? 0 : 1);
    }
  }
  return nearest.range < limit ? nearest : Hit();
}

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
