#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "smoke_ground_reconstruction/azimuth_bins.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

namespace {

void bindMounting(py::module& m) {
  py::class_<Mounting>(m, "Mounting",
                       "How the sensor is mounted: rotation that levels it (9 numbers, row by row, "
                       "of R_level_sensor) and height above the floor [m].")
      .def(py::init([](const std::array<double, 9>& rotation, double sensor_height) {
             Mounting mounting;
             mounting.rotation = rotation;
             mounting.sensor_height = sensor_height;
             return mounting;
           }),
           py::arg("rotation") = Mounting().rotation,
           py::arg("sensor_height") = Mounting().sensor_height)
      .def_readwrite("rotation", &Mounting::rotation)
      .def_readwrite("sensor_height", &Mounting::sensor_height);
}

void bindSensorModel(py::module& m) {
  py::class_<SensorModel>(m, "SensorModel", "Order of a sensor's rings by elevation.")
      .def(py::init<>())
      .def_static("from_elevations", &SensorModel::fromElevations, py::arg("elevation_deg"),
                  "Known beams: elevation per ring number [deg].")
      .def(
          "observe",
          [](SensorModel& self, const py::array& xyz, const py::array& ring) {
            ScanView view = viewOf(xyz);
            view.ring = fieldOf<std::uint16_t>(ring, "ring", view.size);
            const py::gil_scoped_release release;
            self.observe(view);
          },
          py::arg("xyz"), py::arg("ring"))
      .def("rank", &SensorModel::rank, py::arg("ring"))
      .def(
          "tangent",
          [](const SensorModel& self, std::uint16_t ring) {
            if (self.rank(ring) == SensorModel::kNoRank) {
              throw py::value_error("ring " + std::to_string(ring) + " was never seen");
            }
            return self.tangent(ring);
          },
          py::arg("ring"))
      .def_property_readonly("rings_by_elevation", [](const SensorModel& self) {
        return toArray<std::uint16_t>(self.ringsByElevation());
      });
}

}  // namespace

void bindScan(py::module& m) {
  bindMounting(m);
  bindSensorModel(m);
  py::class_<AzimuthBins>(m, "AzimuthBins", "Equal bins of azimuth from +x, counter-clockwise.")
      .def(py::init<double>(), py::arg("width_deg"))
      .def_property_readonly("count", &AzimuthBins::count)
      .def("index", &AzimuthBins::index, py::arg("x"), py::arg("y"));
  m.def(
      "rings_from_elevation",
      [](const py::array& xyz) {
        const ScanView view = viewOf(xyz);
        std::vector<std::uint16_t> rings;
        {
          const py::gil_scoped_release release;
          rings = ringsFromElevation(view);
        }
        return toArray<std::uint16_t>(std::move(rings));
      },
      py::arg("xyz"), "Ring numbers uint16 (N,) for a cloud without them; xyz float32 (N, 3).");
}

}  // namespace smoke_ground_reconstruction
