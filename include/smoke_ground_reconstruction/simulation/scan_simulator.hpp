#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/simulation/counter_random.hpp"
#include "smoke_ground_reconstruction/simulation/raycaster.hpp"
#include "smoke_ground_reconstruction/simulation/smoke_field.hpp"

namespace smoke_ground_reconstruction {
namespace simulation {

/// Class of a point that smoke itself sent back.
constexpr std::uint8_t kSmokeTruth = 7;

/// What a surface does to light, and what it is.
struct Material {
  double reflectivity = 0.5;  ///< Lambertian, at the laser's wavelength
  std::uint8_t truth = 0;     ///< class written to each point that comes from it
};

/// Everything a beam can meet.
class World {
 public:
  std::vector<Material> materials;
  FacetMesh solid;   ///< building and furniture, world frame
  FacetMesh glass;   ///< panes: seen head on only, else looked through
  FacetMesh portal;  ///< where the room, and its smoke, ends: panes and open windows
  FacetMesh body;    ///< the robot, sensor frame

  struct Mover {
    FacetMesh mesh;            ///< at time 0, world frame
    Eigen::Vector3d velocity;  ///< [m/s]
  };
  std::vector<Mover> movers;

  /// Nearest opaque surface; `sensor_ray` is the same ray in the sensor frame.
  Hit castSolid(const Ray& world_ray, const Ray& sensor_ray, double time) const;
};

/// The receiving end of a LiDAR.
struct ReceiverParams {
  DetectionLimit limit;
  double detection_sigma = 0.25;  ///< sigma_d of p = Phi(ln S / sigma_d)
  double range_noise = 0.010;     ///< sigma_r [m]
  double range_unit = 0.004;      ///< ranges come in multiples of it [m]; 0: continuous
  double min_range = 0.05;        ///< [m]
  double max_range = 100.0;       ///< [m]
  double divergence = 0.003;      ///< full beam angle [rad]
  double range_walk = 0.1;        ///< share of the footprint's depth a range comes short
  double intensity_gain = 1.0;    ///< intensity = 255 gain Gamma_app (1 +- noise)
  double intensity_noise = 0.1;
  double glass_cone = 0.09;          ///< half angle of a pane's mirror reflection [rad]
  double glass_transmission = 0.85;  ///< one way

  /// \throws std::invalid_argument naming the parameter that is out of its limits.
  void validate() const;
};

/// Which of a beam's echoes are reported.
enum class ReturnMode { kStrongest, kLast, kDual };

/// The beams of one revolution, in firing order. A step is one azimuth step: one pose, one time.
struct Firing {
  std::vector<Eigen::Vector3d> directions;  ///< unit vectors, sensor frame
  std::vector<std::uint32_t> steps;         ///< per beam: index into the two below
  std::vector<Eigen::Isometry3d> poses;     ///< T_world_sensor per step
  std::vector<double> times;                ///< scene time per step [s]
};

/// One echo.
struct Echo {
  std::uint32_t beam;
  float range;      ///< [m]
  float intensity;  ///< whole numbers 0 .. 255
  std::uint8_t truth;
};

/// One beam of a recorded scan: what it met in clear air.
struct MeasuredBeam {
  Eigen::Vector3d direction;  ///< unit vector, sensor frame
  double range;               ///< [m]
  double intensity;           ///< 0 .. 255
  std::uint8_t truth;         ///< class written to its echo
};

/// What would happen to each beam on average: the physics without the dice.
struct BeamTruth {
  double range;          ///< of the nearest opaque surface [m], infinite: none
  double reflectivity;   ///< Gamma cos(theta), clear air
  double optical_depth;  ///< up to it
  double probability;    ///< of detecting it (mode `last`)
  std::uint16_t material;
};

/// Shoots every beam through the world and the smoke.
class ScanSimulator {
 public:
  /// The references must outlive the simulator. \param smoke  null: clear air.
  ScanSimulator(const World& world, const SmokeField* smoke, const ReceiverParams& receiver);

  /// Echoes in beam order; in dual mode a beam's nearer echo first. Deterministic by seed.
  /// Reports the last echo: the hard target if it is detected, else the smoke's own (`last`); the
  /// larger signal (`strongest`); or both (`dual`).
  std::vector<Echo> scan(const Firing& firing, ReturnMode mode, std::uint64_t seed) const;

  /// Smoke over a recorded scan: real geometry, beam pattern and noise, this simulator's smoke. A
  /// point keeps its range; its intensity, taken as 255 gain Gamma_app, decides whether it
  /// survives. A point of intensity 0 still counts as just detected in clear air, for it was
  /// recorded. \param pose  T_world_sensor of all beams. The world is not looked at.
  std::vector<Echo> overlay(const std::vector<MeasuredBeam>& beams, const Eigen::Isometry3d& pose,
                            ReturnMode mode, std::uint64_t seed) const;

  /// Expectation of each beam, in beam order.
  std::vector<BeamTruth> expect(const Firing& firing) const;

 private:
  struct Target {
    double range = 0.0;
    double signal = 0.0;
    double reflectivity = 0.0;  // apparent
    double range_sigma = 0.0;
    double range_bias = 0.0;
    bool is_recorded = false;  // range and intensity are a real sensor's: no noise of ours
    std::uint8_t truth = 0;
  };
  struct Beam {
    Ray world_ray;
    Ray sensor_ray;
    double time;
  };
  struct Flight {
    Target hard, glass, soft;  // signal 0: not there
  };

  struct Candidate {
    double signal;
    Echo echo;
  };

  Beam beamOf(const Firing& firing, std::size_t beam) const;
  Flight fly(const Beam& beam) const;
  Flight flyMeasured(const MeasuredBeam& beam, const Eigen::Isometry3d& pose) const;
  Target softTarget(const SmokeField::Passage& passage) const;
  void decide(const Flight& flight, std::uint32_t beam, const CounterRandom& random,
              ReturnMode mode, std::vector<Echo>& echoes) const;
  Target hardTarget(const Hit& hit, double transmission) const;
  bool isDetected(const Target& target, double normal) const;  // of a target that is there
  void report(const std::array<Candidate, 3>& found, std::size_t count, ReturnMode mode,
              std::vector<Echo>& echoes) const;
  Echo echoOf(const Target& target, std::uint32_t beam, double normal, double uniform) const;

  const World& world_;
  const SmokeField* smoke_;
  ReceiverParams receiver_;
};

/// Phi(ln S / sigma_d): the chance that a signal is detected.
double detectionProbability(double signal, double detection_sigma);

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
