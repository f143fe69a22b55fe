#include "smoke_ground_reconstruction/room_boundary.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "ordered.hpp"
#include "point_loops.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kColumnDeg = 0.4;
constexpr std::uint32_t kWedgeColumns = 15;  // of a wedge that tells which frame is upright
constexpr std::uint32_t kWedges = 12;        // one in so many does
constexpr std::size_t kWedgeReturns = 500;   // in posts, at least, tell

void markWedges(const std::uint32_t* column, std::size_t size, std::uint8_t* is_in_wedge) {
  for (std::size_t i = 0; i < size; ++i) {
    is_in_wedge[i] = column[i] / kWedgeColumns % kWedges == 0 ? 1 : 0;
  }
}

}  // namespace

void RoomBoundaryParams::validate() const {
  require(max_floor_tilt_deg >= 1 && max_floor_tilt_deg <= 15, "max_floor_tilt_deg", "from 1 to 15",
          max_floor_tilt_deg);
  require(max_height_deviation >= 0.02 && max_height_deviation <= 0.5, "max_height_deviation",
          "from 0.02 to 0.5", max_height_deviation);
  require(floor_tolerance >= 0.0 && floor_tolerance <= 0.2, "floor_tolerance", "from 0 to 0.2",
          floor_tolerance);
  require(max_slope >= 0.02 && max_slope <= 0.5, "max_slope", "from 0.02 to 0.5", max_slope);
  require(max_step_height >= 0.05 && max_step_height <= 0.5, "max_step_height", "from 0.05 to 0.5",
          max_step_height);
  require(drop_depth >= 0.0 && drop_depth <= 0.5, "drop_depth", "from 0 to 0.5", drop_depth);
  require(smoke_gate >= 0.0 && smoke_gate <= 20.0, "smoke_gate", "from 0 to 20", smoke_gate);
  require(min_wall_height >= 0.05 && min_wall_height <= 2.0, "min_wall_height", "from 0.05 to 2",
          min_wall_height);
  require(furniture_height >= 0.0 && furniture_height <= 12.0, "furniture_height", "from 0 to 12",
          furniture_height);
  require(max_bridge_ratio >= 0.0 && max_bridge_ratio <= 10.0, "max_bridge_ratio", "from 0 to 10",
          max_bridge_ratio);
  require(max_range >= 1.0 && max_range <= 50.0, "max_range", "from 1 to 50", max_range);
  require(cell_size >= 0.1 && cell_size <= 0.5, "cell_size", "from 0.1 to 0.5", cell_size);
}

RoomBoundary::RoomBoundary(const RoomBoundaryParams& params)
    : params_(validated(params)),
      bins_(kColumnDeg),
      directions_(bins_.count()),
      rooms_{Room(bins_), Room(bins_)},
      completion_(bins_, directions_) {}

void RoomBoundary::setParams(const RoomBoundaryParams& params) { params_ = validated(params); }

void RoomBoundary::reconstruct(const ScanView& scan, const SensorModel& sensor,
                               const Mounting& mounting, RoomBoundaryResult* result) {
  takeIn(scan, mounting);
  Room& room = findFloor(mounting, &result->floor);
  room.findWalls(directions_);
  const FloorClaim& claim = completion_.claim(room);
  const SensedReturns sensed{mounting.isLevel() ? level_ : sensed_, intensity_, ring_};
  completion_.complete(sensed, &room, sensor, mounting, result->floor, &result->surface);
  result->labels.resize(scan.size);
  label(room, claim, &result->labels);
  result->profile = room.profile();
  result->drops = room.drops();
  result->limit = claim.limit;
  result->visibility = room.visibility(intensity_, &visibility_);
}

void RoomBoundary::takeIn(const ScanView& scan, const Mounting& mounting) {
  Points& taken = mounting.isLevel() ? level_ : sensed_;
  for (auto* values : {&taken.x, &taken.y, &taken.z, &intensity_}) values->resize(scan.size);
  valid_.resize(scan.size);
  ring_.resize(scan.size);
  const std::size_t count = takeReturns(scan, {taken.x.data(), taken.y.data(), taken.z.data(),
                                               intensity_.data(), ring_.data(), valid_.data()});
  for (auto* values : {&taken.x, &taken.y, &taken.z, &intensity_}) values->resize(count);
  valid_.resize(count);
  if (mounting.isLevel()) return;
  for (auto* values : {&level_.x, &level_.y, &level_.z}) values->resize(count);
  turnPoints({sensed_.x.data(), sensed_.y.data(), sensed_.z.data(), count}, mounting.rotation,
             level_.x.data(), level_.y.data(), level_.z.data());
}

