#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "smoke_ground_reconstruction/drop_offs.hpp"

namespace smoke_ground_reconstruction {

namespace {

template <typename T>
std::vector<T> copied(const py::array& array, const char* name, std::size_t size) {
  const auto field = fieldOf<T>(array, name, size);
  std::vector<T> values(size);
  for (std::size_t i = 0; i < size; ++i) values[i] = field[i];
  return values;
}

std::vector<Direction> directionsOf(const py::array& directions) {
  requireArray<double>(directions, "directions", "(columns, 2)", 2);
  if (directions.shape(1) != 2) throw py::value_error("directions must be (columns, 2)");
  const auto values = py::array_t<double>(directions).unchecked<2>();
  std::vector<Direction> middle;
  for (py::ssize_t i = 0; i < values.shape(0); ++i) middle.push_back({values(i, 0), values(i, 1)});
  return middle;
}

DropOffReturns returnsOf(const py::array& column, const py::array& planar, const py::array& height,
                         const py::array& is_floor, std::size_t columns) {
  const auto size = static_cast<std::size_t>(column.size());
  DropOffReturns returns{
      copied<std::uint16_t>(column, "column", size), copied<float>(planar, "planar", size),
      copied<float>(height, "height", size), copied<std::uint8_t>(is_floor, "is_floor", size)};
  for (const std::uint16_t c : returns.column) {
    if (c >= columns) throw py::value_error("a column has no direction: " + std::to_string(c));
  }
  return returns;
}

WallFeet feetOf(const py::array& column, const py::array& height, const py::array& distance,
                std::size_t columns) {
  const auto size = static_cast<std::size_t>(column.size());
  WallFeet feet{copied<std::uint16_t>(column, "feet_column", size),
                copied<float>(height, "feet_height", size),
                copied<double>(distance, "distance", columns)};
  for (const std::uint16_t c : feet.column) {
    if (c >= columns) throw py::value_error("a foot has no direction: " + std::to_string(c));
  }
  return feet;
}

}  // namespace

void bindDropOffs(py::module& m) {
  m.def(
      "find_drop_offs",
      [](const py::array& column, const py::array& planar, const py::array& height,
         const py::array& is_floor, double sensor_height, const py::array& directions,
         const std::vector<std::array<double, 2>>& walls, const py::array& feet_column,
         const py::array& feet_height, const py::array& distance, double lift, double widening) {
        DropTolerances by;
        by.lift = lift;
        by.widen(widening);
        const auto middle = directionsOf(directions);
        const auto returns = returnsOf(column, planar, height, is_floor, middle.size());
        const auto feet = feetOf(feet_column, feet_height, distance, middle.size());
        DropOffs drops;
        {
          const py::gil_scoped_release release;
          DropOffFinder().find(returns, sensor_height, middle, walls, feet, by, &drops);
        }
        return py::make_tuple(toArray<double>(std::move(drops.begin)),
                              toArray<double>(std::move(drops.end)),
                              toArray<double>(std::move(drops.floor_to)),
                              toArray<std::uint8_t>(std::move(drops.is_doubted)));
      },
      py::arg("column"), py::arg("planar"), py::arg("height"), py::arg("is_floor"),
      py::arg("sensor_height"), py::arg("directions"), py::arg("walls"), py::arg("feet_column"),
      py::arg("feet_height"), py::arg("distance"), py::arg("lift") = 0.0, py::arg("widening") = 1.0,
      "Begin, end and floor_to float64 (columns,) [m] and is_doubted uint8 (columns,), from column "
      "uint16 (N,), planar and height "
      "float32 (N,), is_floor uint8 (N,), directions float64 (columns, 2); of the walls' feet "
      "column uint16 (F,), "
      "height float32 (F,), and distance float64 (columns,); lift [m2] and widening of the "
      "tolerances.");
}

}  // namespace smoke_ground_reconstruction
