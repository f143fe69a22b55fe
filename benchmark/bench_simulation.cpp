#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/simulation/scan_simulator.hpp"

namespace smoke_ground_reconstruction {
namespace simulation {
namespace {

constexpr double kPi = 3.14159265358979323846;

FacetMesh::Loop rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                          const Eigen::Vector3d& v) {
  return {corner, corner + u, corner + u + v, corner + v};
}

void addBox(const Eigen::Vector3d& low, const Eigen::Vector3d& size, FacetMesh& mesh) {
  const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  const Eigen::Vector3d high = low + size;
  for (const auto& face : {rectangle(low, x, y), rectangle(low, y, z), rectangle(low, z, x)}) {
    mesh.addFacet({face}, 0);
  }
  for (const auto& face :
       {rectangle(high, -x, -y), rectangle(high, -y, -z), rectangle(high, -z, -x)}) {
    mesh.addFacet({face}, 0);
  }
}

/// A room of `side` metres with 40 boxes on its floor.
World room(double side) {
  World world;
  world.materials = {{0.5, 4}};
  addBox({0, 0, 0}, {side, side, 2.6}, world.solid);
  for (int i = 0; i < 40; ++i) {
    const double angle = 0.7 * i;
    const double radius = (0.15 + 0.007 * i) * side;
    addBox({0.5 * side + radius * std::cos(angle), 0.5 * side + radius * std::sin(angle), 0.0},
           {0.3, 0.3, 0.02 * i + 0.1}, world.solid);
  }
  world.solid.build();
  return world;
}

/// 86,400 beams: what a QT128 fires in a revolution.
Firing revolution(double side) {
  Firing firing;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(0.5 * side, 0.5 * side, 0.7);
  for (std::uint32_t step = 0; step < 900; ++step) {
    firing.poses.push_back(pose);
    firing.times.push_back(step * 0.1 / 900);
    for (int beam = 0; beam < 96; ++beam) {
      const double elevation = (-52.6 + 105.2 * beam / 95) * kPi / 180;
      const double azimuth = -2 * kPi * step / 900;
      firing.directions.emplace_back(std::cos(elevation) * std::cos(azimuth),
                                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      firing.steps.push_back(step);
    }
  }
  return firing;
}

void simulateScan(benchmark::State& state) {
  const auto side = static_cast<double>(state.range(0));
  const World world = room(side);
  const Firing firing = revolution(side);
  SmokeParams params;
  params.mean_extinction = 0.33;
  std::uint64_t seed = 0;
  for (auto _ : state) {
    const SmokeField smoke(params, ++seed);  // a pattern of its own for each scan
    const ScanSimulator simulator(world, state.range(1) != 0 ? &smoke : nullptr, {});
    benchmark::DoNotOptimize(simulator.scan(firing, ReturnMode::kLast, seed));
  }
}
BENCHMARK(simulateScan)
    ->ArgNames({"side_m", "smoke"})
    ->Args({6, 0})
    ->Args({6, 1})
    ->Args({15, 1})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace simulation
}  // namespace smoke_ground_reconstruction