/// A floor that gives no return (wet, black) leaves the feet of walls as the lowest there is. They
/// are left out then; if no floor is found beside them, what was known before has to do.
Room& RoomBoundary::findFloor(const Mounting& mounting, FloorModel* floor) {
  const FloorModel* const before = floor_ ? &*floor_ : nullptr;
  *floor = floor_fitter_.fit(level_, mounting.sensor_height, before, params_);
  Room* room = &look(*floor);
  for (int attempt = 0; floor->source == FloorSource::kMeasured && room->standsOnWalls();
       ++attempt) {
    off_posts_.clear();
    for (std::size_t i = 0; attempt == 0 && i < level_.size(); ++i) {
      if (!room->isAtPost(i)) off_posts_.push(level_.x[i], level_.y[i], level_.z[i]);
    }
    *floor = floor_fitter_.fit(off_posts_, mounting.sensor_height, before, params_);
    room = &look(*floor);
  }
  if (floor->source == FloorSource::kMeasured) floor_ = *floor;
  return *room;
}

/// The room in whichever frame stands its walls upright: the level one or the floor's. Some wedges
/// of it tell, if enough of their returns stand in posts. One room sees wedges, the other whole
/// scans: memory that grows has to be cleared.
Room& RoomBoundary::look(const FloorModel& floor) {
  Room& whole = rooms_[0];
  const auto levelling = levellingRotation(floor.plane);
  if (!levelling) {
    whole.look(level_, intensity_, floor, kIdentity, params_);
    return whole;
  }
  const std::array<Matrix3, 2> frames = {kIdentity, *levelling};
  pickWedges();
  std::array<std::size_t, 2> found{};
  for (std::size_t k = 0; k < frames.size(); ++k) {
    rooms_[1].look(wedges_, wedge_intensity_, floor, frames[k], params_);
    found[k] = rooms_[1].postReturns();
  }
  if (std::max(found[0], found[1]) >= kWedgeReturns) {
    whole.look(level_, intensity_, floor, frames[found[1] > found[0] ? 1 : 0], params_);
    return whole;
  }
  for (std::size_t k = 0; k < frames.size(); ++k) {
    rooms_[k].look(level_, intensity_, floor, frames[k], params_);
  }
  return rooms_[rooms_[1].postReturns() > rooms_[0].postReturns() ? 1 : 0];
}

/// A twelfth of the returns, in five directions.
void RoomBoundary::pickWedges() {
  bin_.resize(level_.size());
  bins_.indices(level_.x.data(), level_.y.data(), level_.size(), bin_.data());
  is_in_wedge_.resize(level_.size());
  markWedges(bin_.data(), bin_.size(), is_in_wedge_.data());
  listWhere(is_in_wedge_, 1, 1, &wedge_);
  wedges_.clear();
  wedge_intensity_.clear();
  for (const std::uint32_t i : wedge_) {
    wedges_.push(level_.x[i], level_.y[i], level_.z[i]);
    wedge_intensity_.push_back(intensity_[i]);
  }
}

void RoomBoundary::label(const Room& room, const FloorClaim& claim,
                         std::vector<Label>* labels) const {
  const std::size_t size = valid_.size();
  Label* const label = labels->data();
  // Places of returns among the points of the scan: their own where all points are returns.
  const auto tell = [&room, &claim, size, label](const auto& place) {
    constexpr int kKept = static_cast<int>(Label::kKept), kNoise = static_cast<int>(Label::kNoise);
    for (std::size_t k = 0; k < size; ++k) {
      label[place(k)] = static_cast<Label>(kKept + (kNoise - kKept) * (room.isSoft(k) ? 1 : 0));
    }
    for (const std::uint32_t k : room.onWalls()) label[place(k)] = Label::kWall;
    for (const std::uint32_t k : claim.measured) label[place(k)] = Label::kGround;
  };
  if (size == labels->size()) {
    tell([](std::size_t k) { return k; });
  } else {
    labels->assign(labels->size(), Label::kInvalid);
    tell([point = valid_.data()](std::size_t k) { return point[k]; });
  }
}

}  // namespace smoke_ground_reconstruction
