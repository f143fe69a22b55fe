#include "smoke_ground_reconstruction/floor_surface.hpp"

namespace smoke_ground_reconstruction {

void FloorSurface::resize(std::size_t points) {
  for (auto* values : {&x, &y, &z, &intensity, &confidence, &sigma}) values->resize(points);
  ring.resize(points);
  provenance.resize(points);
}

void FloorSurface::clear() {
  for (auto* values : {&x, &y, &z, &intensity, &confidence, &sigma}) values->clear();
  ring.clear();
  provenance.clear();
  boundary.vertices.clear();
  boundary.kinds.clear();
}

void FloorSurface::push(const std::array<float, 3>& point, float point_intensity,
                        std::uint16_t point_ring, Provenance point_provenance,
                        float point_confidence) {
  x.push_back(point[0]);
  y.push_back(point[1]);
  z.push_back(point[2]);
  intensity.push_back(point_intensity);
  ring.push_back(point_ring);
  provenance.push_back(point_provenance);
  confidence.push_back(point_confidence);
}

}  // namespace smoke_ground_reconstruction
