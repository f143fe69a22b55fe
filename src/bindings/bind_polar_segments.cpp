#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "enum_property.hpp"
#include "smoke_ground_reconstruction/occupancy.hpp"
#include "smoke_ground_reconstruction/polar_segments.hpp"

namespace smoke_ground_reconstruction {

namespace {

py::array_t<float> interleaved(const FloorSurface& surface) {
  std::vector<float> xyz(3 * surface.size());
  for (std::size_t i = 0; i < surface.size(); ++i) {
    xyz[3 * i] = surface.x[i];
    xyz[3 * i + 1] = surface.y[i];
    xyz[3 * i + 2] = surface.z[i];
  }
  return toArray<float>(std::move(xyz), {static_cast<py::ssize_t>(surface.size()), 3});
}

void bindSurface(py::module& m) {
  using Surface = FloorSurface;
  py::class_<Surface>(m, "FloorSurface", "The floor; arrays with one entry per point, copies.")
      .def_property_readonly("xyz", &interleaved)
      .def_property_readonly("intensity",
                             [](const Surface& s) { return toArray<float>(s.intensity); })
      .def_property_readonly("ring",
                             [](const Surface& s) { return toArray<std::uint16_t>(s.ring); })
      .def_property_readonly("provenance",
                             [](const Surface& s) { return toArray<std::uint8_t>(s.provenance); })
      .def_property_readonly("confidence",
                             [](const Surface& s) { return toArray<float>(s.confidence); })
      .def_property_readonly("sigma", [](const Surface& s) { return toArray<float>(s.sigma); })
      .def_property_readonly("boundary",
                             [](const Surface& s) {
                               const auto n = static_cast<py::ssize_t>(s.boundary.vertices.size());
                               return toArray<float>(s.boundary.vertices, {n, 3});
                             })
      .def_property_readonly(
          "boundary_kind", [](const Surface& s) { return toArray<std::uint8_t>(s.boundary.kinds); })
      .def_readonly("floor_plane", &Surface::floor_plane);
}

void bindOccupancy(py::module& m) {
  using Grid = OccupancyGrid;
  py::class_<Grid>(m, "OccupancyGrid", "Cells (height, width) int8 in the level frame.")
      .def_readonly("resolution", &Grid::resolution)
      .def_readonly("first_column", &Grid::first_column)
      .def_readonly("first_row", &Grid::first_row)
      .def_property_readonly("cells", [](const Grid& grid) {
        return toArray<std::int8_t>(grid.cells, {static_cast<py::ssize_t>(grid.height),
                                                 static_cast<py::ssize_t>(grid.width)});
      });
  m.def(
      "rasterize",
      [](const FloorSurface& surface, const py::array& walls_xyz, const Mounting& mounting,
         double resolution, double max_range) {
        const ScanView walls = viewOf(walls_xyz);
        const py::gil_scoped_release release;
        return rasterize(surface, walls, mounting, resolution, max_range);
      },
      py::arg("surface"), py::arg("walls_xyz"), py::arg("mounting"), py::arg("resolution"),
      py::arg("max_range") = 50.0);
}

void bindParams(py::module& m) {
  using Params = PolarSegmentsParams;
  py::class_<Params> params(m, "PolarSegmentsParams", "Parameters of cfg/Reconstructor.cfg.");
  params.def(py::init<>())
      .def_readwrite("segment_angle_deg", &Params::segment_angle_deg)
      .def_readwrite("horizontal_resolution_deg", &Params::horizontal_resolution_deg)
      .def_readwrite("reconstruction_gain", &Params::reconstruction_gain)
      .def_readwrite("min_wall_points", &Params::min_wall_points)
      .def_readwrite("height_difference_threshold", &Params::height_difference_threshold)
      .def_readwrite("max_elevation_angle_deg", &Params::max_elevation_angle_deg)
      .def("validate", &Params::validate);
  defineEnum(params, "wall_distance", &Params::wall_distance);
}

}  // namespace

void bindPolarSegments(py::module& m) {
  bindSurface(m);
  bindOccupancy(m);
  bindParams(m);
  py::class_<PolarSegments>(m, "PolarSegments",
                            "Reconstruction on a polar grid (thesis, Algorithms 3 and 5).")
      .def(py::init<const PolarSegmentsParams&>(), py::arg("params"))
      .def(
          "reconstruct",
          [](const PolarSegments& self, const py::array& ground_xyz,
             const py::array& ground_intensity, const py::array& ground_ring,
             const py::array& walls_xyz, const py::array& walls_ring, const SensorModel& sensor,
             const Mounting& mounting) {
            const ScanView ground = viewOf(ground_xyz, ground_intensity, ground_ring);
            ScanView walls = viewOf(walls_xyz);
            walls.ring = fieldOf<std::uint16_t>(walls_ring, "walls_ring", walls.size);
            const py::gil_scoped_release release;
            return self.reconstruct(ground, walls, sensor, mounting);
          },
          py::arg("ground_xyz"), py::arg("ground_intensity"), py::arg("ground_ring"),
          py::arg("walls_xyz"), py::arg("walls_ring"), py::arg("sensor"), py::arg("mounting"));
}

}  // namespace smoke_ground_reconstruction
