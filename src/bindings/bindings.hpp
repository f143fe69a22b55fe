#pragma once

#include <pybind11/pybind11.h>

#include "smoke_ground_reconstruction/pipeline.hpp"

namespace smoke_ground_reconstruction {

void bindScan(pybind11::module& m);
void bindAgdorFilter(pybind11::module& m);
void bindChannelSegmentation(pybind11::module& m);
void bindWallClustering(pybind11::module& m);
void bindPolarSegments(pybind11::module& m);
void bindVisibility(pybind11::module& m);
void bindDropOffs(pybind11::module& m);
void bindRoomBoundary(pybind11::module& m);
void bindFloorRelief(pybind11::module& m);
void bindPipeline(pybind11::module& m);
void bindSimulation(pybind11::module& m);
#ifdef SMOKE_GROUND_HAVE_PCL
void bindPcd(pybind11::module& m);
/// PCL's own filters, to compare with.
void bindBaselines(pybind11::module& m);
#endif

/// The engines of this build; empty without PCL.
Engines availableEngines();

}  // namespace smoke_ground_reconstruction
