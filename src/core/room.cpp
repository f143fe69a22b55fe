#include "smoke_ground_reconstruction/room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOnFloor = 0.03;            // a return so near to the plane may be floor [m]
constexpr double kLevelBand = 5 * kOnFloor;  // heights that tell how level the floor is [m]
constexpr double kLowestWall = 0.1;          // and one so far above it may be wall [m]
constexpr double kNearestWall = 0.2;         // planar range [m]
constexpr double kBelowCeiling = 0.05;
constexpr double kWallFoot = 0.05;     // returns so near to a wall's line may be its foot [m]
constexpr double kSoftRange = 1.5;     // smoke's own returns come from nearer [m]
constexpr double kSoftFactor = 2.0;    // and are at most so many times as strong as the floor's
constexpr double kFloorRange = 2.5;    // at that range [m]
constexpr double kPlumb = 0.99998629;  // floors tilted by less than 0.3 deg are taken as level
constexpr int kSlopeSlots = 2048;
constexpr double kSlotsPerSlope = 128.0;
constexpr std::size_t kSteeper = 1000;  // one return in so many may lie above the highest beam

bool isIdentity(const Matrix3& m) { return m == Matrix3{1, 0, 0, 0, 1, 0, 0, 0, 1}; }

}  // namespace

void FarthestReturns::clear(std::size_t columns) { ranges_.assign(columns, {0.0F, 0.0F, 0.0F}); }

void FarthestReturns::add(std::size_t column, float planar) {
  auto& ranges = ranges_[column];
  if (planar <= ranges[2]) return;
  ranges[2] = planar;
  if (ranges[2] > ranges[1]) std::swap(ranges[1], ranges[2]);
  if (ranges[1] > ranges[0]) std::swap(ranges[0], ranges[1]);
}

void FarthestReturns::find(std::size_t beside, std::vector<double>* farthest) const {
  const std::size_t columns = ranges_.size();
  farthest->resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    float most = 0.0F;
    for (std::size_t k = 0; k <= 2 * beside; ++k) {
      most = std::max(most, ranges_[(c + columns + k - beside) % columns][2]);
    }
    (*farthest)[c] = most;
  }
}

Room::Room(const AzimuthBins& bins) : bins_(bins) {}

void Room::look(const Points& level, const std::vector<float>& intensity, const FloorModel& floor,
                const std::array<double, 9>& rotation) {
  rotation_ = rotation;
  plane_ = rotatedPlane(floor.plane, rotation);
  takeIn(level);
  view_ = {ceiling_finder_.find(height_, planar_, column_, bins_.count()), -plane_[2], 0.0};
  sortOut(intensity);
  wall_returns_.sort(bins_.count());
  post_finder_.find(wall_returns_, &posts_);
}

/// Coordinates in the upright frame, what follows from them, and what is low.
void Room::takeIn(const Points& level) {
  const std::size_t n = level.size();
  for (auto* values : {&points_.x, &points_.y, &points_.z, &planar_, &height_}) values->resize(n);
  column_.resize(n);
  flags_.resize(n);
  const bool is_level = isIdentity(rotation_);
  for (std::size_t i = 0; i < n; ++i) {
    Vector3 p = {level.x[i], level.y[i], level.z[i]};
    if (!is_level) p = times(rotation_, p);
    points_.x[i] = static_cast<float>(p[0]);
    points_.y[i] = static_cast<float>(p[1]);
    points_.z[i] = static_cast<float>(p[2]);
    const double x = points_.x[i];
    const double y = points_.y[i];
    const double z = points_.z[i];
    planar_[i] = static_cast<float>(std::sqrt(x * x + y * y));
    height_[i] = static_cast<float>(z - floorAt(x, y));
    column_[i] = static_cast<std::uint16_t>(bins_.index(points_.x[i], points_.y[i]));
    const bool is_low =
        std::fabs(static_cast<double>(height_[i])) < kOnFloor && planar_[i] < kFarthest;
    flags_[i] = is_low ? kLow : 0;
  }
}

/// Range-free strength below which a near return is smoke; NaN where the floor does not tell.
/// Intensity enters as a ratio to the floor's, so the sensor's scale does not matter. The mean:
/// where smoke leaves whole numbers of 0 and 1, a median would be 0.
double Room::softGate(const std::vector<float>& intensity) const {
  OrderedSum strength;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!isLow(i) || !(planar_[i] < kFloorRange)) continue;
    const double x = points_.x[i];
    const double y = points_.y[i];
    const double z = points_.z[i];
    strength.add(intensity[i] * ((x * x + y * y) + z * z));
  }
  return kSoftFactor * (strength.value() / static_cast<double>(strength.count()));
}

