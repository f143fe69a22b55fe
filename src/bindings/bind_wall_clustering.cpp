#include "arrays.hpp"
#include "bindings.hpp"
#include "enum_property.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {

namespace {

void bindParams(py::module& m) {
  using Params = WallClusteringParams;
  py::class_<Params> params(m, "WallClusteringParams", "Parameters of cfg/Segmenter.cfg.");
  params.def(py::init<>())
      .def_readwrite("cluster_tolerance", &Params::cluster_tolerance)
      .def_readwrite("cluster_tolerance_per_range", &Params::cluster_tolerance_per_range)
      .def_readwrite("min_cluster_size", &Params::min_cluster_size)
      .def_readwrite("max_cluster_size", &Params::max_cluster_size)
      .def("validate", &Params::validate);
  defineEnum(params, "cluster_engine", &Params::cluster_engine);
}

}  // namespace

void bindWallClustering(py::module& m) {
  bindParams(m);
  m.attr("NO_CLUSTER") = kNoCluster;
  py::class_<WallClustering>(m, "WallClustering", "Euclidean clustering of wall points.")
      .def(py::init([](const WallClusteringParams& params) {
             return WallClustering(params, availableEngines().kdtree_clustering);
           }),
           py::arg("params"))
      .def(
          "cluster",
          [](const WallClustering& self, const py::array& xyz, const py::array& labels,
             const Mounting& mounting) {
            const ScanView view = viewOf(xyz);
            const auto wall_labels = labelsOf(labels, view.size);
            std::vector<std::uint32_t> clusters;
            {
              const py::gil_scoped_release release;
              clusters = self.cluster(Scan(view, mounting), wall_labels);
            }
            return toArray<std::uint32_t>(std::move(clusters));
          },
          py::arg("xyz"), py::arg("labels"), py::arg("mounting") = Mounting(),
          "Cluster numbers uint32 (N,), NO_CLUSTER where a point belongs to none.");
}

}  // namespace smoke_ground_reconstruction
