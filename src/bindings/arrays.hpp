#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <utility>
#include <vector>

#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/scan_view.hpp"

namespace smoke_ground_reconstruction {

namespace py = pybind11;

/// \throws ValueError unless `array` has the element type T and `ndim` axes.
template <typename T>
void requireArray(const py::array& array, const char* name, const char* shape, py::ssize_t ndim) {
  if (!py::isinstance<py::array_t<T>>(array) || array.ndim() != ndim) {
    throw py::value_error(std::string(name) + " must be " + shape + " of " +
                          py::str(py::dtype::of<T>()).template cast<std::string>() + ", is " +
                          py::str(array.dtype()).cast<std::string>() + " with " +
                          std::to_string(array.ndim()) + " axes");
  }
}

template <typename T>
StridedField<T> fieldOf(const py::array& array, const char* name, std::size_t size) {
  requireArray<T>(array, name, "(N,)", 1);
  if (static_cast<std::size_t>(array.shape(0)) != size) {
    throw py::value_error(std::string(name) + " must have one entry per point (" +
                          std::to_string(size) + "), has " + std::to_string(array.shape(0)));
  }
  return {array.data(), array.strides(0)};
}

/// View on xyz float32 (N, 3); any strides.
inline ScanView viewOf(const py::array& xyz) {
  requireArray<float>(xyz, "xyz", "(N, 3)", 2);
  if (xyz.shape(1) != 3) throw py::value_error("xyz must be (N, 3)");
  ScanView view;
  const auto* data = static_cast<const unsigned char*>(xyz.data());
  view.x = {data, xyz.strides(0)};
  view.y = {data + xyz.strides(1), xyz.strides(0)};
  view.z = {data + 2 * xyz.strides(1), xyz.strides(0)};
  view.size = static_cast<std::size_t>(xyz.shape(0));
  // A stage that does not ask for them still finds zeros to copy.
  static const std::uint64_t zero = 0;
  view.intensity = {&zero, 0};
  view.ring = {&zero, 0};
  return view;
}

inline ScanView viewOf(const py::array& xyz, const py::array& intensity, const py::array& ring) {
  ScanView view = viewOf(xyz);
  view.intensity = fieldOf<float>(intensity, "intensity", view.size);
  view.ring = fieldOf<std::uint16_t>(ring, "ring", view.size);
  return view;
}

/// Labels from uint8 (N,).
inline std::vector<Label> labelsOf(const py::array& labels, std::size_t size) {
  const auto field = fieldOf<std::uint8_t>(labels, "labels", size);
  std::vector<Label> result(size);
  for (std::size_t i = 0; i < size; ++i) result[i] = static_cast<Label>(field[i]);
  return result;
}

/// NumPy array that owns the vector's memory, its elements seen as T (an enum's integer, say).
template <typename T, typename Element>
py::array_t<T> toArray(std::vector<Element> values, std::vector<py::ssize_t> shape = {}) {
  static_assert(sizeof(T) <= sizeof(Element) && sizeof(Element) % sizeof(T) == 0, "not a view");
  auto* owned = new std::vector<Element>(std::move(values));
  py::capsule owner(owned, [](void* p) { delete static_cast<std::vector<Element>*>(p); });
  if (shape.empty()) shape = {static_cast<py::ssize_t>(owned->size())};
  return py::array_t<T>(shape, reinterpret_cast<const T*>(owned->data()), owner);
}

}  // namespace smoke_ground_reconstruction