/// Soft returns of smoke near the sensor, and what can be wall.
void Room::sortOut(const std::vector<float>& intensity) {
  const double gate = softGate(intensity);
  wall_returns_.clear();
  slope_counts_.assign(2 * kSlopeSlots, 0);
  const double highest = view_.ceiling - kBelowCeiling;
  for (std::size_t i = 0; i < size(); ++i) {
    const double x = points_.x[i];
    const double y = points_.y[i];
    const double z = points_.z[i];
    if (planar_[i] > kNearestWall) {
      const double slope = z / planar_[i] * kSlotsPerSlope;
      const int slot =
          floorToInt(std::max<double>(-kSlopeSlots, std::min(kSlopeSlots - 1.0, slope)));
      ++slope_counts_[static_cast<std::size_t>(slot + kSlopeSlots)];
    }
    if (!(height_[i] > kLowestWall)) continue;
    const double square = (x * x + y * y) + z * z;
    if (square < kSoftRange * kSoftRange && intensity[i] * square < gate) {
      flags_[i] |= kSoft;
    } else if (height_[i] < highest && planar_[i] > kNearestWall && planar_[i] < kFarthestWall) {
      flags_[i] |= kMaybeWall;
      wall_returns_.push(column_[i], planar_[i], height_[i], points_.x[i], points_.y[i]);
    }
  }
}

/// Tangent of the elevation up to which all but one return in a thousand lie, in steps.
double Room::steepest() {
  std::size_t total = 0;
  for (const std::uint32_t count : slope_counts_) total += count;
  if (total == 0) return 0.0;
  std::size_t above = 0;
  int slot = 2 * kSlopeSlots;
  while (above <= total / kSteeper) above += slope_counts_[static_cast<std::size_t>(--slot)];
  return (slot + 1 - kSlopeSlots) / kSlotsPerSlope;
}

std::size_t Room::postReturns() const {
  std::size_t returns = 0;
  for (const std::uint32_t count : posts_.count) returns += count;
  return returns;
}

void Room::findWalls(const ColumnDirections& directions) {
  findRelief();
  view_.steepest = steepest();
  line_finder_.find(posts_, &lines_);
  support_.find(wall_returns_, lines_, directions, view_);
  markFeetOfWalls(directions);
  findSeen();
  profile_finder_.find(posts_, support_, view_, beyond_, level_floor_, directions, &profile_);
  findDrops(directions);
  const bool drops = std::any_of(drops_.begin.begin(), drops_.begin.end(),
                                 [](double begin) { return begin < kInfinity; });
  if (drops) return;
  // A ceiling seen overhead has a floor beneath, unless floors are known to end here.
  for (std::size_t c = 0; c < seen_floor_.size(); ++c) {
    seen_floor_[c] = std::max(seen_floor_[c], seen_ceiling_[c] - kBeyond);
  }
}

/// Floor off the plane is as low as that on it.
void Room::findRelief() {
  relief_returns_.clear();
  for (std::size_t i = 0; i < size(); ++i) {
    if (isSoft(i) || !(height_[i] > ReliefGrid::kLowest && height_[i] < ReliefGrid::kHighest)) {
      continue;
    }
    relief_returns_.push(points_.x[i], points_.y[i], height_[i], planar_[i]);
  }
  relief_.find(relief_returns_);
  if (relief_.isFlat()) return;
  for (std::size_t i = 0; i < size(); ++i) {
    if (isSoft(i) || !(planar_[i] < kFarthest)) continue;
    if (relief_.carries(points_.x[i], points_.y[i], height_[i])) flags_[i] |= kLow;
  }
}

void Room::markFeetOfWalls(const ColumnDirections& directions) {
  windows_.clear();
  window_line_.clear();
  window_begin_.assign(1, 0);
  for (std::size_t c = 0; c < directions.count(); ++c) {
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      const RangeWindow window = windowOf(lines_, line, directions, c, kWallFoot);
      if (window.lowest > window.highest) continue;
      windows_.push_back(window);
      window_line_.push_back(static_cast<std::uint32_t>(line));
    }
    window_begin_.push_back(static_cast<std::uint32_t>(windows_.size()));
  }
  for (std::size_t i = 0; i < size(); ++i) {
    if (!isLow(i)) continue;
    const float planar = planar_[i];
    for (std::size_t w = window_begin_[column_[i]]; w < window_begin_[column_[i] + 1U]; ++w) {
      if (planar < windows_[w].lowest || planar > windows_[w].highest) continue;
      if (lines_.distance(window_line_[w], points_.x[i], points_.y[i]) >= kWallFoot) continue;
      flags_[i] |= kAtWall;
      break;
    }
  }
}

