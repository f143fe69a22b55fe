#pragma once

#include <cmath>
#include <cstdint>

namespace smoke_ground_reconstruction {
namespace simulation {

/// Random numbers as a function of (seed, stream, counter): the same whatever the order of the
/// rays, the number of threads or the machine's word size. Mixing function: splitmix64 (Steele,
/// Lea, Flood 2014).
class CounterRandom {
 public:
  explicit CounterRandom(std::uint64_t seed) : seed_(mix(seed + 0x9E3779B97F4A7C15ULL)) {}

  /// 64 well-mixed bits.
  std::uint64_t bits(std::uint64_t stream, std::uint64_t counter) const {
    return mix(mix(seed_ ^ mix(stream + 0xD1B54A32D192ED03ULL)) + counter);
  }

  /// Uniform in (0, 1): never 0, never 1.
  double uniform(std::uint64_t stream, std::uint64_t counter) const {
    return (static_cast<double>(bits(stream, counter) >> 12) + 0.5) / 4503599627370496.0;
  }

  /// A pair of independent standard normal numbers (Box and Muller).
  struct Normals {
    double first;
    double second;
  };
  Normals normals(std::uint64_t stream, std::uint64_t counter) const {
    const double radius = std::sqrt(-2.0 * std::log(uniform(stream, 2 * counter)));
    const double angle = 6.283185307179586 * uniform(stream, 2 * counter + 1);
    return {radius * std::cos(angle), radius * std::sin(angle)};
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }

  std::uint64_t seed_;
};

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
