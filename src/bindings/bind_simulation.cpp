#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "smoke_ground_reconstruction/simulation/scan_simulator.hpp"

namespace py = pybind11;

namespace smoke_ground_reconstruction {
namespace {

using simulation::FacetMesh;
using simulation::SmokeField;
using simulation::World;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Bytes = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;
using Counts = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

/// One array per member of a struct, as numpy sees it.
template <typename T, typename Struct, typename Get>
py::array_t<T> column(const std::vector<Struct>& rows, Get get) {
  py::array_t<T> values(static_cast<py::ssize_t>(rows.size()));
  T* out = values.mutable_data();
  for (const auto& row : rows) {
    *out++ = static_cast<T>(get(row));
  }
  return values;
}

void requireShape(const py::array& array, py::ssize_t ndim, py::ssize_t last, const char* name) {
  if (array.ndim() != ndim || array.shape(ndim - 1) != last) {
    throw std::invalid_argument(std::string(name) + " must have the shape (N, " +
                                std::to_string(last) + ")");
  }
}

void addFacet(FacetMesh& mesh, const std::vector<Doubles>& loops, std::uint16_t material) {
  std::vector<FacetMesh::Loop> copied;
  for (const auto& loop : loops) {
    requireShape(loop, 2, 3, "a facet's loop");
    FacetMesh::Loop vertices;
    for (py::ssize_t i = 0; i < loop.shape(0); ++i) {
      vertices.emplace_back(loop.at(i, 0), loop.at(i, 1), loop.at(i, 2));
    }
    copied.push_back(std::move(vertices));
  }
  mesh.addFacet(copied, material);
}

std::vector<Eigen::Vector3d> vectorsOf(const Doubles& array, const char* name) {
  requireShape(array, 2, 3, name);
  std::vector<Eigen::Vector3d> vectors(static_cast<std::size_t>(array.shape(0)));
  const double* in = array.data();
  for (auto& vector : vectors) {
    vector = Eigen::Vector3d(in[0], in[1], in[2]);
    in += 3;
  }
  return vectors;
}

/// \param poses  (S, 4, 4) T_world_sensor
simulation::Firing firingOf(const Doubles& directions, const Counts& steps, const Doubles& poses,
                            const Doubles& times) {
  simulation::Firing firing;
  firing.directions = vectorsOf(directions, "directions");
  firing.steps.assign(steps.data(), steps.data() + steps.size());
  firing.times.assign(times.data(), times.data() + times.size());
  if (poses.ndim() != 3 || poses.shape(1) != 4 || poses.shape(2) != 4 ||
      poses.shape(0) != times.size()) {
    throw std::invalid_argument("poses must have the shape (steps, 4, 4)");
  }
  if (firing.steps.size() != firing.directions.size()) {
    throw std::invalid_argument("steps must be as many as directions");
  }
  for (const auto step : firing.steps) {
    if (step >= firing.times.size()) {
      throw std::invalid_argument("a beam's step has no pose");
    }
  }
  for (py::ssize_t i = 0; i < poses.shape(0); ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 4; ++col) {
        pose.matrix()(row, col) = poses.at(i, row, col);
      }
    }
    firing.poses.push_back(pose);
  }
  return firing;
}

simulation::ReturnMode modeOf(const std::string& name) {
  if (name == "last") return simulation::ReturnMode::kLast;
  if (name == "strongest") return simulation::ReturnMode::kStrongest;
  if (name == "dual") return simulation::ReturnMode::kDual;
  throw std::invalid_argument("mode must be strongest, last or dual, not '" + name + "'");
}

py::dict columnsOf(const std::vector<simulation::Echo>& echoes) {
  py::dict out;
  out["beam"] = column<std::uint32_t>(echoes, [](const auto& echo) { return echo.beam; });
  out["range"] = column<float>(echoes, [](const auto& echo) { return echo.range; });
  out["intensity"] = column<float>(echoes, [](const auto& echo) { return echo.intensity; });
  out["truth"] = column<std::uint8_t>(echoes, [](const auto& echo) { return echo.truth; });
  return out;
}

py::dict scan(const World& world, const SmokeField* smoke,
              const simulation::ReceiverParams& receiver, const simulation::Firing& firing,
              const std::string& mode, std::uint64_t seed) {
  const auto return_mode = modeOf(mode);
  std::vector<simulation::Echo> echoes;
  {
    const py::gil_scoped_release unlocked;
    echoes = simulation::ScanSimulator(world, smoke, receiver).scan(firing, return_mode, seed);
  }
  return columnsOf(echoes);
}

