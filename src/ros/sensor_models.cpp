#include "smoke_ground_reconstruction/ros/sensor_models.hpp"

#include <XmlRpcException.h>
#include <XmlRpcValue.h>

#include <stdexcept>

namespace smoke_ground_reconstruction {
namespace {

// YAML turns -15.0 into a double and -15 into an int.
double numberOf(XmlRpc::XmlRpcValue& value) {
  if (value.getType() == XmlRpc::XmlRpcValue::TypeInt) return static_cast<int>(value);
  return static_cast<double>(value);
}

std::vector<double> elevationsOf(XmlRpc::XmlRpcValue& rings) {
  std::vector<double> elevation_deg;
  for (int ring = 0; ring < rings.size(); ++ring) elevation_deg.push_back(numberOf(rings[ring][0]));
  return elevation_deg;
}

}  // namespace

SensorModels::SensorModels(const ros::NodeHandle& nh) {
  const std::string name = "sensor_beams/rings";
  XmlRpc::XmlRpcValue rings;
  if (!nh.getParam(name, rings)) return;
  try {
    seed_ = SensorModel::fromElevations(elevationsOf(rings));
  } catch (const XmlRpc::XmlRpcException&) {
    throw std::invalid_argument(nh.resolveName(name) +
                                " is no list of [elevation_deg, azimuth_offset_deg]");
  }
}

const SensorModel& SensorModels::observe(const std::string& frame_id, const ScanView& scan) {
  SensorModel& model = modelOf(frame_id);
  model.observe(scan);
  return model;
}

const SensorModel& SensorModels::observe(const std::string& frame_id, const ScanView& scan,
                                         const std::vector<std::size_t>& points_by_ring) {
  SensorModel& model = modelOf(frame_id);
  model.observe(scan, points_by_ring);
  return model;
}

SensorModel& SensorModels::modelOf(const std::string& frame_id) {
  return models_.emplace(frame_id, seed_).first->second;
}

}  // namespace smoke_ground_reconstruction
