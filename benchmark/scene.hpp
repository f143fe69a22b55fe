#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "clouds.hpp"
#include "smoke_ground_reconstruction/label.hpp"
#include "smoke_ground_reconstruction/scan.hpp"
#include "smoke_ground_reconstruction/sensor_model.hpp"

namespace smoke_ground_reconstruction {

/// One scan of a room of 6.8 x 6 m from 0.7 m above its floor: `rings` beams from -52.6 to 52.6 deg
/// at 900 azimuths. One beam in ten ends in smoke 0.3 to 0.85 m away, at an intensity below 10; the
/// floor is dark (5 to 40), so that of 115,200 points about 34,000 are below 25.
struct Scene {
  explicit Scene(int rings);

  /// The points as a driver packs them: x y z intensity float32, ring uint16, a double behind.
  ScanView packedView() const;

  Cloud cloud;
  SensorModel sensor;
  std::vector<Label> labels;  ///< what lies where, noise included
  std::vector<unsigned char> packed;
};

/// The scene of that many rings, made once.
const Scene& sceneOf(int rings);

/// Its points of one label.
Cloud pointsOf(const Scene& scene, Label label);

/// The ring counts that every benchmark runs with.
inline void ringCounts(benchmark::internal::Benchmark* bench) {
  bench->ArgName("rings")->Unit(benchmark::kMillisecond);
  for (const int rings : {16, 32, 64, 128}) bench->Arg(rings);
}

}  // namespace smoke_ground_reconstruction
