#include "arrays.hpp"
#include "bindings.hpp"
#include "enum_property.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"
#ifdef SMOKE_GROUND_HAVE_PCL
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#endif

namespace smoke_ground_reconstruction {

namespace {

void bindParams(py::module& m) {
  py::class_<ReconstructorParams> reconstructor(m, "ReconstructorParams",
                                                "Parameters of cfg/Reconstructor.cfg.");
  reconstructor.def(py::init<>())
      .def_readwrite("sensor_height", &ReconstructorParams::sensor_height)
      .def_readwrite("occupancy_resolution", &ReconstructorParams::occupancy_resolution)
      .def_readwrite("polar_segments", &ReconstructorParams::polar_segments)
      .def_readwrite("room_boundary", &ReconstructorParams::room_boundary)
      .def("validate", &ReconstructorParams::validate);
  defineEnum(reconstructor, "method", &ReconstructorParams::method);
  py::class_<SegmenterParams>(m, "SegmenterParams")
      .def(py::init<>())
      .def_readwrite("segmentation", &SegmenterParams::segmentation)
      .def_readwrite("clustering", &SegmenterParams::clustering);
  py::class_<PipelineParams>(m, "PipelineParams")
      .def(py::init<>())
      .def_readwrite("denoiser", &PipelineParams::denoiser)
      .def_readwrite("segmenter", &PipelineParams::segmenter)
      .def_readwrite("reconstructor", &PipelineParams::reconstructor);
}

void bindResult(py::module& m) {
  using Result = PipelineResult;
  py::class_<Result>(m, "PipelineResult")
      .def_property_readonly("labels",
                             [](const Result& r) { return toArray<std::uint8_t>(r.labels); })
      .def_property_readonly("clusters",
                             [](const Result& r) { return toArray<std::uint32_t>(r.clusters); })
      .def_readonly("surface", &Result::surface)
      .def_readonly("occupancy", &Result::occupancy)
      .def_readonly("visibility", &Result::visibility)
      .def_property_readonly(
          "times",
          [](const Result& r) {
            py::dict times;
            for (const StageTime& time : r.times) times[time.stage] = time.milliseconds;
            return times;
          },
          "Milliseconds of wall time per stage.");
}

}  // namespace

Engines availableEngines() {
#ifdef SMOKE_GROUND_HAVE_PCL
  return pclEngines();
#else
  return {};
#endif
}

void bindPipeline(py::module& m) {
#ifdef SMOKE_GROUND_HAVE_PCL
  m.attr("HAVE_PCL") = true;
#else
  m.attr("HAVE_PCL") = false;
#endif
  bindParams(m);
  bindResult(m);
  py::class_<Pipeline>(m, "Pipeline", "The stages in order, in one thread.")
      .def(py::init([](const PipelineParams& params) {
             return std::make_unique<Pipeline>(params, availableEngines());
           }),
           py::arg("params"))
      .def_property(
          "sensor", [](Pipeline& self) { return self.sensor(); },
          [](Pipeline& self, const SensorModel& sensor) { self.sensor() = sensor; },
          "The beams (a copy); set it to seed a known sensor.")
      .def(
          "process",
          [](Pipeline& self, const py::array& xyz, const py::array& intensity,
             const py::array& ring, const Mounting& mounting) {
            const ScanView view = viewOf(xyz, intensity, ring);
            const py::gil_scoped_release release;
            return self.process(view, mounting);
          },
          py::arg("xyz"), py::arg("intensity"), py::arg("ring"), py::arg("mounting"),
          "xyz float32 (N, 3) [m], intensity float32 (N,), ring uint16 (N,).");
}

}  // namespace smoke_ground_reconstruction
