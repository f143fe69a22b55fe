#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "smoke_ground_reconstruction/scan.hpp"

namespace smoke_ground_reconstruction {

/// A scan written down point by point.
struct Cloud {
  std::vector<float> x, y, z, intensity;
  std::vector<std::uint16_t> ring;

  void add(double px, double py, double pz, int point_ring = 0, double point_intensity = 100.0) {
    x.push_back(static_cast<float>(px));
    y.push_back(static_cast<float>(py));
    z.push_back(static_cast<float>(pz));
    ring.push_back(static_cast<std::uint16_t>(point_ring));
    intensity.push_back(static_cast<float>(point_intensity));
  }

  /// The point at an azimuth [deg], a planar range and a height [m].
  void addPolar(double azimuth_deg, double planar_range, double pz, int point_ring = 0,
                double point_intensity = 100.0) {
    const double azimuth = azimuth_deg * M_PI / 180.0;
    add(planar_range * std::cos(azimuth), planar_range * std::sin(azimuth), pz, point_ring,
        point_intensity);
  }

  std::size_t size() const { return x.size(); }

  ScanView view() const { return ScanView::of(x, y, z, intensity, ring); }

  /// The points of `order`, in that order.
  Cloud select(const std::vector<std::size_t>& order) const {
    Cloud selected;
    for (const std::size_t i : order) selected.add(x[i], y[i], z[i], ring[i], intensity[i]);
    return selected;
  }
};

/// 0 .. size - 1 in an order that the seed alone decides.
inline std::vector<std::size_t> shuffledIndices(std::size_t size, unsigned seed) {
  std::vector<std::size_t> order(size);
  std::iota(order.begin(), order.end(), 0U);
  std::mt19937 random(seed);
  for (std::size_t i = size; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  return order;
}

/// Uniform numbers that are the same with every standard library.
class Uniform {
 public:
  explicit Uniform(unsigned seed) : random_(seed) {}
  double operator()(double from, double to) {
    return from + (to - from) * static_cast<double>(random_()) / 4294967296.0;
  }

 private:
  std::mt19937 random_;
};

enum class Surface { kFloor, kWall, kCeiling };

/// What a level sensor in the middle of an empty room sees: one ray per ring and azimuth.
struct BoxRoom {
  double length = 6.8;                 ///< along x [m]
  double width = 6.0;                  ///< along y [m]
  double sensor_height = 0.7;          ///< above the floor [m]
  double ceiling = 2.0;                ///< above the sensor [m]
  std::vector<double> elevations_deg;  ///< by ring number
  int azimuths = 900;

  /// Distance [m] along a unit direction to the surface it meets first.
  double hit(double dx, double dy, double dz, Surface* surface) const {
    const double wall = std::min(length / 2.0 / std::fabs(dx), width / 2.0 / std::fabs(dy));
    const double level = dz < 0.0 ? sensor_height / -dz : ceiling / dz;
    *surface = wall < level ? Surface::kWall : (dz < 0.0 ? Surface::kFloor : Surface::kCeiling);
    return std::min(wall, level);
  }

  /// The scan, column by column, rays half a step off the columns' edges.
  Cloud scan(std::vector<Surface>* surfaces = nullptr) const {
    Cloud cloud;
    for (int column = 0; column < azimuths; ++column) {
      const double azimuth = (column + 0.5) * 2.0 * M_PI / azimuths;
      for (std::size_t ring = 0; ring < elevations_deg.size(); ++ring) {
        const double elevation = elevations_deg[ring] * M_PI / 180.0;
        const double dx = std::cos(elevation) * std::cos(azimuth);
        const double dy = std::cos(elevation) * std::sin(azimuth);
        const double dz = std::sin(elevation);
        Surface surface = Surface::kFloor;
        const double distance = hit(dx, dy, dz, &surface);
        cloud.add(distance * dx, distance * dy, distance * dz, static_cast<int>(ring));
        if (surfaces != nullptr) surfaces->push_back(surface);
      }
    }
    return cloud;
  }
};

/// `count` elevations from `lowest_deg` to `highest_deg`, ring 0 the lowest.
inline std::vector<double> evenElevations(int count, double lowest_deg, double highest_deg) {
  std::vector<double> elevations;
  for (int i = 0; i < count; ++i) {
    elevations.push_back(lowest_deg + (highest_deg - lowest_deg) * i / (count - 1));
  }
  return elevations;
}

}  // namespace smoke_ground_reconstruction
