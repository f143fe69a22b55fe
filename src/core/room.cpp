#include "smoke_ground_reconstruction/room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "multiversion.hpp"
#include "ordered.hpp"
#include "point_loops.hpp"
#include "sample.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOnFloor = 0.03;  // a return so near to the plane may be floor [m]
constexpr double kOnFloorMost = 0.06;
constexpr double kUnevenness = 3.0;  // or within so many sigma of the floor's own height
constexpr double kLevelShare = 0.4;  // floor behind an opening must go on as level as this of it
constexpr double kLevelBand = 5.0;   // and tells so by heights up to so many times of it
constexpr double kRises = 0.02;      // floor so far over its plane rises [m]
constexpr double kHiddenSlope = 1.0 / 12.0;  // half the steepest ramp's
constexpr double kDrop = 0.01;  // what lies so much lower than floor can, tells of a drop [m]
constexpr double kReliefLowest = 0.15, kReliefHighest = 0.8;  // heights that relief looks at [m]
constexpr double kNearestWall = 0.2;                          // planar range [m]
constexpr double kFeetShare = 0.2;     // of a plane's returns at walls: more than most floors have
constexpr double kUnderPlane = 0.005;  // walls end at the floor: returns so far below a plane [m]
constexpr double kUnderShare = 0.05;   // are few of those near it where it is one
constexpr double kPostFoot = 0.06;  // planar range between a post and the returns at its place [m]
constexpr std::size_t kPostsBeside = 2;  // columns
constexpr double kBelowCeiling = 0.05;
constexpr double kWallFoot = 0.05;         // returns so near to a wall's line may be its foot [m]
constexpr double kSoftRange = 1.5;         // smoke's own returns come from nearer [m]
constexpr double kFloorRange = 2.5;        // at that range [m]
constexpr double kPlumb = 0.99998629;      // floors tilted by less than 0.3 deg are taken as level
constexpr std::size_t kWallLights = 2000;  // returns of walls, at least, that tell the smoke
constexpr int kSlopeSlots = 2048;
constexpr double kSlotsPerSlope = 128.0;
// Returns are thinned out to the cube root of this times the floor's returns: where a cell of 0.2 m
// would have ten of these [m^3].
constexpr double kThinned = 1.2e-3;
constexpr std::size_t kPairs = 64;
constexpr std::size_t kLookedAt = 4000;   // returns, at least, that tell the highest beam
constexpr std::size_t kStrengths = 1000;  // returns of floor, at least, if there are as many
constexpr std::size_t kSteeper = 1000;    // one return in so many may lie above the highest beam

/// Appends the returns of a column that stand on a line, by their number in the scan; returns the
/// list's end. Most lie where all do.
std::uint32_t* listNear(const WallReturns& returns, const Line& line, std::size_t column,
                        const RangeWindow& window, const RangeWindow& sure, double half,
                        std::uint32_t* end) {
  if (window.isEmpty()) return end;
  const std::uint32_t *const key = returns.key.data(), *const index = returns.index.data();
  const float *const x = returns.of->points->x.data(), *const y = returns.of->points->y.data();
  const std::size_t column_end = returns.column_begin[column + 1];
  const std::uint32_t last = WallReturns::lastKeyIn(column, window);
  const std::uint32_t last_before = std::min(last, WallReturns::firstKeyIn(column, sure));
  const std::uint32_t first_after = std::min(last, WallReturns::lastKeyIn(column, sure));
  std::size_t k = returns.firstIn(column, window);
  const auto look_up_to = [&](std::uint32_t last_key) {
    for (; k < column_end && key[k] <= last_key; ++k) {
      *end = index[k];
      end += line.distance(x[index[k]], y[index[k]]) < half ? 1 : 0;
    }
  };
  look_up_to(last_before);
  for (; k < column_end && key[k] < first_after; ++k) *end++ = index[k];
  look_up_to(last);
  return end;
}

