#include "arrays.hpp"
#include "bindings.hpp"
#include "smoke_ground_reconstruction/visibility.hpp"

namespace smoke_ground_reconstruction {
namespace {

Visibility estimate(VisibilityEstimator& estimator, const py::array& wall, const py::array& ranges,
                    const py::array& intensity, const py::array& cosine) {
  requireArray<std::int32_t>(wall, "wall", "(N,)", 1);
  const auto size = static_cast<std::size_t>(wall.shape(0));
  const auto walls = fieldOf<std::int32_t>(wall, "wall", size);
  const auto range = fieldOf<double>(ranges, "ranges", size);
  const auto light = fieldOf<double>(intensity, "intensity", size);
  const auto incidence = fieldOf<double>(cosine, "cosine", size);
  WallLight returns;
  for (std::size_t i = 0; i < size; ++i) {
    returns.push(walls[i], range[i], light[i], incidence[i]);
  }
  return estimator.estimate(returns);
}

}  // namespace

void bindVisibility(py::module& m) {
  py::class_<Visibility>(m, "Visibility", "What the smoke lets through.")
      .def_readonly("extinction", &Visibility::extinction)
      .def_readonly("sigma", &Visibility::sigma)
      .def_property_readonly("meteorological_range", &Visibility::meteorologicalRange);
  py::class_<VisibilityEstimator>(m, "VisibilityEstimator", "Extinction from the walls of scans.")
      .def(py::init<>())
      .def_property_readonly("clear_level", &VisibilityEstimator::clearLevel)
      .def("estimate", &estimate, py::arg("wall"), py::arg("ranges"), py::arg("intensity"),
           py::arg("cosine"));
}

}  // namespace smoke_ground_reconstruction
