#pragma once

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <type_traits>

namespace smoke_ground_reconstruction {

/// What is asked of a width of azimuth bins.
constexpr const char* kCircleDivisor = "a divisor of 360 deg from 0.01 to 90";

/// Refuses a parameter in one line: "<name> must be <rule>, is <value>".
/// \throws std::invalid_argument where `holds` is false or the value is not finite.
template <typename T>
void require(bool holds, std::string_view name, std::string_view rule, const T& value) {
  bool is_finite = true;
  if constexpr (std::is_floating_point_v<T>) is_finite = std::isfinite(value);
  if (holds && is_finite) return;
  std::ostringstream text;
  text << name << " must be " << (is_finite ? rule : std::string_view("a finite number")) << ", is "
       << value;
  throw std::invalid_argument(text.str());
}

/// The parameters themselves, for constructors whose members are made from them.
template <typename Params>
const Params& validated(const Params& params) {
  params.validate();
  return params;
}

}  // namespace smoke_ground_reconstruction
