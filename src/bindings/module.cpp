#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
  m.doc() = "Compiled stages of smoke_ground_reconstruction.";
  smoke_ground_reconstruction::bindScan(m);
  smoke_ground_reconstruction::bindAgdorFilter(m);
  smoke_ground_reconstruction::bindChannelSegmentation(m);
  smoke_ground_reconstruction::bindWallClustering(m);
  smoke_ground_reconstruction::bindPolarSegments(m);
  smoke_ground_reconstruction::bindDropOffs(m);
  smoke_ground_reconstruction::bindRoomBoundary(m);
  smoke_ground_reconstruction::bindVisibility(m);
  smoke_ground_reconstruction::bindFloorRelief(m);
  smoke_ground_reconstruction::bindPipeline(m);
  auto simulation = m.def_submodule("simulation", "Ray casting and smoke physics.");
  smoke_ground_reconstruction::bindSimulation(simulation);
#ifdef SMOKE_GROUND_HAVE_PCL
  smoke_ground_reconstruction::bindPcd(m);
  smoke_ground_reconstruction::bindBaselines(m);
#endif
}