/// Marks returns about the floor's height that are no smoke, the nearer ones thinned: of those at a
/// planar range r a share of r^3 / cube [m^3], for a floor's returns grow denser by that.
SMOKE_GROUND_MULTIVERSION
void markThinned(const float* planar, const std::uint8_t* flags, std::size_t size, double cube,
                 std::uint8_t* is_in) {
  constexpr int kBits = 24;  // which single precision holds
  const auto per_cube = static_cast<float>(static_cast<double>(1 << kBits) / cube);
  for (std::size_t i = 0; i < size; ++i) {
    // The parts of multiples of the golden ratio are evenly spread in any row of them.
    const auto part =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(i) * 0x9E3779B1U >> (32 - kBits));
    const float share = planar[i] * planar[i] * planar[i] * per_cube;
    const int is_hard =
        (flags[i] & (ReturnKind::kNear | ReturnKind::kSoft)) == ReturnKind::kNear ? 1 : 0;
    is_in[i] = static_cast<std::uint8_t>(is_hard & (static_cast<float>(part) < share ? 1 : 0));
  }
}

}  // namespace

void FarthestReturns::clear(std::size_t columns) { ranges_.assign(columns, Ranges()); }

/// Some pairs of returns that follow each other tell.
bool FarthestReturns::isRising(const std::vector<std::uint32_t>& list,
                               const UprightReturns& returns) {
  const Sample some(list.size(), kPairs);
  std::size_t rising = 0;
  for (std::size_t k = 1; k < some.size(); ++k) {
    const std::uint32_t one = list[some[k] - 1], next = list[some[k]];
    const bool is_same = returns.column[one] == returns.column[next];
    rising += is_same && returns.planar[next] > returns.planar[one] ? 1U : 0U;
  }
  return 2 * rising > some.size();
}

void FarthestReturns::find(std::size_t beside, std::vector<double>* farthest) {
  own_.resize(ranges_.size());
  for (std::size_t c = 0; c < ranges_.size(); ++c) own_[c] = ranges_[c].third;
  greatestBeside(own_, beside, farthest);
}

Room::Room(const AzimuthBins& bins) : bins_(bins) {}

void Room::look(const Points& level, const std::vector<float>& intensity, const FloorModel& floor,
                const std::array<double, 9>& rotation, const RoomBoundaryParams& params) {
  params_ = params;
  tolerance_ = params.floor_tolerance > 0.0 ? params.floor_tolerance : floorTolerance(floor);
  lift_ = params.floor_tolerance > 0.0 ? 0.0 : floorLift(floor);
  rotation_ = rotation;
  plane_ = rotatedPlane(floor.plane, rotation);
  has_level_cells_ = has_level_floor_ = false;
  drops_by_ = DropTolerances();
  drops_by_.depth = params.drop_depth > 0.0 ? params.drop_depth : tolerance_ + kDrop;
  drops_by_.lift = params.drop_depth > 0.0 ? 0.0 : lift_;
  takeIn(level);
  view_ = {ceiling_finder_.find(returns_, bins_.count()), -plane_[2], 0.0, params.furniture_height};
  sortOut(intensity);
  wall_returns_.take(returns_, maybe_wall_, bins_.count());
  spread_ = spread_finder_.find(wall_returns_);
  widening_ = wideningFor(spread_);
  drops_by_.widen(widening_);
  post_finder_.find(wall_returns_, widening_, &posts_);
  placePosts();
}

/// Coordinates in the upright frame and what follows from them.
void Room::takeIn(const Points& level) {
  const std::size_t n = level.size();
  const bool is_turned = rotation_ != kIdentity;
  returns_.points = is_turned ? &turned_ : &level;
  if (is_turned) {
    for (auto* values : {&turned_.x, &turned_.y, &turned_.z}) values->resize(n);
  }
  for (auto* values : {&returns_.planar, &returns_.height}) values->resize(n);
  returns_.column.resize(n);
  std::array<std::uint32_t, kTogether> bin;
  for (std::size_t begin = 0; begin < n; begin += kTogether) {
    const std::size_t size = std::min(kTogether, n - begin);
    if (is_turned) {
      turnPoints({&level.x[begin], &level.y[begin], &level.z[begin], size}, rotation_,
                 &turned_.x[begin], &turned_.y[begin], &turned_.z[begin]);
    }
    const float *const x = &points().x[begin], *const y = &points().y[begin];
    rangesAndHeights({x, y, &points().z[begin], size}, plane_, &returns_.planar[begin],
                     &returns_.height[begin]);
    bins_.indices(x, y, size, bin.data());
    std::copy_n(bin.data(), size, &returns_.column[begin]);
  }
}

