#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "bindings.hpp"
#include "smoke_ground_reconstruction/pcl/pcd_io.hpp"

namespace py = pybind11;

namespace smoke_ground_reconstruction {
namespace {

const std::pair<PcdType, const char*> kTypeNames[] = {
    {PcdType::kInt8, "int8"},       {PcdType::kUint8, "uint8"},     {PcdType::kInt16, "int16"},
    {PcdType::kUint16, "uint16"},   {PcdType::kInt32, "int32"},     {PcdType::kUint32, "uint32"},
    {PcdType::kFloat32, "float32"}, {PcdType::kFloat64, "float64"},
};

py::dtype dtypeOf(PcdType type) {
  for (const auto& known : kTypeNames) {
    if (known.first == type) return py::dtype(known.second);
  }
  throw std::invalid_argument("unknown type of a .pcd field");
}

PcdType typeOf(const std::string& name, const py::array& values) {
  const std::string dtype = py::str(values.dtype());
  for (const auto& known : kTypeNames) {
    if (dtype == known.second) return known.first;
  }
  throw std::invalid_argument("field '" + name + "' is of type " + dtype +
                              ", which a .pcd file cannot hold");
}

py::array toArray(const PcdTable& table, const PcdColumn& column) {
  std::vector<Py_ssize_t> shape = {static_cast<Py_ssize_t>(table.points)};
  if (column.count != 1) shape.push_back(static_cast<Py_ssize_t>(column.count));
  py::array values(dtypeOf(column.type), shape);
  std::copy(column.bytes.begin(), column.bytes.end(),
            static_cast<std::uint8_t*>(values.mutable_data()));
  return values;
}

PcdColumn toColumn(const std::string& name, const py::handle& object) {
  const auto values = py::array::ensure(object, py::array::c_style);
  if (!values || values.ndim() != 1) {
    throw std::invalid_argument("field '" + name + "' is not a one-dimensional array");
  }
  PcdColumn column{name, typeOf(name, values), 1, {}};
  const auto* bytes = static_cast<const std::uint8_t*>(values.data());
  column.bytes.assign(bytes, bytes + values.nbytes());
  return column;
}

py::dict readFields(const std::string& path) {
  PcdTable table;
  {
    const py::gil_scoped_release release;
    table = readPcd(path);
  }
  py::dict fields;
  for (const PcdColumn& column : table.columns) {
    fields[py::str(column.name)] = toArray(table, column);
  }
  return fields;
}

void writeFields(const std::string& path, const py::dict& fields) {
  PcdTable table;
  for (const auto& field : fields) {
    table.columns.push_back(toColumn(py::str(field.first), field.second));
  }
  if (table.columns.empty()) throw std::invalid_argument("no fields to write");
  table.points = table.columns[0].bytes.size() / sizeOf(table.columns[0].type);
  const py::gil_scoped_release release;
  writePcd(path, table);
}

}  // namespace

void bindPcd(py::module& m) {
  m.def("read_pcd", &readFields, py::arg("path"),
        R"(Reads any .pcd file: one array per field, by name.

Arrays have shape (N,), or (N, count) for fields of several numbers, and the file's own dtype.
Raises RuntimeError naming the file where it cannot be read.)");
  m.def("write_pcd", &writeFields, py::arg("path"), py::arg("fields"),
        R"(Writes a binary .pcd file from (N,) arrays of numbers by field name.

Raises ValueError where the arrays differ in length or have a dtype that the format lacks, and
RuntimeError where the file cannot be written.)");
}

}  // namespace smoke_ground_reconstruction
