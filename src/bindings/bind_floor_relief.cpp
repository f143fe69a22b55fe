#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "smoke_ground_reconstruction/floor_relief.hpp"

namespace smoke_ground_reconstruction {

namespace {

/// Returns with places of their own.
struct PlacedReturns {
  Points points;
  UprightReturns returns;
  std::vector<std::uint32_t> all;
};

void place(const py::array& xy, const py::array& height, const py::array& planar,
           PlacedReturns* to) {
  requireArray<float>(xy, "xy", "(N, 2)", 2);
  if (xy.shape(1) != 2) throw py::value_error("xy must be (N, 2)");
  const auto size = static_cast<std::size_t>(xy.shape(0));
  const auto places = py::array_t<float>(xy).unchecked<2>();
  const auto heights = fieldOf<float>(height, "height", size);
  const auto ranges = fieldOf<float>(planar, "planar", size);
  for (std::size_t i = 0; i < size; ++i) {
    const auto row = static_cast<py::ssize_t>(i);
    to->points.push(places(row, 0), places(row, 1), 0.0F);
    to->returns.height.push_back(heights[i]);
    to->returns.planar.push_back(ranges[i]);
    to->all.push_back(static_cast<std::uint32_t>(i));
  }
  to->returns.points = &to->points;
}

/// One value per place float64 (N, 2).
template <typename T, typename Function>
py::array_t<T> atPlaces(const py::array& xy, const Function& function) {
  requireArray<double>(xy, "xy", "(N, 2)", 2);
  if (xy.shape(1) != 2) throw py::value_error("xy must be (N, 2)");
  const auto places = py::array_t<double>(xy).unchecked<2>();
  std::vector<T> values;
  for (py::ssize_t i = 0; i < places.shape(0); ++i) {
    values.push_back(static_cast<T>(function(i, places(i, 0), places(i, 1))));
  }
  return toArray<T>(std::move(values));
}

/// From places and heights float64 (N, 3).
std::vector<ReliefPlace> toPlaces(const py::array& places, const char* name) {
  requireArray<double>(places, name, "(N, 3)", 2);
  if (places.shape(1) != 3) throw py::value_error(std::string(name) + " must be (N, 3)");
  const auto values = py::array_t<double>(places).unchecked<2>();
  std::vector<ReliefPlace> found;
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    found.push_back({values(i, 0), values(i, 1), values(i, 2)});
  }
  return found;
}

}  // namespace

void bindFloorRelief(py::module& m) {
  using Relief = FloorRelief;
  py::class_<Relief>(m, "FloorRelief", "What of the floor is not on its plane.")
      .def(py::init<>())
      .def(
          "find",
          [](Relief& self, const py::array& xy, const py::array& height, const py::array& planar) {
            PlacedReturns placed;
            place(xy, height, planar, &placed);
            const py::gil_scoped_release release;
            self.find(placed.returns, placed.all);
          },
          py::arg("xy"), py::arg("height"), py::arg("planar"),
          "From places float32 (N, 2), heights over the plane and planar ranges float32 (N,) [m].")
      .def(
          "fit_ramp",
          [](Relief& self, const py::array& floor, const py::array& feet,
             const std::vector<std::array<double, 2>>& normals) {
            self.fitRamp(toPlaces(floor, "floor"), toPlaces(feet, "feet"), normals);
          },
          py::arg("floor"), py::arg("feet"), py::arg("normals"),
          "Fits the only slope to places and heights float64 (N, 3) [m].")
      .def("is_flat", &Relief::isFlat)
      .def(
          "at",
          [](Relief& self, const py::array& xy) {
            return atPlaces<double>(xy,
                                    [&](py::ssize_t, double x, double y) { return self.at(x, y); });
          },
          py::arg("xy"), "Floor over the plane float64 (N,) at places float64 (N, 2) [m].")
      .def(
          "sigma",
          [](Relief& self, const py::array& xy) {
            return atPlaces<double>(
                xy, [&](py::ssize_t, double x, double y) { return self.sigma(x, y); });
          },
          py::arg("xy"), "One sigma of `at` float64 (N,) [m].")
      .def(
          "carries",
          [](Relief& self, const py::array& xy, const py::array& height) {
            const auto over =
                fieldOf<double>(height, "height", static_cast<std::size_t>(xy.shape(0)));
            return atPlaces<std::uint8_t>(xy, [&](py::ssize_t i, double x, double y) {
              return self.carries(x, y, over[static_cast<std::size_t>(i)]) ? 1 : 0;
            });
          },
          py::arg("xy"), py::arg("height"),
          "Which returns lie on floor off the plane, uint8 (N,); height float64 (N,) [m].")
      .def(
          "is_riser",
          [](const Relief& self, const py::array& xy, const py::array& height) {
            const auto over =
                fieldOf<double>(height, "height", static_cast<std::size_t>(xy.shape(0)));
            return atPlaces<std::uint8_t>(xy, [&](py::ssize_t i, double x, double y) {
              return self.isRiser(x, y, over[static_cast<std::size_t>(i)]) ? 1 : 0;
            });
          },
          py::arg("xy"), py::arg("height"), "Which returns are the step's riser, uint8 (N,).");
}

}  // namespace smoke_ground_reconstruction