/// Range-free strength below which a near return is smoke; NaN where the floor does not tell.
/// Intensity enters as a ratio to the floor's, so the sensor's scale does not matter.
double Room::softGate(const std::vector<float>& intensity) const {
  const Sample some(low_.size()), all(low_.size(), low_.size());
  OrderedSum strength = floorStrength(intensity, some);
  if (strength.count() < kStrengths && some.size() < all.size()) {
    strength = floorStrength(intensity, all);
  }
  return params_.smoke_gate * (strength.value() / static_cast<double>(strength.count()));
}

/// The mean of this: where smoke leaves whole numbers of 0 and 1, a median would be 0.
OrderedSum Room::floorStrength(const std::vector<float>& intensity, const Sample& sample) const {
  OrderedSum strength;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const std::uint32_t i = low_[sample[k]];
    if (!(std::fabs(height(i)) < tolerance_) || !(planar(i) < kFloorRange)) continue;
    const double x = points().x[i];
    const double y = points().y[i];
    const double z = points().z[i];
    strength.add(intensity[i] * ((x * x + y * y) + z * z));
  }
  return strength;
}

/// Lists what later steps look at.
void Room::sortOut(const std::vector<float>& intensity) {
  const double band = kLevelBand * tolerance_;
  KindBounds bounds{};
  bounds.low = tolerance_;
  bounds.low_range = params_.max_range;
  bounds.lift_square = lift_ * lift_;
  bounds.deep = -drops_by_.depth;
  bounds.near_lowest = -std::max(kReliefLowest, band);
  bounds.near_highest = std::max(kReliefHighest, band);
  bounds.above = params_.min_wall_height;
  bounds.wall_highest = view_.ceiling - kBelowCeiling;
  bounds.wall_nearest = kNearestWall;
  bounds.wall_farthest = kFarthestWall;
  bounds.ceiling_lowest = view_.ceiling - kBelowCeiling;
  bounds.ceiling_highest = view_.ceiling + kBelowCeiling;
  bounds.soft_square = kSoftRange * kSoftRange;
  flags_.resize(size());
  const float *const ranges = returns_.planar.data(), *const z = points().z.data();
  findKinds(ranges, z, returns_.height.data(), size(), bounds, flags_.data());
  listKind(flags_, ReturnKind::kLow, &low_);
  judgeSoft(ranges, z, intensity.data(), size(), softGate(intensity), flags_.data());
  listKind(flags_, ReturnKind::kDeep, &deep_);
  has_near_ = false;
  listKind(flags_, ReturnKind::kMayBeWall, &maybe_wall_);
  listKind(flags_, ReturnKind::kAtCeiling, &at_ceiling_);
}

/// Returns about the floor's height, listed once something asks for them: most rooms need none.
const std::vector<std::uint32_t>& Room::near() const {
  if (!has_near_) listKind(flags_, ReturnKind::kNear, &near_);
  has_near_ = true;
  return near_;
}

/// Tangent of the elevation up to which all but one return in a thousand lie, in steps.
double Room::steepest() {
  constexpr std::size_t kSlots = 2 * kSlopeSlots;
  constexpr double kLowest = -kSlopeSlots, kHighest = kSlopeSlots - 1;
  slope_counts_.assign(kSlots, 0);
  const Sample sample(size(), kLookedAt);
  std::size_t total = 0;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const std::size_t i = sample[k];
    const double range = planar(i);
    if (!(range > kNearestWall)) continue;
    const double slope = static_cast<double>(points().z[i]) / range * kSlotsPerSlope;
    const int slot = floorToInt(std::min(std::max(slope, kLowest), kHighest)) + kSlopeSlots;
    ++slope_counts_[static_cast<std::size_t>(slot)];
    ++total;
  }
  if (total == 0) return 0.0;
  std::size_t above = 0;
  std::size_t slot = kSlots;
  while (above <= total / kSteeper) above += slope_counts_[--slot];
  return (static_cast<int>(slot) + 1 - kSlopeSlots) / kSlotsPerSlope;
}

