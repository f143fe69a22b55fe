#include "arrays.hpp"
#include "bindings.hpp"
#include "enum_property.hpp"
#include "smoke_ground_reconstruction/agdor_filter.hpp"

namespace smoke_ground_reconstruction {

namespace {

void bindParams(py::module& m) {
  py::class_<AgdorParams> params(m, "AgdorParams", "Parameters of cfg/Denoiser.cfg.");
  params.def(py::init<>())
      .def_readwrite("intensity_threshold", &AgdorParams::intensity_threshold)
      .def_readwrite("alpha", &AgdorParams::alpha)
      .def_readwrite("theta_deg", &AgdorParams::theta_deg)
      .def_readwrite("min_neighbors", &AgdorParams::min_neighbors)
      .def_readwrite("max_neighbors", &AgdorParams::max_neighbors)
      .def("validate", &AgdorParams::validate);
  defineEnum(params, "theta_unit", &AgdorParams::theta_unit);
  defineEnum(params, "engine", &AgdorParams::engine);
}

}  // namespace

void bindAgdorFilter(py::module& m) {
  bindParams(m);
  py::class_<AgdorFilter>(m, "AgdorFilter", "AGDOR denoiser (thesis, Algorithm 1).")
      .def(py::init([](const AgdorParams& params) {
             return AgdorFilter(params, availableEngines().kdtree_counter);
           }),
           py::arg("params"))
      .def(
          "classify",
          [](const AgdorFilter& self, const py::array& xyz, const py::array& intensity) {
            ScanView view = viewOf(xyz);
            view.intensity = fieldOf<float>(intensity, "intensity", view.size);
            std::vector<Label> labels;
            {
              const py::gil_scoped_release release;
              labels = self.classify(Scan(view));
            }
            return toArray<std::uint8_t>(std::move(labels));
          },
          py::arg("xyz"), py::arg("intensity"),
          "Labels uint8 (N,) of xyz float32 (N, 3) [m] and intensity float32 (N,).");
}

}  // namespace smoke_ground_reconstruction
