#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "smoke_ground_reconstruction/room_boundary.hpp"

namespace smoke_ground_reconstruction {

namespace {

Points pointsOf(const py::array& xyz) {
  const ScanView view = viewOf(xyz);
  Points points;
  for (std::size_t i = 0; i < view.size; ++i) points.push(view.x[i], view.y[i], view.z[i]);
  return points;
}

void bindParams(py::module& m) {
  using Params = RoomBoundaryParams;
  py::class_<Params>(m, "RoomBoundaryParams", "Parameters of cfg/Reconstructor.cfg.")
      .def(py::init<>())
      .def_readwrite("max_floor_tilt_deg", &Params::max_floor_tilt_deg)
      .def_readwrite("max_height_deviation", &Params::max_height_deviation)
      .def_readwrite("floor_tolerance", &Params::floor_tolerance)
      .def_readwrite("max_slope", &Params::max_slope)
      .def_readwrite("max_step_height", &Params::max_step_height)
      .def_readwrite("drop_depth", &Params::drop_depth)
      .def_readwrite("smoke_gate", &Params::smoke_gate)
      .def_readwrite("min_wall_height", &Params::min_wall_height)
      .def_readwrite("furniture_height", &Params::furniture_height)
      .def_readwrite("max_bridge_ratio", &Params::max_bridge_ratio)
      .def_readwrite("max_range", &Params::max_range)
      .def_readwrite("cell_size", &Params::cell_size)
      .def("validate", &Params::validate);
}

void bindFloor(py::module& m) {
  py::class_<FloorModel>(m, "FloorModel", "The plane z = a x + b y + c in the level frame.")
      .def_readonly("plane", &FloorModel::plane)
      .def_readonly("covariance", &FloorModel::covariance)
      .def_readonly("weight", &FloorModel::weight)
      .def_readonly("noise", &FloorModel::noise)
      .def_readonly("uneven", &FloorModel::uneven)
      .def_property_readonly("source",
                             [](const FloorModel& f) { return static_cast<int>(f.source); })
      .def_readonly("height_error", &FloorModel::height_error)
      .def("sigma", &FloorModel::sigma, py::arg("x"), py::arg("y"));
  m.def(
      "fit_floor",
      [](const py::array& xyz, double sensor_height) {
        const Points points = pointsOf(xyz);
        const py::gil_scoped_release release;
        return FloorFitter().fit(points, sensor_height, nullptr);
      },
      py::arg("xyz"), py::arg("sensor_height"), "xyz float32 (N, 3), level frame [m].");
}

void bindResult(py::module& m) {
  using Result = RoomBoundaryResult;
  py::class_<Result>(m, "RoomBoundaryResult", "The floor and what it was made from.")
      .def_readonly("surface", &Result::surface)
      .def_readonly("floor", &Result::floor)
      .def_property_readonly("extinction", [](const Result& r) { return r.visibility.extinction; })
      .def_property_readonly("labels",
                             [](const Result& r) { return toArray<std::uint8_t>(r.labels); })
      .def_property_readonly("limit", [](const Result& r) { return toArray<double>(r.limit); })
      .def_property_readonly("distance",
                             [](const Result& r) { return toArray<double>(r.profile.distance); })
      .def_property_readonly("kind",
                             [](const Result& r) { return toArray<std::uint8_t>(r.profile.kind); })
      .def_property_readonly("line",
                             [](const Result& r) { return toArray<std::int32_t>(r.profile.line); })
      .def_property_readonly("drop_begin",
                             [](const Result& r) { return toArray<double>(r.drops.begin); })
      .def_property_readonly("drop_end",
                             [](const Result& r) { return toArray<double>(r.drops.end); });
}

}  // namespace

void bindRoomBoundary(py::module& m) {
  bindParams(m);
  bindFloor(m);
  bindResult(m);
  py::class_<RoomBoundary>(m, "RoomBoundary",
                           "The room's boundary per column; keeps the last good floor plane.")
      .def(py::init<const RoomBoundaryParams&>(), py::arg("params") = RoomBoundaryParams())
      .def("set_params", &RoomBoundary::setParams, py::arg("params"), "From the next scan on.")
      .def(
          "reconstruct",
          [](RoomBoundary& self, const py::array& xyz, const py::array& intensity,
             const py::array& ring, const SensorModel& sensor, const Mounting& mounting) {
            const ScanView scan = viewOf(xyz, intensity, ring);
            const py::gil_scoped_release release;
            RoomBoundaryResult result;
            self.reconstruct(scan, sensor, mounting, &result);
            return result;
          },
          py::arg("xyz"), py::arg("intensity"), py::arg("ring"), py::arg("sensor"),
          py::arg("mounting"));
}

}  // namespace smoke_ground_reconstruction
