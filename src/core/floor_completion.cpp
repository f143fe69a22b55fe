#include "smoke_ground_reconstruction/floor_completion.hpp"

#include <algorithm>
#include <cmath>

#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kAtWall = 0.008;    // the claimed floor ends this far before the wall [m]
constexpr double kFill = 0.6;        // claimed floor between rings is drawn so densely, in cells
constexpr double kColumn = 0.00698;  // width of a column at 1 m [m]
constexpr double kFlattest = -1e-3;  // beams that fall by less against the floor never meet it

std::array<float, 3> toLevel(const Matrix3& level_from_upright, float x, float y, float z) {
  const Vector3 level = times(level_from_upright, Vector3{x, y, z});
  return {static_cast<float>(level[0]), static_cast<float>(level[1]), static_cast<float>(level[2])};
}

/// Planar range from which on a column is filled [m]: every 16th from the first step on, those
/// between them from where their neighbours are farther apart than a step.
double fillBegin(std::size_t column, double spacing) {
  int step = 16;
  while (column % static_cast<std::size_t>(step) != 0) step /= 2;
  return step == 16 ? spacing : spacing / (2 * step * kColumn);
}

}  // namespace

void DrawnFloor::clear() {
  points.clear();
  column.clear();
  planar.clear();
  ring.clear();
}

FloorCompletion::FloorCompletion(const AzimuthBins& bins, const ColumnDirections& directions)
    : bins_(bins), directions_(directions) {}

const FloorClaim& FloorCompletion::claim(const Room& room) {
  const std::size_t columns = directions_.count();
  auto& limit = claim_.limit;
  limit.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    const double distance = room.profile().distance[c];
    const double open_end = std::max(room.seenFloor()[c], room.drops().floor_to[c]);
    limit[c] = distance > 0.0 ? std::max(0.0, distance - kAtWall) : open_end;
  }
  const auto& low = room.low();
  is_measured_.assign(low.size(), 0);
  behind_.clear();
  for (std::uint32_t k = 0; k < low.size(); ++k) {
    const std::uint32_t i = low[k];
    const std::size_t c = room.column(i);
    const double planar = room.planar(i);
    if (room.drops().hides(c, planar)) continue;
    if (planar <= limit[c]) {
      is_measured_[k] = room.pastWall(i) <= -kAtWall ? 1 : 0;
    } else if (planar > limit[c] + Room::kBeyond) {
      behind_.push_back(k);
    }
  }
  // Behind an opening the floor is drawn on to what is measured: it goes on in between.
  farthest_.clear(columns);
  for (const std::uint32_t k : behind_) {
    const std::uint32_t i = low[k];
    if (!room.goesOnLevel(i)) continue;
    is_measured_[k] = 1;
    farthest_.add(room.column(i), room.planar(i));
  }
  claim_.measured.clear();
  for (std::size_t k = 0; k < low.size(); ++k) {
    if (is_measured_[k] != 0) claim_.measured.push_back(low[k]);
  }
  farthest_.find(1, &beyond_);
  for (std::size_t c = 0; c < columns; ++c) {
    limit[c] = std::min(std::max(limit[c], beyond_[c]), room.params().max_range);
  }
  return claim_;
}

const DrawnFloor& FloorCompletion::draw(Room* room, const SensorModel& sensor,
                                        const Mounting& mounting) {
  drawn_.clear();
  measured_cells_.clear(room->params().cell_size);
  const Points& points = room->points();
  for (const std::uint32_t i : claim_.measured) measured_cells_.insert(points.x[i], points.y[i]);
  drawBeams(*room, sensor, mounting);
  drawFill(*room);
  raise(&room->relief());
  return drawn_;
}

/// From the plane to the floor.
void FloorCompletion::raise(FloorRelief* relief) {
  if (relief->isFlat()) return;
  Points& points = drawn_.points;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double over = relief->at(points.x[k], points.y[k]);
    points.z[k] = static_cast<float>(points.z[k] + over);
  }
}

