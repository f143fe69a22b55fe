#include "smoke_ground_reconstruction/neighbor_counter.hpp"

#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

double NeighborCounter::squaredRadius(std::size_t index, double radius_per_range) const {
  const double radius = radius_per_range * range(scan_.x[index], scan_.y[index], scan_.z[index]);
  return radius * radius;
}

void NeighborCounter::findOutsiders(const std::vector<std::uint32_t>& points, const Crowd& crowd,
                                    std::vector<std::uint32_t>* outsiders) const {
  outsiders->clear();
  for (const std::uint32_t i : points) {
    const double r2 = squaredRadius(i, crowd.radius_per_range);
    if (!isBetween(i, r2, crowd.more_than, crowd.at_most)) outsiders->push_back(i);
  }
}

}  // namespace smoke_ground_reconstruction
