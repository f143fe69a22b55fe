#pragma once

#include <cstdint>

namespace smoke_ground_reconstruction {

/// What a stage says of one input point. The values are part of the Python interface.
enum class Label : std::uint8_t {
  kInvalid = 0,  ///< no return: isReturn() of scan.hpp
  kKept = 1,     ///< survived denoising; in the segmenter's answer: neither ground nor wall
  kNoise = 2,    ///< removed by the denoiser
  kGround = 3,
  kWall = 4,
};

/// Cluster number of a point that belongs to no cluster.
constexpr std::uint32_t kNoCluster = 0xFFFFFFFFU;

}  // namespace smoke_ground_reconstruction
