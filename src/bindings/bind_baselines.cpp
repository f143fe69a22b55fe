#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/sac_segmentation.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "bindings.hpp"

namespace py = pybind11;

namespace smoke_ground_reconstruction {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Points = py::array_t<float, py::array::c_style>;
using Flags = py::array_t<bool>;

Cloud::Ptr toCloud(const Points& xyz) {
  if (xyz.ndim() != 2 || xyz.shape(1) != 3) {
    throw std::invalid_argument("xyz must be a float32 array of shape (N, 3)");
  }
  const auto point = xyz.unchecked<2>();
  Cloud::Ptr cloud(new Cloud);
  cloud->reserve(static_cast<std::size_t>(point.shape(0)));
  for (py::ssize_t i = 0; i < point.shape(0); ++i) {
    cloud->push_back(pcl::PointXYZ(point(i, 0), point(i, 1), point(i, 2)));
  }
  return cloud;
}

Flags toFlags(const std::vector<int>& indices, std::size_t size) {
  Flags flags(static_cast<py::ssize_t>(size));
  auto flag = flags.mutable_unchecked<1>();
  for (py::ssize_t i = 0; i < flag.shape(0); ++i) flag(i) = false;
  for (const int index : indices) flag(index) = true;
  return flags;
}

void requirePositive(double value, const char* name) {
  if (!(value > 0.0)) {
    throw std::invalid_argument(std::string(name) + " must be positive, not " +
                                std::to_string(value));
  }
}

Flags radiusOutlierRemoval(const Points& xyz, double radius, int min_neighbors) {
  requirePositive(radius, "radius");
  const Cloud::Ptr cloud = toCloud(xyz);
  std::vector<int> kept;
  if (!cloud->empty()) {
    const py::gil_scoped_release release;
    pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
    filter.setInputCloud(cloud);
    filter.setRadiusSearch(radius);
    filter.setMinNeighborsInRadius(min_neighbors);
    filter.filter(kept);
  }
  return toFlags(kept, cloud->size());
}

Flags statisticalOutlierRemoval(const Points& xyz, int mean_k, double std_mul) {
  requirePositive(mean_k, "mean_k");
  const Cloud::Ptr cloud = toCloud(xyz);
  std::vector<int> kept;
  if (!cloud->empty()) {
    const py::gil_scoped_release release;
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
    filter.setInputCloud(cloud);
    filter.setMeanK(mean_k);
    filter.setStddevMulThresh(std_mul);
    filter.filter(kept);
  }
  return toFlags(kept, cloud->size());
}

py::tuple ransacPlane(const Points& xyz, double distance, int iterations) {
  requirePositive(distance, "distance");
  requirePositive(iterations, "iterations");
  const Cloud::Ptr cloud = toCloud(xyz);
  pcl::ModelCoefficients plane;
  pcl::PointIndices inliers;
  if (cloud->size() >= 3) {
    const py::gil_scoped_release release;
    pcl::SACSegmentation<pcl::PointXYZ> segmentation;  // seeded alike every time
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setOptimizeCoefficients(true);
    segmentation.setDistanceThreshold(distance);
    segmentation.setMaxIterations(iterations);
    segmentation.setInputCloud(cloud);
    segmentation.segment(inliers, plane);
  }
  py::tuple coefficients(plane.values.size());
  for (std::size_t i = 0; i < plane.values.size(); ++i) coefficients[i] = plane.values[i];
  return py::make_tuple(coefficients, toFlags(inliers.indices, cloud->size()));
}

}  // namespace

void bindBaselines(py::module& m) {
  py::module baselines = m.def_submodule("baselines", "PCL's own filters, to compare with.");
  baselines.def("radius_outlier_removal", &radiusOutlierRemoval, py::arg("xyz").noconvert(),
                py::arg("radius"), py::arg("min_neighbors"), R"(
Points that have at least min_neighbors others within the radius: pcl::RadiusOutlierRemoval.

Args:
    xyz: (N, 3) float32, finite [m].
    radius: [m].
    min_neighbors: the point itself not counted.

Returns:
    (N,) bool, True where kept.

Raises:
    ValueError: wrong shape, or a parameter that is not positive.
)");
  baselines.def("statistical_outlier_removal", &statisticalOutlierRemoval,
                py::arg("xyz").noconvert(), py::arg("mean_k"), py::arg("std_mul"), R"(
Points whose mean distance to mean_k neighbours is at most the cloud's mean of that distance plus
std_mul standard deviations: pcl::StatisticalOutlierRemoval.

Args:
    xyz: (N, 3) float32, finite [m].
    mean_k: number of neighbours.
    std_mul: number of standard deviations.

Returns:
    (N,) bool, True where kept.

Raises:
    ValueError: wrong shape, or a parameter that is not positive.
)");
  baselines.def("ransac_plane", &ransacPlane, py::arg("xyz").noconvert(), py::arg("distance"),
                py::arg("iterations"), R"(
The plane with most points near it: pcl::SACSegmentation, RANSAC, refined on its inliers.

Args:
    xyz: (N, 3) float32, finite [m].
    distance: of an inlier from the plane [m].
    iterations: at most.

Returns:
    (a, b, c, d) of a x + b y + c z + d = 0, empty if there is no plane, and (N,) bool inliers.

Raises:
    ValueError: wrong shape, or a parameter that is not positive.
)");
}

}  // namespace smoke_ground_reconstruction
