#include "smoke_ground_reconstruction/pcl/engines.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

#include <cmath>

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Tree = pcl::search::KdTree<pcl::PointXYZ>;

/// Trees compare in single precision: ask for a radius that no rounding can undercut, and decide
/// afterwards. Single precision errs by about 1e-7 of the coordinates, and squares below 1e-19 m
/// vanish in it.
double widened(double radius, double range) { return radius * (1.0 + 1e-5) + 1e-6 * range + 1e-15; }

Cloud::Ptr cloudOf(const Scan& scan, const std::vector<std::uint32_t>& points) {
  Cloud::Ptr cloud(new Cloud);
  cloud->reserve(points.size());
  for (const std::uint32_t i : points) {
    cloud->push_back(pcl::PointXYZ(scan.x[i], scan.y[i], scan.z[i]));
  }
  return cloud;
}

std::vector<std::uint32_t> validPoints(const Scan& scan) {
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    if (scan.valid[i] != 0) points.push_back(i);
  }
  return points;
}

class KdTreeCounter : public NeighborCounter {
 public:
  explicit KdTreeCounter(const Scan& scan)
      : NeighborCounter(scan), points_(validPoints(scan)), tree_(false) {
    if (!points_.empty()) tree_.setInputCloud(cloudOf(scan, points_));
  }

  std::size_t count(std::size_t index, double squared_radius, std::size_t limit) const override {
    if (!(squared_radius > 0.0)) return 0;
    const float x = scan_.x[index];
    const float y = scan_.y[index];
    const float z = scan_.z[index];
    pcl::Indices found;
    std::vector<float> squared_distances;
    tree_.radiusSearch(pcl::PointXYZ(x, y, z), widened(std::sqrt(squared_radius), range(x, y, z)),
                       found, squared_distances);
    std::size_t neighbors = 0;
    for (const int entry : found) {
      const std::uint32_t other = points_[static_cast<std::size_t>(entry)];
      if (other == index) continue;
      const double d2 = squaredDistance(scan_.x[other], scan_.y[other], scan_.z[other], x, y, z);
      if (d2 < squared_radius && ++neighbors == limit) break;
    }
    return neighbors;
  }

 private:
  std::vector<std::uint32_t> points_;
  Tree tree_;
};

/// The KD-tree as EuclideanClusterExtraction asks it, its answers held to areLinked().
class LinkSearch : public Tree {
 public:
  explicit LinkSearch(const WallClusteringParams& params) : Tree(false), params_(params) {}

  using Tree::radiusSearch;

  int radiusSearch(const pcl::PointXYZ& point, double /*tolerance*/, pcl::Indices& found,
                   std::vector<float>& squared_distances, unsigned int max_nn) const override {
    const double r = range(point.x, point.y, point.z);
    const double tolerance = params_.cluster_tolerance + params_.cluster_tolerance_per_range * r;
    Tree::radiusSearch(point, widened(tolerance, r), found, squared_distances, max_nn);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < found.size(); ++k) {
      const pcl::PointXYZ& other = (*getInputCloud())[static_cast<std::size_t>(found[k])];
      if (!areLinked(params_, {point.x, point.y, point.z}, {other.x, other.y, other.z})) continue;
      found[kept] = found[k];
      squared_distances[kept++] = squared_distances[k];
    }
    found.resize(kept);
    squared_distances.resize(kept);
    return static_cast<int>(kept);
  }

 private:
  const WallClusteringParams& params_;
};

}  // namespace

std::unique_ptr<NeighborCounter> makeKdTreeCounter(const Scan& scan) {
  return std::make_unique<KdTreeCounter>(scan);
}

std::vector<std::uint32_t> findComponentsWithPcl(const WallClusteringParams& params,
                                                 const Scan& scan,
                                                 const std::vector<std::uint32_t>& points) {
  const Cloud::Ptr cloud = cloudOf(scan, points);
  const Tree::Ptr tree(new LinkSearch(params));
  tree->setInputCloud(cloud);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(params.cluster_tolerance);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(cloud);
  std::vector<pcl::PointIndices> clusters;
  extraction.extract(clusters);  // sizes are judged by WallClustering
  std::vector<std::uint32_t> component(points.size(), 0);
  for (std::uint32_t c = 0; c < clusters.size(); ++c) {
    for (const int entry : clusters[c].indices) component[static_cast<std::size_t>(entry)] = c;
  }
  return component;
}

Engines pclEngines() { return {makeKdTreeCounter, findComponentsWithPcl}; }

}  // namespace smoke_ground_reconstruction