/// Where the beams of all rings, at all azimuths, meet the claimed floor.
void FloorCompletion::drawBeams(const Room& room, const SensorModel& sensor,
                                const Mounting& mounting) {
  const Matrix3 turn = times(room.rotation(), mounting.rotation);
  const auto& plane = room.plane();
  const double farthest = *std::max_element(claim_.limit.begin(), claim_.limit.end()) + 1e-3;
  for (const std::uint16_t ring : sensor.ringsByElevation()) {
    const double tangent = sensor.tangent(ring);
    for (const Direction& azimuth : directions_.middle) {
      const Vector3 ray = times(turn, Vector3{azimuth.cosine, azimuth.sine, tangent});
      const double slope = ray[2] - (plane[0] * ray[0] + plane[1] * ray[1]);
      if (!(slope < kFlattest)) continue;
      const double along = plane[2] / slope;
      const auto x = static_cast<float>(along * ray[0]);
      const auto y = static_cast<float>(along * ray[1]);
      const double planar = planarRange(x, y);
      if (planar > farthest) continue;
      const std::size_t column = bins_.index(x, y);
      if (planar > claim_.limit[column]) continue;
      push(room, x, y, static_cast<float>(along * ray[2]), column, planar, ring);
    }
  }
}

/// Floor between the rings and up to the boundary. Columns are left out near the sensor, where they
/// lie closer than need be.
void FloorCompletion::drawFill(const Room& room) {
  const double spacing = kFill * room.params().cell_size;
  for (std::size_t c = 0; c < directions_.count(); ++c) {
    const double limit = claim_.limit[c];
    if (!(limit > 0.0)) continue;
    const double begin = fillBegin(c, spacing);
    const double steps = std::max(0.0, std::ceil((limit - begin) / spacing));
    const auto count = static_cast<std::size_t>(steps);
    for (std::size_t k = 0; k <= count; ++k) {
      const double step = begin + static_cast<double>(k) * spacing;
      const double planar = k < count ? std::min(step, limit) : limit;
      const double x = planar * directions_.middle[c].cosine;
      const double y = planar * directions_.middle[c].sine;
      push(room, x, y, room.floorAt(x, y), c, planar, DrawnFloor::kNoRing);
    }
  }
}

void FloorCompletion::push(const Room& room, double x, double y, double z, std::size_t column,
                           double planar, std::int32_t ring) {
  const auto px = static_cast<float>(x);
  const auto py = static_cast<float>(y);
  if (room.drops().hides(column, planar) || measured_cells_.contains(px, py)) return;
  drawn_.points.push(px, py, static_cast<float>(z));
  drawn_.column.push_back(static_cast<std::uint16_t>(column));
  drawn_.planar.push_back(planar);
  drawn_.ring.push_back(ring);
}

void FloorCompletion::merge(const ScanView& scan, const std::vector<std::uint32_t>& valid,
                            Room* room, const SensorModel& sensor, const Mounting& mounting,
                            const FloorModel& floor, FloorSurface* surface) {
  surface->clear();
  confidence_.look(*room, claim_.limit, claim_.measured);
  appendMeasured(scan, valid, *room, floor, surface);
  appendDrawn(room, sensor, mounting, floor, surface);
  outline(*room, mounting, &surface->boundary);
  surface->floor_plane = rotatedPlane(floor.plane, transposed(mounting.rotation));
}

/// In input order. A range's noise lifts a return by the sine of its grazing angle.
void FloorCompletion::appendMeasured(const ScanView& scan, const std::vector<std::uint32_t>& valid,
                                     const Room& room, const FloorModel& floor,
                                     FloorSurface* surface) const {
  for (const std::uint32_t k : claim_.measured) {
    const std::uint32_t i = valid[k];
    surface->push({scan.x[i], scan.y[i], scan.z[i]}, scan.intensity[i], scan.ring[i],
                  Provenance::kMeasured, confidence_.measured(room.column(k), room.planar(k)));
    const double x = room.points().x[k];
    const double y = room.points().y[k];
    const double z = room.points().z[k];
    const double sine = std::fabs(z) / std::sqrt((x * x + y * y) + z * z);
    surface->sigma.push_back(static_cast<float>(floor.noise * sine));
  }
}

