#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace smoke_ground_reconstruction {

/// Refuses a parameter in one line: "<name> must be <rule>, is <value>".
/// \throws std::invalid_argument where `holds` is false.
template <typename T>
void require(bool holds, const std::string& name, const std::string& rule, const T& value) {
  if (holds) return;
  std::ostringstream text;
  text << name << " must be " << rule << ", is " << value;
  throw std::invalid_argument(text.str());
}

}  // namespace smoke_ground_reconstruction
