#include "smoke_ground_reconstruction/simulation/scan_simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "smoke_ground_reconstruction/simulation/counter_random.hpp"

namespace smoke_ground_reconstruction {
namespace simulation {
namespace {

/// Counters of a beam's stream of random numbers.
enum Draw : std::uint64_t { kHardDraw = 0, kGlassDraw = 1, kSoftDraw = 2, kIntensityDraw = 64 };

constexpr double kMaxWalk = 0.2;  // [m]; the footprint's depth has no bound at grazing incidence

void require(bool is_met, const char* what) {
  if (!is_met) {
    throw std::invalid_argument(std::string("sensor: ") + what);
  }
}

/// Depth along the beam of the spot on an inclined surface: R delta cot(grazing angle).
double footprintDepth(double range, double divergence, double cos_incidence) {
  const double sin_incidence = std::sqrt(std::max(0.0, 1.0 - cos_incidence * cos_incidence));
  return range * divergence * sin_incidence / std::max(cos_incidence, 1e-6);
}

}  // namespace

double detectionProbability(double signal, double detection_sigma) {
  if (!(signal > 0.0)) {
    return 0.0;
  }
  return 0.5 * std::erfc(-std::log(signal) / (detection_sigma * std::sqrt(2.0)));
}

void ReceiverParams::validate() const {
  require(limit.range > 0.0 && limit.reflectivity > 0.0, "the detection limit must be above 0");
  require(detection_sigma > 0.0, "detection_sigma must be above 0");
  require(range_noise >= 0.0, "range_noise must be at least 0");
  require(range_unit >= 0.0, "range_unit must be at least 0");
  require(min_range >= 0.0 && max_range > min_range && std::isfinite(max_range),
          "max_range must be above min_range");
  require(divergence >= 0.0, "divergence must be at least 0");
  require(intensity_gain > 0.0, "intensity_gain must be above 0");
  require(intensity_noise >= 0.0 && intensity_noise < 1.0, "intensity_noise must lie in [0, 1)");
  require(glass_transmission >= 0.0 && glass_transmission <= 1.0,
          "glass_transmission must lie in [0, 1]");
}

Hit World::castSolid(const Ray& world_ray, const Ray& sensor_ray, double time) const {
  Hit nearest = body.cast(sensor_ray);
  const auto consider = [&nearest](const Hit& hit) {
    if (hit.range < nearest.range) {
      nearest = hit;
    }
  };
  consider(solid.cast(world_ray, nearest.range));
  for (const auto& mover : movers) {
    const Ray followed{world_ray.origin - mover.velocity * time, world_ray.direction};
    consider(mover.mesh.cast(followed, nearest.range));
  }
  return nearest;
}

ScanSimulator::ScanSimulator(const World& world, const SmokeField* smoke,
                             const ReceiverParams& receiver)
    : world_(world), smoke_(smoke), receiver_(receiver) {
  receiver_.validate();
}

ScanSimulator::Beam ScanSimulator::beamOf(const Firing& firing, std::size_t beam) const {
  const auto step = firing.steps[beam];
  const auto& pose = firing.poses[step];
  const Eigen::Vector3d& direction = firing.directions[beam];
  return {{pose.translation(), pose.linear() * direction},
          {Eigen::Vector3d::Zero(), direction},
          firing.times[step]};
}

ScanSimulator::Target ScanSimulator::hardTarget(const Hit& hit, double transmission) const {
  const Material& material = world_.materials[hit.material];
  Target target;
  target.range = hit.range;
  target.reflectivity = material.reflectivity * hit.cos_incidence * transmission;
  target.signal = receiver_.limit.signal(target.reflectivity, hit.range);
  target.range_sigma = receiver_.range_noise;
  const double depth = footprintDepth(hit.range, receiver_.divergence, hit.cos_incidence);
  target.range_bias = -std::min(kMaxWalk, receiver_.range_walk * depth);
  target.truth = material.truth;
  return target;
}

ScanSimulator::Flight ScanSimulator::fly(const Beam& beam) const {
  const Hit solid = world_.castSolid(beam.world_ray, beam.sensor_ray, beam.time);
  const double reach = std::min(solid.range, receiver_.max_range);
  const Hit pane = world_.glass.cast(beam.world_ray, reach);
  const Hit portal = world_.portal.cast(beam.world_ray, reach);
  const double smoky = portal.isHit() ? portal.range : reach;
  SmokeField::Passage passage;
  if (smoke_ != nullptr) {
    passage = smoke_->march(beam.world_ray, smoky, beam.time, receiver_.limit);
  }
  const double transmission = std::exp(-2.0 * passage.optical_depth);
  Flight flight;
  if (solid.range <= receiver_.max_range) {
    const double panes = pane.isHit() ? std::pow(receiver_.glass_transmission, 2) : 1.0;
    flight.hard = hardTarget(solid, transmission * panes);
  }
  if (pane.isHit() && pane.cos_incidence > std::cos(receiver_.glass_cone)) {
    flight.glass = hardTarget(pane, transmission);
  }
  flight.soft = softTarget(passage);
  return flight;
}

ScanSimulator::Target ScanSimulator::softTarget(const SmokeField::Passage& passage) const {
  Target target;
  target.range = passage.soft_range;
  target.signal = passage.soft_signal;
  target.reflectivity = passage.soft_reflectivity;
  target.range_sigma = smoke_ != nullptr ? smoke_->params().range_jitter : 0.0;
  target.truth = kSmokeTruth;
  return target;
}

ScanSimulator::Flight ScanSimulator::flyMeasured(const MeasuredBeam& beam,
                                                 const Eigen::Isometry3d& pose) const {
  Flight flight;
  SmokeField::Passage passage;
  if (smoke_ != nullptr) {
    const Ray ray{pose.translation(), pose.linear() * beam.direction};
    passage = smoke_->march(ray, beam.range, 0.0, receiver_.limit);
  }
  const double transmission = std::exp(-2.0 * passage.optical_depth);
  const double clear = beam.intensity / (255.0 * receiver_.intensity_gain);
  const double surely_seen = std::exp(2.0 * receiver_.detection_sigma);
  flight.hard.range = beam.range;
  flight.hard.reflectivity = clear * transmission;
  flight.hard.signal =
      std::max(surely_seen, receiver_.limit.signal(clear, beam.range)) * transmission;
  flight.hard.truth = beam.truth;
  flight.hard.is_recorded = true;
  flight.soft = softTarget(passage);
  return flight;
}

bool ScanSimulator::isDetected(const Target& target, double normal) const {
  return std::log(target.signal) + receiver_.detection_sigma * normal > 0.0;
}

Echo ScanSimulator::echoOf(const Target& target, std::uint32_t beam, double normal,
                           double uniform) const {
  double range = target.range + target.range_bias + target.range_sigma * normal;
  if (receiver_.range_unit > 0.0 && !target.is_recorded) {
    range = std::round(range / receiver_.range_unit) * receiver_.range_unit;
  }
  const double noise = target.is_recorded ? 0.0 : receiver_.intensity_noise;
  const double spread = 1.0 + noise * (2.0 * uniform - 1.0);
  const double level = 255.0 * receiver_.intensity_gain * target.reflectivity * spread;
  return {beam, static_cast<float>(range), static_cast<float>(std::round(std::min(255.0, level))),
          target.truth};
}

std::vector<Echo> ScanSimulator::scan(const Firing& firing, ReturnMode mode,
                                      std::uint64_t seed) const {
  const CounterRandom random(seed);
  std::vector<Echo> echoes;
  echoes.reserve(firing.directions.size());
  for (std::uint32_t i = 0; i < firing.directions.size(); ++i) {
    decide(fly(beamOf(firing, i)), i, random, mode, echoes);
  }
  return echoes;
}

std::vector<Echo> ScanSimulator::overlay(const std::vector<MeasuredBeam>& beams,
                                         const Eigen::Isometry3d& pose, ReturnMode mode,
                                         std::uint64_t seed) const {
  const CounterRandom random(seed);
  std::vector<Echo> echoes;
  echoes.reserve(beams.size());
  for (std::uint32_t i = 0; i < beams.size(); ++i) {
    decide(flyMeasured(beams[i], pose), i, random, mode, echoes);
  }
  return echoes;
}

void ScanSimulator::decide(const Flight& flight, std::uint32_t beam, const CounterRandom& random,
                           ReturnMode mode, std::vector<Echo>& echoes) const {
  std::array<Candidate, 3> found;  // nearest first: smoke ends where the pane or the wall begins
  std::size_t count = 0;
  const auto offer = [&](const Target& target, Draw draw) {
    if (!(target.signal > 0.0)) {
      return;  // the dice of what is not there need not be thrown
    }
    const auto normals = random.normals(beam, draw);
    if (isDetected(target, normals.first)) {
      const double uniform = random.uniform(beam, kIntensityDraw + draw);
      found[count++] = {target.signal, echoOf(target, beam, normals.second, uniform)};
    }
  };
  offer(flight.soft, kSoftDraw);
  offer(flight.glass, kGlassDraw);
  offer(flight.hard, kHardDraw);
  report(found, count, mode, echoes);
}

void ScanSimulator::report(const std::array<Candidate, 3>& found, std::size_t count,
                           ReturnMode mode, std::vector<Echo>& echoes) const {
  if (count == 0) {
    return;
  }
  const auto add = [&](const Candidate& candidate) {
    if (candidate.echo.range >= receiver_.min_range &&
        candidate.echo.range <= receiver_.max_range) {
      echoes.push_back(candidate.echo);
    }
  };
  const auto weaker = [](const Candidate& a, const Candidate& b) { return a.signal < b.signal; };
  const Candidate& last = found[count - 1];
  if (mode == ReturnMode::kStrongest) {
    add(*std::max_element(found.begin(), found.begin() + count, weaker));
  } else {
    if (mode == ReturnMode::kDual && count > 1) {  // beside the last, the strongest of the others
      add(*std::max_element(found.begin(), found.begin() + count - 1, weaker));
    }
    add(last);
  }
}

std::vector<BeamTruth> ScanSimulator::expect(const Firing& firing) const {
  std::vector<BeamTruth> expected;
  expected.reserve(firing.directions.size());
  for (std::size_t i = 0; i < firing.directions.size(); ++i) {
    const Beam beam = beamOf(firing, i);
    const Hit hit = world_.castSolid(beam.world_ray, beam.sensor_ray, beam.time);
    const double reach = std::min(hit.range, receiver_.max_range);
    const Hit portal = world_.portal.cast(beam.world_ray, reach);
    const Hit pane = world_.glass.cast(beam.world_ray, reach);
    BeamTruth truth{hit.range, 0.0, 0.0, 0.0, hit.material};
    if (hit.range <= receiver_.max_range) {
      const double panes = pane.isHit() ? std::pow(receiver_.glass_transmission, 2) : 1.0;
      truth.reflectivity = hardTarget(hit, panes).reflectivity;
      if (smoke_ != nullptr) {
        const double smoky = portal.isHit() ? portal.range : reach;
        truth.optical_depth =
            smoke_->march(beam.world_ray, smoky, beam.time, receiver_.limit).optical_depth;
      }
      const double apparent = truth.reflectivity * std::exp(-2.0 * truth.optical_depth);
      truth.probability = detectionProbability(receiver_.limit.signal(apparent, hit.range),
                                               receiver_.detection_sigma);
    }
    expected.push_back(truth);
  }
  return expected;
}

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
