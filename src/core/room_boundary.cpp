#include "smoke_ground_reconstruction/room_boundary.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kColumnDeg = 0.4;

}  // namespace

RoomBoundary::RoomBoundary()
    : bins_(kColumnDeg),
      directions_(bins_.count()),
      rooms_{Room(bins_), Room(bins_)},
      completion_(bins_, directions_) {}

void RoomBoundary::reconstruct(const ScanView& scan, const SensorModel& sensor,
                               const Mounting& mounting, RoomBoundaryResult* result) {
  takeIn(scan, mounting);
  result->floor = floor_fitter_.fit(level_, mounting.sensor_height, floor_ ? &*floor_ : nullptr);
  if (result->floor.source == FloorSource::kMeasured) floor_ = result->floor;
  Room& room = look(result->floor);
  const FloorClaim& claim = completion_.claim(room);
  completion_.draw(&room, sensor, mounting);
  completion_.merge(scan, valid_, &room, sensor, mounting, result->floor, &result->surface);
  result->labels.assign(scan.size, Label::kInvalid);
  label(room, claim, &result->labels);
  result->profile = room.profile();
  result->drops = room.drops();
  result->limit = claim.limit;
  result->visibility = room.visibility(intensity_, &visibility_);
}

void RoomBoundary::takeIn(const ScanView& scan, const Mounting& mounting) {
  valid_.clear();
  level_.clear();
  intensity_.clear();
  const bool is_level = mounting.isLevel();
  for (std::uint32_t i = 0; i < scan.size; ++i) {
    const float x = scan.x[i];
    const float y = scan.y[i];
    const float z = scan.z[i];
    if (!isReturn(x, y, z)) continue;
    valid_.push_back(i);
    intensity_.push_back(scan.intensity[i]);
    const auto level = is_level ? std::array<float, 3>{x, y, z} : mounting.toLevel(x, y, z);
    level_.push(level[0], level[1], level[2]);
  }
}

/// The room in whichever frame stands its walls upright: the level one or the floor's.
Room& RoomBoundary::look(const FloorModel& floor) {
  const auto rotations = uprightCandidates(floor.plane);
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    rooms_[k].look(level_, intensity_, floor, rotations[k]);
  }
  const bool is_second = rotations.size() > 1 && rooms_[1].postReturns() > rooms_[0].postReturns();
  Room& room = rooms_[is_second ? 1 : 0];
  room.findWalls(directions_);
  return room;
}

void RoomBoundary::label(const Room& room, const FloorClaim& claim,
                         std::vector<Label>* labels) const {
  for (std::size_t k = 0; k < valid_.size(); ++k) {
    Label& label = (*labels)[valid_[k]];
    label = room.isSoft(k) ? Label::kNoise : Label::kKept;
    if (room.isWall(k)) label = Label::kWall;
    if (claim.measured[k] != 0) label = Label::kGround;
  }
}

}  // namespace smoke_ground_reconstruction
