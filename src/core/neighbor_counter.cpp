#include "smoke_ground_reconstruction/neighbor_counter.hpp"

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

double NeighborCounter::squaredRadius(std::size_t index, double radius_per_range) const {
  const double radius = radius_per_range * range(scan_.x[index], scan_.y[index], scan_.z[index]);
  return radius * radius;
}

std::vector<std::uint32_t> NeighborCounter::outsiders(const std::vector<std::uint32_t>& points,
                                                      const Crowd& crowd) const {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t i : points) {
    const double squared_radius = squaredRadius(i, crowd.radius_per_range);
    if (!isBetween(i, squared_radius, crowd.more_than, crowd.at_most)) found.push_back(i);
  }
  return found;
}

}  // namespace smoke_ground_reconstruction
