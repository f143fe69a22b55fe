#pragma once

#include <smoke_ground_reconstruction/DenoiserConfig.h>
#include <smoke_ground_reconstruction/ReconstructorConfig.h>
#include <smoke_ground_reconstruction/SegmenterConfig.h>

#include "smoke_ground_reconstruction/pipeline.hpp"

namespace smoke_ground_reconstruction {

// The only place that maps the tunables of cfg/*.cfg to the stages' parameters.

/// \throws std::invalid_argument on an unknown name or a combination that validate() refuses.
AgdorParams toParams(const DenoiserConfig& config);
/// \throws std::invalid_argument on an unknown name or a combination that validate() refuses.
SegmenterParams toParams(const SegmenterConfig& config);
/// \throws std::invalid_argument on an unknown name or a combination that validate() refuses.
ReconstructorParams toParams(const ReconstructorConfig& config);

/// The angle next to `width_deg` that divides 360 (AzimuthBins), so that a slider, which hits no
/// divisor by itself, may be dragged. An angle that divides already is returned unchanged.
double nearestDivisorOf360(double width_deg);

// Move what can be moved to the nearest value that is allowed; what stays wrong, toParams() throws.
void repair(DenoiserConfig& config);
void repair(SegmenterConfig& config);
void repair(ReconstructorConfig& config);

}  // namespace smoke_ground_reconstruction