std::size_t Room::postReturns() const {
  std::size_t returns = 0;
  for (const std::uint32_t count : posts_.count) returns += count;
  return returns;
}

void Room::placePosts() {
  post_places_.clear(bins_.count());
  for (std::size_t k = 0; k < posts_.size(); ++k) {
    post_places_.add(posts_.column[k], posts_.distance[k]);
  }
  post_places_.sort();
}

bool Room::standsOnWalls() const {
  std::size_t at_posts = 0, under = 0;
  const Sample sample(low_.size());
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const std::uint32_t i = low_[sample[k]];
    if (!post_places_.isNear(column(i), planar(i), kPostFoot)) continue;
    ++at_posts;
    under += height(i) < -kUnderPlane ? 1U : 0U;
  }
  return static_cast<double>(at_posts) > kFeetShare * static_cast<double>(sample.size()) &&
         static_cast<double>(under) > kUnderShare * static_cast<double>(at_posts);
}

bool Room::isAtPost(std::size_t i) const {
  const std::size_t columns = bins_.count();
  for (std::size_t k = 0; k <= 2 * kPostsBeside; ++k) {
    const std::size_t c = (column(i) + columns + k - kPostsBeside) % columns;
    if (post_places_.isNear(c, planar(i), kPostFoot)) return true;
  }
  return false;
}

void Room::findWalls(const ColumnDirections& directions) {
  findRelief();
  view_.steepest = steepest();
  line_finder_.find(posts_, widening_, &lines_);
  support_.find(wall_returns_, lines_, directions, view_, widening_);
  findSeen(directions);
  const auto level_floor = [this]() -> const std::vector<double>& { return levelFloor(); };
  profile_finder_.find(posts_, support_, view_, beyond_, level_floor, directions,
                       params_.max_bridge_ratio, spread_, &profile_);
  findOnWalls();
  if (findRamp()) findSeen(directions);
  findDrops(directions);
  findCertainFloor();
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
  const double cube = kThinned * static_cast<double>(low_.size());
  is_thinned_.resize(size());
  markThinned(returns_.planar.data(), flags_.data(), size(), cube, is_thinned_.data());
  listWhere(is_thinned_, 1, 1, &thinned_);
  relief_.find(returns_, thinned_, params_);
  if (!relief_.isFlat()) addCarried();
}

/// Takes what the relief carries for low.
void Room::addCarried() {
  const Points& at = points();
  for (const std::uint32_t i : near()) {
    if (isSoft(i) || !(returns_.planar[i] < params_.max_range)) continue;
    if (relief_.carries(at.x[i], at.y[i], returns_.height[i])) flags_[i] |= ReturnKind::kLow;
  }
  listKind(flags_, ReturnKind::kLow, &low_);
}

/// Looks for a ramp along the walls where smoke may hide one; true if one is found. A ramp, found
/// or measured, is fitted to all that lies on it.
bool Room::findRamp() {
  const bool was_flat = relief_.isFlat();
  const auto& distance = profile_.distance;
  if (was_flat && std::find(distance.begin(), distance.end(), 0.0) == distance.end()) return false;
  if (!was_flat && !relief_.hasOneSlope()) return false;
  takeFeetOfWalls();
  if (was_flat) {
    const std::optional<WallRamp> ramp = ramp_finder_.find(lines_, params_.max_slope);
    if (!ramp || !relief_.addRamp(*ramp)) return false;
    addCarried();
  }
  fitRamp();
  return was_flat;
}

void Room::takeFeetOfWalls() {
  ramp_finder_.clear(lines_.size());
  for (const std::uint32_t i : near()) {
    const double over = returns_.height[i];
    if (!(over > ReliefGrid::kLowest) || !(over < ReliefGrid::kHighest) || isSoft(i)) continue;
    if (!(std::fabs(pastWall(i)) < kWallFoot * widening_)) continue;
    const auto line = static_cast<std::size_t>(profile_.line[column(i)]);
    const double along = lines_.nx[line] * points().y[i] - lines_.ny[line] * points().x[i];
    ramp_finder_.add(line, along, over);
  }
}

