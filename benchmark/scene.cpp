#include "scene.hpp"

#include <cstring>
#include <map>
#include <memory>

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kPointStep = 26;

Label labelOf(Surface surface) {
  if (surface == Surface::kFloor) return Label::kGround;
  return surface == Surface::kWall ? Label::kWall : Label::kKept;
}

/// Moves a point along its ray to a range [m].
void moveTo(double target, std::size_t i, Cloud* cloud) {
  const double x = cloud->x[i];
  const double y = cloud->y[i];
  const double z = cloud->z[i];
  const double factor = target / std::sqrt(x * x + y * y + z * z);
  cloud->x[i] = static_cast<float>(x * factor);
  cloud->y[i] = static_cast<float>(y * factor);
  cloud->z[i] = static_cast<float>(z * factor);
}

void fillWithSmoke(Cloud* cloud, std::vector<Label>* labels) {
  Uniform uniform(1);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const bool is_floor = (*labels)[i] == Label::kGround;
    const double dark = uniform(5.0, 40.0);
    const double bright = uniform(100.0, 160.0);
    const double smoke = uniform(1.0, 10.0);
    const double depth = uniform(0.3, 0.85);  // the floor begins 0.88 m away
    const bool is_smoke = uniform(0.0, 1.0) < 0.1;
    cloud->intensity[i] = static_cast<float>(is_smoke ? smoke : (is_floor ? dark : bright));
    if (!is_smoke) continue;
    (*labels)[i] = Label::kNoise;
    moveTo(depth, i, cloud);
  }
}

std::vector<unsigned char> packed(const Cloud& cloud) {
  std::vector<unsigned char> bytes(cloud.size() * kPointStep);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    unsigned char* point = &bytes[i * kPointStep];
    const float fields[] = {cloud.x[i], cloud.y[i], cloud.z[i], cloud.intensity[i]};
    std::memcpy(point, fields, sizeof(fields));
    std::memcpy(point + sizeof(fields), &cloud.ring[i], sizeof(std::uint16_t));
  }
  return bytes;
}

}  // namespace

Scene::Scene(int rings) {
  BoxRoom room;
  room.elevations_deg = evenElevations(rings, -52.6, 52.6);
  sensor = SensorModel::fromElevations(room.elevations_deg);
  std::vector<Surface> surfaces;
  cloud = room.scan(&surfaces);
  for (const Surface surface : surfaces) labels.push_back(labelOf(surface));
  fillWithSmoke(&cloud, &labels);
  packed = smoke_ground_reconstruction::packed(cloud);
}

ScanView Scene::packedView() const {
  ScanView view;
  view.x = {packed.data(), kPointStep};
  view.y = {packed.data() + 4, kPointStep};
  view.z = {packed.data() + 8, kPointStep};
  view.intensity = {packed.data() + 12, kPointStep};
  view.ring = {packed.data() + 16, kPointStep};
  view.size = cloud.size();
  return view;
}

const Scene& sceneOf(int rings) {
  static std::map<int, std::unique_ptr<const Scene>> scenes;
  auto& scene = scenes[rings];
  if (!scene) scene = std::make_unique<const Scene>(rings);
  return *scene;
}

Cloud pointsOf(const Scene& scene, Label label) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < scene.labels.size(); ++i) {
    if (scene.labels[i] == label) indices.push_back(i);
  }
  return scene.cloud.select(indices);
}

}  // namespace smoke_ground_reconstruction
