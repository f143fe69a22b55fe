#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "smoke_ground_reconstruction/enum_names.hpp"

namespace smoke_ground_reconstruction {

/// An enum member seen from Python as the string that stands in cfg and YAML.
template <typename Class, typename Struct, typename Enum>
void defineEnum(Class& binding, const char* name, Enum Struct::*member) {
  const std::string parameter = name;
  binding.def_property(
      name, [member](const Struct& self) { return enumName(self.*member); },
      [member, parameter](Struct& self, const std::string& value) {
        self.*member = parseEnum<Enum>(parameter, value);
      });
}

}  // namespace smoke_ground_reconstruction