void Room::fitRamp() {
  on_floor_.clear();
  for (const std::uint32_t i : low_) {
    if (isAtWall(i) || isSoft(i) || std::fabs(pastWall(i)) < kWallFoot * widening_) continue;
    on_floor_.push_back({points().x[i], points().y[i], height(i)});
  }
  ramp_finder_.listFeet(lines_, &wall_places_);
  findWallNormals();
  relief_.fitRamp(on_floor_, wall_places_, wall_normals_);
}

/// How far floor and ceiling are measured; marks the feet of walls.
void Room::findSeen(const ColumnDirections& directions) {
  windows_.find(lines_, directions, kWallFoot * widening_, kWallFoot * widening_);
  windows_.findNearest(support_, &nearest_foot_);
  farthest_.clear(bins_.count());
  farthest_.addAll(low_, returns_, [this](std::uint32_t i) {
    const bool is_foot = planar(i) >= nearest_foot_[column(i)] && isFoot(i);
    if (is_foot) flags_[i] |= ReturnKind::kAtWall;
    return !is_foot;
  });
  addRisers();
  farthest_.find(0, &own_floor_);
  farthest_.find(2, &seen_floor_);
  findSeenCeiling();
}

/// Is a low return the foot of a wall that is seen near by?
bool Room::isFoot(std::size_t i) const {
  const std::size_t c = column(i);
  for (std::size_t line = 0; line < lines_.size(); ++line) {
    if (!support_.isSeenNear(line, c)) continue;
    const RangeWindow window = windows_.of(line, c);
    if (planar(i) < window.lowest || planar(i) > window.highest) continue;
    if (lines_.distance(line, points().x[i], points().y[i]) < kWallFoot * widening_) return true;
  }
  return false;
}

/// A riser has floor at its foot.
void Room::addRisers() {
  const Points& at = points();
  if (!relief_.hasStep()) return;
  for (const std::uint32_t i : near()) {
    const bool is_counted =
        (flags_[i] & (ReturnKind::kLow | ReturnKind::kAtWall)) == ReturnKind::kLow;
    if (is_counted || isSoft(i) || !relief_.isRiser(at.x[i], at.y[i], height(i))) continue;
    farthest_.add(column(i), planar(i));
  }
}

bool Room::goesOnLevel(std::size_t i) const {
  if (!has_level_cells_) fillLevelCells();
  const double x = points().x[i], y = points().y[i];
  if (level_cells_.isLevel(x, y)) return true;
  // One ring on a far wall is as level.
  return level_cells_.isLevelAround(x, y) && !isAtPost(i);
}

bool Room::isFloorCell(std::size_t i) const {
  if (!has_level_cells_) fillLevelCells();
  const double x = points().x[i], y = points().y[i];
  return level_cells_.isFloor(x, y) || (level_cells_.isFloorAround(x, y) && !isAtPost(i));
}

void Room::fillLevelCells() const {
  const Points& at = points();
  level_cells_.clear(kLevelShare * tolerance_, tolerance_);
  const double band = kLevelBand * tolerance_;
  for (const std::uint32_t i : near()) {
    const double height = returns_.height[i];
    if (!(std::fabs(height) < band) || !(returns_.planar[i] < params_.max_range)) continue;
    level_cells_.add(at.x[i], at.y[i], height);
  }
  has_level_cells_ = true;
}

/// How far floor as level as the plane is measured in each column [m].
const std::vector<double>& Room::levelFloor() {
  if (has_level_floor_) return level_floor_;
  farthest_.clear(bins_.count());
  for (const std::uint32_t i : low_) {
    if ((flags_[i] & ReturnKind::kAtWall) == 0 && goesOnLevel(i))
      farthest_.add(column(i), planar(i));
  }
  farthest_.find(2, &level_floor_);
  has_level_floor_ = true;
  return level_floor_;
}

void Room::findSeenCeiling() {
  farthest_.clear(bins_.count());
  farthest_.addAll(at_ceiling_, returns_, [](std::uint32_t) { return true; });
  farthest_.find(2, &seen_ceiling_);
  beyond_.resize(seen_floor_.size());
  for (std::size_t c = 0; c < beyond_.size(); ++c) {
    beyond_[c] = std::max(seen_floor_[c], seen_ceiling_[c]);
  }
}