/// Columns of a recorded scan, all of one length, as beams.
std::vector<simulation::MeasuredBeam> measuredBeams(const Doubles& directions,
                                                    const Doubles& ranges,
                                                    const Doubles& intensities,
                                                    const Bytes& truths) {
  const auto rays = vectorsOf(directions, "directions");
  const auto count = static_cast<py::ssize_t>(rays.size());
  if (ranges.size() != count || intensities.size() != count || truths.size() != count) {
    throw std::invalid_argument("ranges, intensities and truths must be as many as directions");
  }
  std::vector<simulation::MeasuredBeam> beams;
  beams.reserve(rays.size());
  for (py::ssize_t i = 0; i < count; ++i) {
    beams.push_back({rays[static_cast<std::size_t>(i)], ranges.data()[i], intensities.data()[i],
                     truths.data()[i]});
  }
  return beams;
}

py::dict overlay(const SmokeField* smoke, const simulation::ReceiverParams& receiver,
                 const Doubles& directions, const Doubles& ranges, const Doubles& intensities,
                 const Bytes& truths, double height, const std::string& mode, std::uint64_t seed) {
  const auto return_mode = modeOf(mode);
  const auto beams = measuredBeams(directions, ranges, intensities, truths);
  const Eigen::Isometry3d pose(Eigen::Translation3d(0.0, 0.0, height));
  std::vector<simulation::Echo> echoes;
  {
    const py::gil_scoped_release unlocked;
    const World nothing;
    echoes =
        simulation::ScanSimulator(nothing, smoke, receiver).overlay(beams, pose, return_mode, seed);
  }
  return columnsOf(echoes);
}

/// tau along rays from one origin.
py::array_t<double> opticalDepth(const SmokeField& field, const Eigen::Vector3d& origin,
                                 const Doubles& directions, const Doubles& lengths, double time) {
  const auto rays = vectorsOf(directions, "directions");
  if (lengths.size() != directions.shape(0)) {
    throw std::invalid_argument("lengths must be as many as directions");
  }
  py::array_t<double> depths(lengths.size());
  double* out = depths.mutable_data();
  const double* length = lengths.data();
  const py::gil_scoped_release unlocked;
  for (const auto& direction : rays) {
    *out++ = field.march({origin, direction}, *length++, time, {}).optical_depth;
  }
  return depths;
}

py::dict expect(const World& world, const SmokeField* smoke,
                const simulation::ReceiverParams& receiver, const simulation::Firing& firing) {
  std::vector<simulation::BeamTruth> beams;
  {
    const py::gil_scoped_release unlocked;
    beams = simulation::ScanSimulator(world, smoke, receiver).expect(firing);
  }
  py::dict out;
  out["range"] = column<double>(beams, [](const auto& beam) { return beam.range; });
  out["reflectivity"] = column<double>(beams, [](const auto& beam) { return beam.reflectivity; });
  out["optical_depth"] = column<double>(beams, [](const auto& beam) { return beam.optical_depth; });
  out["probability"] = column<double>(beams, [](const auto& beam) { return beam.probability; });
  out["material"] = column<std::uint16_t>(beams, [](const auto& beam) { return beam.material; });
  return out;
}

/// Range of the nearest opaque surface along rays from one origin; the robot's body left out.
py::array_t<double> castFrom(const World& world, const Eigen::Vector3d& origin,
                             const Doubles& directions) {
  const auto rays = vectorsOf(directions, "directions");
  py::array_t<double> ranges(static_cast<py::ssize_t>(rays.size()));
  double* out = ranges.mutable_data();
  const py::gil_scoped_release unlocked;
  for (const auto& direction : rays) {
    *out++ = world.solid.cast({origin, direction}).range;
  }
  return ranges;
}

void bindWorld(py::module& m) {
  py::class_<FacetMesh>(m, "FacetMesh", "Planar polygons with holes, for ray casting.")
      .def(py::init<>())
      .def("add_facet", &addFacet, py::arg("loops"), py::arg("material"),
           "Adds closed loops of one plane, each (N, 3) [m]; inside by the even-odd rule.")
      .def("build", &FacetMesh::build, "Sorts the facets; once, after the last add_facet().")
      .def("__len__", &FacetMesh::size);
  py::class_<World>(m, "World", "Everything a beam can meet.")
      .def(py::init<>())
      .def_readwrite("solid", &World::solid)
      .def_readwrite("glass", &World::glass)
      .def_readwrite("portal", &World::portal)
      .def_readwrite("body", &World::body)
      .def("add_material",
           [](World& world, double reflectivity, std::uint8_t truth) {
             world.materials.push_back({reflectivity, truth});
             return world.materials.size() - 1;
           })
      .def("add_mover",
           [](World& world, const FacetMesh& mesh, const Eigen::Vector3d& velocity) {
             world.movers.push_back({mesh, velocity});
           })
      .def("clear_movers", [](World& world) { world.movers.clear(); })
      .def("cast_from", &castFrom, py::arg("origin"), py::arg("directions"),
           "Ranges (N,) [m] to the building and furniture; infinite where nothing is met.");
}

