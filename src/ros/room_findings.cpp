#include "smoke_ground_reconstruction/ros/room_findings.hpp"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace smoke_ground_reconstruction {
namespace {

constexpr double kHeightTolerance = 0.03;  // between given and measured height of the sensor [m]

std::string text(double value, int digits) {
  std::ostringstream stream;
  stream << std::fixed << std::setprecision(digits) << value;
  return stream.str();
}

std::string heightFrom(FloorSource source, const GivenHeight& given) {
  switch (source) {
    case FloorSource::kMeasured:
      return "this scan";
    case FloorSource::kMeasuredBefore:
      return "an earlier scan";
    case FloorSource::kMounting:
      break;
  }
  return given.from;
}

}  // namespace

Findings findingsOf(const FloorModel& floor, const Visibility& visibility,
                    const GivenHeight& given) {
  const auto told = [&visibility](double value, int digits) {
    return visibility.isKnown() ? text(value, digits) : "unknown";
  };
  return {{"sensor height given [m]", text(given.height, 3)},
          {"sensor height measured [m]", text(-floor.plane[2], 3)},
          {"floor's height from", heightFrom(floor.source, given)},
          {"extinction [1/m]", told(visibility.extinction, 3)},
          {"extinction sigma [1/m]", told(visibility.sigma, 3)},
          {"meteorological range [m]", told(visibility.meteorologicalRange(), 1)}};
}

std::string heightWarning(const FloorModel& floor, const GivenHeight& given) {
  if (floor.source == FloorSource::kMounting) {
    return "the floor's height is not measured, " + given.from +
           " is believed: too few returns lie about " + text(given.height, 2) +
           " m below the sensor (thick smoke, or a wrong height)";
  }
  const double measured = -floor.plane[2];
  if (std::abs(measured - given.height) <= kHeightTolerance) return "";
  return given.from + " puts the sensor " + text(given.height, 2) +
         " m above the floor, measured is " + text(measured, 2) + " m";
}

}  // namespace smoke_ground_reconstruction