void Room::findDrops(const ColumnDirections& directions) {
  drop_returns_.clear();
  if (seesBelow()) {
    for (const std::uint32_t i : low_) addDropReturn(i, (flags_[i] & ReturnKind::kAtWall) == 0);
    for (const std::uint32_t i : deep_) {
      if ((flags_[i] & ReturnKind::kLow) == 0) addDropReturn(i, false);
    }
    findWallNormals();
    findWallFeet();
  }
  drop_finder_.find(drop_returns_, -plane_[2], directions.middle, wall_normals_, wall_feet_,
                    drops_by_, &drops_);
}

/// Does any return within the boundary come from below the floor? Without one there is no drop.
bool Room::seesBelow() const {
  return std::any_of(deep_.begin(), deep_.end(), [this](std::uint32_t i) {
    return isWithinBoundary(i) && drops_by_.isBelow(planar(i), height(i), -plane_[2]);
  });
}

bool Room::isWithinBoundary(std::size_t i) const {
  const double distance = profile_.distance[column(i)];
  return distance == 0.0 || planar(i) < distance + 2 * kBeyond;
}

/// Adds what lies within the boundary.
void Room::addDropReturn(std::size_t i, bool is_floor) {
  if (!isWithinBoundary(i)) return;
  const double distance = profile_.distance[column(i)];
  const bool is_open = distance == 0.0;
  drop_returns_.column.push_back(returns_.column[i]);
  drop_returns_.planar.push_back(planar(i));
  drop_returns_.height.push_back(height(i));
  const bool is_inside = is_open || planar(i) < distance - kWallFoot * widening_;
  drop_returns_.is_floor.push_back(is_floor && is_inside ? 1 : 0);
}

void Room::findWallFeet() {
  wall_feet_.distance = profile_.distance;
  wall_feet_.column.clear();
  wall_feet_.height.clear();
  for (const std::uint32_t i : near()) {
    const double distance = profile_.distance[column(i)];
    if (!isLowOnWall(i) || !(returns_.height[i] < WallFeet::kSteepest * distance)) continue;
    wall_feet_.column.push_back(returns_.column[i]);
    wall_feet_.height.push_back(returns_.height[i]);
  }
}

/// Is it a return of the boundary's walls from low down?
bool Room::isLowOnWall(std::size_t i) const {
  return isLowDown(i) &&
         std::fabs(returns_.planar[i] - profile_.distance[column(i)]) < WallFeet::kOffWall;
}

bool Room::isLowDown(std::size_t i) const {
  const double height = returns_.height[i];
  return height > WallFeet::kLowest && height < WallFeet::kHighest && !isSoft(i);
}

double Room::flatness() const {
  const auto is_certain = [](double reach) { return reach == kInfinity; };
  return std::all_of(certain_floor_.begin(), certain_floor_.end(), is_certain)
             ? FloorRelief::kFlatness
             : kHiddenSlope;
}

void Room::findCertainFloor() {
  if (!CertainFloor::isInDoubt(profile_.distance, drops_)) {
    certain_floor_.assign(own_floor_.size(), kInfinity);
    standing_low_.assign(own_floor_.size(), 0.0);
    return;
  }
  findRising();
  findStanding();
  certain_finder_.find(own_floor_, profile_.distance, drops_, low_wall_, standing_, rising_,
                       &certain_floor_);
}

/// What is seen low down: returns of walls, and how far something stands in the room.
void Room::findStanding() {
  low_wall_.assign(bins_.count(), 0);
  farthest_.clear(bins_.count());
  farthest_low_.clear(bins_.count());
  for (const std::uint32_t i : near()) {
    if (!isLowDown(i)) continue;
    const std::size_t c = column(i);
    const double beyond = planar(i) - profile_.distance[c];
    low_wall_[c] += std::fabs(beyond) < WallFeet::kOffWall ? 1U : 0U;
    if (profile_.distance[c] != 0.0 && !(beyond < WallFeet::kOffWall)) continue;
    farthest_.add(c, planar(i));
    if (returns_.height[i] < WallFeet::kUpTo) farthest_low_.add(c, planar(i));
  }
  farthest_.find(2, &standing_);
  farthest_low_.find(0, &standing_low_);
}

