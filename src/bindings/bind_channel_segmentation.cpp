#include "arrays.hpp"
#include "bindings.hpp"
#include "enum_property.hpp"
#include "smoke_ground_reconstruction/channel_segmentation.hpp"

namespace smoke_ground_reconstruction {

namespace {

void bindParams(py::module& m) {
  using Params = ChannelSegmentationParams;
  py::class_<Params> params(m, "ChannelSegmentationParams", "Parameters of cfg/Segmenter.cfg.");
  params.def(py::init<>())
      .def_readwrite("column_width_deg", &Params::column_width_deg)
      .def_readwrite("min_ground_angle_deg", &Params::min_ground_angle_deg)
      .def_readwrite("max_ground_angle_deg", &Params::max_ground_angle_deg)
      .def_readwrite("max_ground_step_height", &Params::max_ground_step_height)
      .def_readwrite("ground_relative_margin", &Params::ground_relative_margin)
      .def_readwrite("min_wall_angle_deg", &Params::min_wall_angle_deg)
      .def_readwrite("max_wall_angle_deg", &Params::max_wall_angle_deg)
      .def_readwrite("max_wall_step_height", &Params::max_wall_step_height)
      .def_readwrite("wall_relative_margin", &Params::wall_relative_margin)
      .def_readwrite("min_range_step", &Params::min_range_step)
      .def_readwrite("relative_distance_margin", &Params::relative_distance_margin)
      .def("validate", &Params::validate);
  defineEnum(params, "ground_range_step", &Params::ground_range_step);
  defineEnum(params, "wall_range_step", &Params::wall_range_step);
  defineEnum(params, "label_point", &Params::label_point);
}

}  // namespace

void bindChannelSegmentation(py::module& m) {
  bindParams(m);
  py::class_<ChannelSegmentation>(m, "ChannelSegmentation",
                                  "Ground and wall segmentation (thesis, Algorithm 4).")
      .def(py::init<const ChannelSegmentationParams&>(), py::arg("params"))
      .def(
          "classify",
          [](const ChannelSegmentation& self, const py::array& xyz, const py::array& ring,
             const py::array& labels, const SensorModel& sensor, const Mounting& mounting) {
            ScanView view = viewOf(xyz);
            view.ring = fieldOf<std::uint16_t>(ring, "ring", view.size);
            auto result = labelsOf(labels, view.size);
            {
              const py::gil_scoped_release release;
              result = self.classify(Scan(view, mounting), result, sensor);
            }
            return toArray<std::uint8_t>(std::move(result));
          },
          py::arg("xyz"), py::arg("ring"), py::arg("labels"), py::arg("sensor"),
          py::arg("mounting") = Mounting(),
          "Labels uint8 (N,) from the denoiser's labels; xyz float32 (N, 3) [m], ring uint16 "
          "(N,).");
}

}  // namespace smoke_ground_reconstruction