/// How far floor and ceiling are measured.
void Room::findSeen() {
  level_cells_.clear();
  for (std::size_t i = 0; i < size(); ++i) {
    const double height = height_[i];
    if (!(std::fabs(height) < kLevelBand) || !(planar_[i] < kFarthest)) continue;
    level_cells_.add(points_.x[i], points_.y[i], height);
  }
  const auto is_floor = [&](std::size_t i) { return (flags_[i] & (kLow | kAtWall)) == kLow; };
  farthest_.clear(bins_.count());
  for (std::size_t i = 0; i < size(); ++i) {
    // A riser has floor at its foot.
    const bool is_seen =
        is_floor(i) || (!isSoft(i) && relief_.isRiser(points_.x[i], points_.y[i], height_[i]));
    if (is_seen) farthest_.add(column_[i], planar_[i]);
  }
  farthest_.find(2, &seen_floor_);
  farthest_.clear(bins_.count());
  for (std::size_t i = 0; i < size(); ++i) {
    if (is_floor(i) && goesOnLevel(i)) farthest_.add(column_[i], planar_[i]);
  }
  farthest_.find(2, &level_floor_);
  farthest_.clear(bins_.count());
  for (std::size_t i = 0; view_.ceiling < kInfinity && i < size(); ++i) {
    const double off = static_cast<double>(height_[i]) - view_.ceiling;
    if (std::fabs(off) < kBelowCeiling) farthest_.add(column_[i], planar_[i]);
  }
  farthest_.find(2, &seen_ceiling_);
  beyond_.resize(seen_floor_.size());
  for (std::size_t c = 0; c < beyond_.size(); ++c) {
    beyond_[c] = std::max(seen_floor_[c], seen_ceiling_[c]);
  }
}

void Room::findDrops(const ColumnDirections& directions) {
  drop_returns_.column.clear();
  drop_returns_.planar.clear();
  drop_returns_.height.clear();
  drop_returns_.is_floor.clear();
  for (std::size_t i = 0; i < size(); ++i) {
    const double distance = profile_.distance[column_[i]];
    const bool is_open = distance == 0.0;
    if (!is_open && !(planar_[i] < distance + 2 * kBeyond)) continue;
    const bool is_floor =
        (flags_[i] & (kLow | kAtWall)) == kLow && (is_open || planar_[i] < distance - kWallFoot);
    drop_returns_.column.push_back(column_[i]);
    drop_returns_.planar.push_back(planar_[i]);
    drop_returns_.height.push_back(height_[i]);
    drop_returns_.is_floor.push_back(is_floor ? 1 : 0);
  }
  wall_normals_.clear();
  for (std::size_t line = 0; line < lines_.size(); ++line) {
    const auto number = static_cast<std::int32_t>(line);
    const bool bounds =
        std::find(profile_.line.begin(), profile_.line.end(), number) != profile_.line.end();
    if (bounds) wall_normals_.push_back({lines_.nx[line], lines_.ny[line]});
  }
  drop_finder_.find(drop_returns_, -plane_[2], directions.middle, wall_normals_, &drops_);
}

double Room::pastWall(std::size_t i) const {
  const std::int32_t line = profile_.line[column_[i]];
  if (line < 0) return -kInfinity;
  const auto l = static_cast<std::size_t>(line);
  return (lines_.nx[l] * points_.x[i] + lines_.ny[l] * points_.y[i]) - lines_.rho[l];
}

bool Room::isWall(std::size_t i) const {
  return (flags_[i] & kMaybeWall) != 0 && std::fabs(pastWall(i)) < kWallFoot;
}

Visibility Room::visibility(const std::vector<float>& intensity, VisibilityEstimator* estimator) {
  wall_light_.clear();
  for (std::size_t i = 0; i < size(); ++i) {
    if (!isWall(i)) continue;
    const std::int32_t line = profile_.line[column_[i]];
    const auto l = static_cast<std::size_t>(line);
    const double x = points_.x[i];
    const double y = points_.y[i];
    const double z = points_.z[i];
    const double range = std::sqrt((x * x + y * y) + z * z);
    const double cosine = std::fabs(lines_.nx[l] * x + lines_.ny[l] * y) / range;
    wall_light_.push(line, range, intensity[i], cosine);
  }
  return estimator->estimate(wall_light_);
}

std::vector<std::array<double, 9>> uprightCandidates(const std::array<double, 3>& plane) {
  const double a = plane[0];
  const double b = plane[1];
  const double length = std::sqrt((a * a + b * b) + 1.0);
  const double x = -a / length;
  const double y = -b / length;
  const double z = 1.0 / length;
  const Matrix3 level = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (z > kPlumb) return {level};
  const double rest = 1.0 / (1.0 + z);
  const double across = -(x * y) * rest;
  return {level, {1.0 - x * x * rest, across, -x, across, 1.0 - y * y * rest, -y, x, y, z}};
}

std::array<double, 3> rotatedPlane(const std::array<double, 3>& plane,
                                   const std::array<double, 9>& rotation) {
  const Vector3 normal = times(rotation, Vector3{-plane[0], -plane[1], 1.0});
  return {-normal[0] / normal[2], -normal[1] / normal[2], plane[2] / normal[2]};
}

}  // namespace smoke_ground_reconstruction