/// How far floor is measured that lies clear over the plane.
void Room::findRising() {
  rising_.assign(own_floor_.size(), 0.0);
  if (relief_.isFlat()) return;
  farthest_.clear(rising_.size());
  for (const std::uint32_t i : low_) {
    if (relief_.at(points().x[i], points().y[i]) > kRises) farthest_.add(column(i), planar(i));
  }
  farthest_.find(0, &rising_);
}

/// Of the walls that bound the room.
void Room::findWallNormals() {
  wall_normals_.clear();
  for (std::size_t line = 0; line < lines_.size(); ++line) {
    const auto number = static_cast<std::int32_t>(line);
    const bool bounds =
        std::find(profile_.line.begin(), profile_.line.end(), number) != profile_.line.end();
    if (bounds) wall_normals_.push_back({lines_.nx[line], lines_.ny[line]});
  }
}

double Room::pastWall(std::size_t i) const {
  const std::int32_t line = profile_.line[column(i)];
  if (line < 0) return -kInfinity;
  const auto l = static_cast<std::size_t>(line);
  return (lines_.nx[l] * points().x[i] + lines_.ny[l] * points().y[i]) - lines_.rho[l];
}

float Room::nearestWall(std::size_t column) const {
  const std::int32_t line = profile_.line[column];
  if (line < 0) return std::numeric_limits<float>::infinity();
  return windows_.of(static_cast<std::size_t>(line), column).lowest;
}

void Room::findOnWalls() {
  on_walls_.resize(wall_returns_.size() + 1);
  std::uint32_t* on_wall = on_walls_.data();
  for (std::size_t c = 0; c < profile_.columns(); ++c) {
    if (profile_.line[c] < 0) continue;
    const auto line = static_cast<std::size_t>(profile_.line[c]);
    const RangeWindow window = windows_.of(line, c);
    on_wall = listNear(wall_returns_, lines_[line], c, window, windows_.surelyIn(window, line),
                       kWallFoot * widening_, on_wall);
  }
  on_walls_.resize(static_cast<std::size_t>(on_wall - on_walls_.data()));
}

Visibility Room::visibility(const std::vector<float>& intensity, VisibilityEstimator* estimator) {
  const std::size_t stride = std::max<std::size_t>(1, on_walls_.size() / kWallLights);
  wall_light_.resize((on_walls_.size() + stride - 1) / stride);
  for (std::size_t n = 0; n < wall_light_.size(); ++n) {
    const std::uint32_t i = on_walls_[n * stride];
    const std::int32_t line = profile_.line[column(i)];
    const auto l = static_cast<std::size_t>(line);
    const double x = points().x[i];
    const double y = points().y[i];
    const double z = points().z[i];
    const double range = std::sqrt((x * x + y * y) + z * z);
    wall_light_.wall[n] = line;
    wall_light_.range[n] = range;
    wall_light_.intensity[n] = intensity[i];
    wall_light_.cosine[n] = std::fabs(lines_.nx[l] * x + lines_.ny[l] * y) / range;
  }
  return estimator->estimate(wall_light_);
}

double floorTolerance(const FloorModel& floor) {
  return std::min(std::max(kOnFloor, kUnevenness * floor.uneven), kOnFloorMost);
}

double floorLift(const FloorModel& floor) { return kUnevenness * floor.noise * -floor.plane[2]; }

std::optional<std::array<double, 9>> levellingRotation(const std::array<double, 3>& plane) {
  const double a = plane[0];
  const double b = plane[1];
  const double length = std::sqrt((a * a + b * b) + 1.0);
  const double x = -a / length;
  const double y = -b / length;
  const double z = 1.0 / length;
  if (z > kPlumb) return std::nullopt;
  const double rest = 1.0 / (1.0 + z);
  const double across = -(x * y) * rest;
  return Matrix3{1.0 - x * x * rest, across, -x, across, 1.0 - y * y * rest, -y, x, y, z};
}

std::array<double, 3> rotatedPlane(const std::array<double, 3>& plane,
                                   const std::array<double, 9>& rotation) {
  const Vector3 normal = times(rotation, Vector3{-plane[0], -plane[1], 1.0});
  return {-normal[0] / normal[2], -normal[1] / normal[2], plane[2] / normal[2]};
}

}  // namespace smoke_ground_reconstruction
