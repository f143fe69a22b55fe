#pragma once

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "smoke_ground_reconstruction/pipeline.hpp"

namespace smoke_ground_reconstruction {

/// The names of an enum's values as they stand in cfg, YAML and Python, in the order of the values.
template <typename Enum>
struct EnumNames;

template <>
struct EnumNames<ThetaUnit> {
  static constexpr std::array<const char*, 2> kNames = {"degrees", "radians"};
};
template <>
struct EnumNames<DenoiserEngine> {
  static constexpr std::array<const char*, 2> kNames = {"window", "kdtree"};
};
template <>
struct EnumNames<RangeStepRule> {
  static constexpr std::array<const char*, 3> kNames = {"minimum", "increasing", "any"};
};
template <>
struct EnumNames<LabelPoint> {
  static constexpr std::array<const char*, 2> kNames = {"first", "second"};
};
template <>
struct EnumNames<ClusterEngine> {
  static constexpr std::array<const char*, 2> kNames = {"kdtree", "grid"};
};
template <>
struct EnumNames<WallDistance> {
  static constexpr std::array<const char*, 2> kNames = {"range", "planar_range"};
};
template <>
struct EnumNames<ReconstructionMethod> {
  static constexpr std::array<const char*, 2> kNames = {"polar_segments", "room_boundary"};
};

template <typename Enum>
std::string enumName(Enum value) {
  return EnumNames<Enum>::kNames[static_cast<std::size_t>(value)];
}

/// \param parameter  its name, for the error.
/// \throws std::invalid_argument listing the names there are.
template <typename Enum>
Enum parseEnum(const std::string& parameter, const std::string& name) {
  std::string known;
  for (std::size_t i = 0; i < EnumNames<Enum>::kNames.size(); ++i) {
    if (name == EnumNames<Enum>::kNames[i]) return static_cast<Enum>(i);
    known += (i == 0 ? "" : ", ") + std::string(EnumNames<Enum>::kNames[i]);
  }
  throw std::invalid_argument(parameter + " must be one of " + known + ", is " + name);
}

}  // namespace smoke_ground_reconstruction
