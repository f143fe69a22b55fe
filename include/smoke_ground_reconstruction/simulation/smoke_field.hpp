#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/simulation/raycaster.hpp"

namespace smoke_ground_reconstruction {
namespace simulation {

/// Smoke as a drifting, patchy extinction field:
/// alpha(x) = mean * exp(sigma_ln n(x) - sigma_ln^2 / 2) * g(z) * plume(x),
/// with n three octaves of gradient noise of zero mean and unit variance.
struct SmokeParams {
  double mean_extinction = 0.42;     ///< [1/m]
  double sigma_ln = 0.6;             ///< standard deviation of ln alpha; 0: homogeneous
  double correlation_length = 0.8;   ///< wavelength of the coarsest octave [m]
  Eigen::Vector3d drift{0.1, 0, 0};  ///< velocity of the pattern, world frame [m/s]
  double backscatter_ratio = 0.03;   ///< beta / alpha [1/sr]
  double pulse_length = 0.6;         ///< L_p = c tau_p / 2 [m]
  double overlap_begin = 0.2;        ///< range where transmitter and receiver begin to overlap [m]
  double overlap_end = 0.8;          ///< range of full overlap [m]
  double range_jitter = 0.04;        ///< standard deviation of a soft return's range [m]
  double layer_height = 0.0;         ///< middle of the smoke layer's lower edge [m]
  double layer_thickness = 0.0;      ///< width of that edge [m]; 0: no layering, g = 1
  double below_layer = 1.0;          ///< g far below the edge (1 above it)
  Eigen::Vector3d plume_centre{0, 0, 0};  ///< smoke source, world frame [m]
  double plume_radius = 0.0;              ///< [m]; 0: no source
  double plume_gain = 0.0;                ///< plume(x) = 1 + gain exp(-(distance / radius)^2)

  /// \throws std::invalid_argument naming the parameter that is out of its limits.
  void validate() const;
};

/// Three octaves of periodic gradient noise, zero mean and unit variance over its period:
/// 16 x 16 x 4 cells of the coarsest octave, sampled 8 times a cell, as [z][y][x].
std::vector<float> noiseTile(std::uint64_t seed);

/// The data sheet's limit of detection: a target of this reflectivity at this range, met head on in
/// clear air, gives the signal 1.
struct DetectionLimit {
  double range = 20.0;         ///< [m]
  double reflectivity = 0.10;  ///< share of a Lambertian target

  /// Signal of an apparent reflectivity at a range.
  double signal(double apparent_reflectivity, double at_range) const {
    const double ratio = range / at_range;
    return apparent_reflectivity / reflectivity * ratio * ratio;
  }
};

/// A field at work: what a beam loses and what the smoke sends back.
class SmokeField {
 public:
  /// \throws std::invalid_argument as SmokeParams::validate().
  SmokeField(const SmokeParams& params, std::uint64_t seed);

  /// alpha at a place and time [1/m].
  double extinction(const Eigen::Vector3d& position, double time) const;

  /// What happens to a beam on its way.
  struct Passage {
    double optical_depth = 0.0;      ///< tau(length)
    double soft_range = 0.0;         ///< where the smoke's own signal is strongest [m]; 0: nowhere
    double soft_signal = 0.0;        ///< S_s there
    double soft_reflectivity = 0.0;  ///< pi beta L_p exp(-2 tau) there
  };
  /// Marches over `length` [m] from the ray's origin, at most over 1 km. O(length / step).
  Passage march(const Ray& ray, double length, double time, const DetectionLimit& limit) const;

  const SmokeParams& params() const { return params_; }

 private:
  void planSlices();
  void layTile(const std::vector<float>& samples);
  double shape(double x, double y, double z) const;  // layer and plume
  void multiplyPatches(const Ray& ray, double time, const double* ranges, std::size_t count,
                       double* extinctions) const;
  void fillExtinctions(const Ray& ray, double time, const double* ranges, std::size_t count,
                       double* extinctions) const;
  double overlap(double range) const;

  SmokeParams params_;
  // exp(sigma_ln n - sigma_ln^2 / 2) at (x, y, z), (x, y + 1, z), (x, y, z + 1), (x, y + 1, z + 1):
  // a cell's eight corners lie side by side.
  std::vector<Eigen::Array4f, Eigen::aligned_allocator<Eigen::Array4f>> tile_;
  double cells_per_metre_ = 1.0;
  // Slices of range [m], finer near the sensor, where the smoke's own return comes from.
  std::vector<double> begins_, steps_, middles_, overlaps_;
  bool has_shape_ = false;
  double plume_inverse_square_ = 0.0;
};

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