/// The sigma is that of the plane, its unevenness and the relief.
void FloorCompletion::appendDrawn(Room* room, const SensorModel& sensor, const Mounting& mounting,
                                  const FloorModel& floor, FloorSurface* surface) {
  between_rings_.clear();
  const auto& rings = sensor.ringsByElevation();
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    between_rings_.push_back(0.5 * (sensor.tangent(rings[r + 1]) + sensor.tangent(rings[r])));
  }
  const Matrix3 level_from_upright = transposed(room->rotation());
  const Points& points = drawn_.points;
  for (std::size_t k = 0; k < drawn_.size(); ++k) {
    const auto level = toLevel(level_from_upright, points.x[k], points.y[k], points.z[k]);
    const auto point = mounting.toSensor(level[0], level[1], level[2]);
    const std::int32_t ring = drawn_.ring[k];
    const std::uint16_t shown =
        ring == DrawnFloor::kNoRing ? nearestRing(sensor, point) : static_cast<std::uint16_t>(ring);
    surface->push(point, 0.0F, shown, Provenance::kReconstructed,
                  confidence_.drawn(drawn_.column[k], drawn_.planar[k]));
    const double plane = floor.sigma(level[0], level[1]);
    const double relief = room->relief().sigma(points.x[k], points.y[k]);
    surface->sigma.push_back(static_cast<float>(std::sqrt(plane * plane + relief * relief)));
  }
}

/// The ring next in elevation to a point in the sensor frame.
std::uint16_t FloorCompletion::nearestRing(const SensorModel& sensor,
                                           const std::array<float, 3>& point) {
  const auto& rings = sensor.ringsByElevation();
  if (rings.empty()) return 0;
  const double planar = planarRange(point[0], point[1]);
  const double tangent = static_cast<double>(point[2]) / std::max(planar, 1e-6);
  const auto above = std::lower_bound(between_rings_.begin(), between_rings_.end(), tangent);
  return rings[static_cast<std::size_t>(above - between_rings_.begin())];
}

void FloorCompletion::outline(const Room& room, const Mounting& mounting,
                              FloorOutline* boundary) const {
  boundary->vertices.clear();
  boundary->kinds.clear();
  const std::size_t columns = directions_.count();
  const auto radius = [&](std::size_t c) {
    return std::min(claim_.limit[c], room.drops().begin[c]);
  };
  bool claims_any = false;
  for (std::size_t c = 0; c < columns; ++c) claims_any = claims_any || radius(c) > 0.0;
  if (!claims_any) return;
  const Matrix3 level_from_upright = transposed(room.rotation());
  for (std::size_t c = 0; c < columns; ++c) {
    const double r = radius(c);
    if (!(r > 0.0) && !(radius((c + columns - 1) % columns) > 0.0)) continue;
    const bool ends_at_wall =
        r > 0.0 && r >= claim_.limit[c] && claim_.limit[c] <= room.profile().distance[c];
    const double x = r * directions_.middle[c].cosine;
    const double y = r * directions_.middle[c].sine;
    const auto level = toLevel(level_from_upright, static_cast<float>(x), static_cast<float>(y),
                               static_cast<float>(room.floorAt(x, y)));
    boundary->vertices.push_back(mounting.toSensor(level[0], level[1], level[2]));
    boundary->kinds.push_back(ends_at_wall ? room.profile().kind[c]
                                           : BoundaryKind::kLimitOfKnowledge);
  }
}

}  // namespace smoke_ground_reconstruction