void bindSmoke(py::module& m) {
  using Params = simulation::SmokeParams;
  py::class_<Params>(m, "SmokeParams", "Parameters of the extinction field.")
      .def(py::init<>())
      .def_readwrite("mean_extinction", &Params::mean_extinction)
      .def_readwrite("sigma_ln", &Params::sigma_ln)
      .def_readwrite("correlation_length", &Params::correlation_length)
      .def_readwrite("drift", &Params::drift)
      .def_readwrite("backscatter_ratio", &Params::backscatter_ratio)
      .def_readwrite("pulse_length", &Params::pulse_length)
      .def_readwrite("overlap_begin", &Params::overlap_begin)
      .def_readwrite("overlap_end", &Params::overlap_end)
      .def_readwrite("range_jitter", &Params::range_jitter)
      .def_readwrite("layer_height", &Params::layer_height)
      .def_readwrite("layer_thickness", &Params::layer_thickness)
      .def_readwrite("below_layer", &Params::below_layer)
      .def_readwrite("plume_centre", &Params::plume_centre)
      .def_readwrite("plume_radius", &Params::plume_radius)
      .def_readwrite("plume_gain", &Params::plume_gain);
  py::class_<SmokeField>(m, "SmokeField", "The extinction field of one seed.")
      .def(py::init<const Params&, std::uint64_t>(), py::arg("params"), py::arg("seed"))
      .def(
          "extinction",
          [](const SmokeField& field, const Doubles& positions, double time) {
            const auto places = vectorsOf(positions, "positions");
            return column<double>(places, [&](const Eigen::Vector3d& place) {
              return field.extinction(place, time);
            });
          },
          py::arg("positions"), py::arg("time") = 0.0, "alpha (N,) [1/m] at (N, 3) [m].")
      .def("optical_depth", &opticalDepth, py::arg("origin"), py::arg("directions"),
           py::arg("lengths"), py::arg("time") = 0.0,
           "tau (N,), one way, over `lengths` (N,) [m] along unit vectors (N, 3).");
}

void bindReceiver(py::module& m) {
  using Params = simulation::ReceiverParams;
  py::class_<Params>(m, "ReceiverParams", "The receiving end of a LiDAR.")
      .def(py::init<>())
      .def_property(
          "reference_range", [](const Params& p) { return p.limit.range; },
          [](Params& p, double value) { p.limit.range = value; })
      .def_property(
          "reference_reflectivity", [](const Params& p) { return p.limit.reflectivity; },
          [](Params& p, double value) { p.limit.reflectivity = value; })
      .def_readwrite("detection_sigma", &Params::detection_sigma)
      .def_readwrite("range_noise", &Params::range_noise)
      .def_readwrite("range_unit", &Params::range_unit)
      .def_readwrite("min_range", &Params::min_range)
      .def_readwrite("max_range", &Params::max_range)
      .def_readwrite("divergence", &Params::divergence)
      .def_readwrite("range_walk", &Params::range_walk)
      .def_readwrite("intensity_gain", &Params::intensity_gain)
      .def_readwrite("intensity_noise", &Params::intensity_noise)
      .def_readwrite("glass_cone", &Params::glass_cone)
      .def_readwrite("glass_transmission", &Params::glass_transmission);
}

}  // namespace

void bindSimulation(py::module& m) {
  m.attr("digest") = SMOKE_GROUND_DIGEST;  // of the simulator's sources: what its results hang on
  bindWorld(m);
  bindSmoke(m);
  bindReceiver(m);
  py::class_<simulation::Firing>(m, "Firing", "The beams of one revolution in firing order.")
      .def(py::init(&firingOf), py::arg("directions"), py::arg("steps"), py::arg("poses"),
           py::arg("times"));
  m.def("scan", &scan, py::arg("world"), py::arg("smoke").none(true), py::arg("receiver"),
        py::arg("firing"), py::arg("mode"), py::arg("seed"),
        "Echoes: arrays beam, range [m], intensity, truth, in beam order.");
  m.def("overlay", &overlay, py::arg("smoke").none(true), py::arg("receiver"),
        py::arg("directions"), py::arg("ranges"), py::arg("intensities"), py::arg("truths"),
        py::arg("height"), py::arg("mode"), py::arg("seed"),
        "Echoes of a recorded scan under smoke, as scan(); the sensor is level at `height` [m].");
  m.def("expect", &expect, py::arg("world"), py::arg("smoke").none(true), py::arg("receiver"),
        py::arg("firing"),
        "Per beam: range [m], reflectivity, optical_depth, probability (mode last), material.");
}

}  // namespace smoke_ground_reconstruction
