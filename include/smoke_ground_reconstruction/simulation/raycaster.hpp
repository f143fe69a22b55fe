#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace smoke_ground_reconstruction {
namespace simulation {

/// A half-line in metres; `direction` has unit length.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

/// The nearest facet a ray meets. `range` is infinite where it meets none.
struct Hit {
  double range = std::numeric_limits<double>::infinity();
  double cos_incidence = 0.0;  ///< |cos| of the angle between ray and facet normal
  std::uint16_t material = 0;

  bool isHit() const { return range < std::numeric_limits<double>::infinity(); }
};

/// Planar polygons with holes, searched through a bounding-volume tree.
///
/// A facet is any number of closed loops in one plane; its inside is decided by the even-odd rule,
/// so a floor with a pit and a wall with a window are one facet each. Both sides of a facet are
/// solid.
class FacetMesh {
 public:
  /// One closed loop: vertices in order, the last joined to the first [m].
  using Loop = std::vector<Eigen::Vector3d>;

  /// \throws std::invalid_argument when the first loop has fewer than three vertices or no area,
  ///         a coordinate is not finite, or a vertex lies off the plane by more than 1e-6 m.
  void addFacet(const std::vector<Loop>& loops, std::uint16_t material);

  /// Sorts the facets into the tree; call once after the last addFacet(). O(n log n).
  void build();

  /// The nearest facet within (1e-9, limit). O(log n) for ordinary rooms.
  Hit cast(const Ray& ray, double limit = std::numeric_limits<double>::infinity()) const;

  std::size_t size() const { return facets_.size(); }

 private:
  struct Edge {
    double u, v_low, v_high, slope;  // slope = du / dv
  };
  struct Box {
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Array3d high = Eigen::Array3d::Constant(-std::numeric_limits<double>::infinity());
  };
  struct Facet {
    Eigen::Vector3d normal;
    double offset;
    int u_axis, v_axis;
    std::uint32_t edge_begin, edge_end;
    std::uint16_t material;
    Box box;
  };
  struct Node {
    Box box;
    std::uint32_t first, count;  // leaf: facets [first, first + count); inner: children first, +1
  };

  bool isInside(const Facet& facet, double u, double v) const;
  void addEdges(const Loop& loop, const Facet& facet);
  void split(std::uint32_t node, std::uint32_t first, std::uint32_t count);
  void meet(const Facet& facet, const Ray& ray, Hit& nearest) const;

  std::vector<Facet> facets_;
  std::vector<Edge> edges_;
  std::vector<Node> nodes_;
};

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
