#include "smoke_ground_reconstruction/floor_completion.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "cell_guess.hpp"
#include "lanes.hpp"
#include "lanes_of_bits.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"
#include "point_loops.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kAtWall = 0.008;    // the claimed floor ends this far before the wall [m]
constexpr double kFill = 0.6;        // claimed floor between rings is drawn so densely, in cells
constexpr double kColumn = 0.00698;  // width of a column at 1 m [m]
constexpr double kFlattest = -1e-3;  // beams that fall by less against the floor never meet it

std::array<float, 3> toLevel(const Matrix3& level_from_upright, float x, float y, float z) {
  const Vector3 level = times(level_from_upright, Vector3{x, y, z});
  return {static_cast<float>(level[0]), static_cast<float>(level[1]), static_cast<float>(level[2])};
}

PointArrays arraysOf(const Points& points, std::size_t size) {
  return {points.x.data(), points.y.data(), points.z.data(), size};
}

/// How many of eight numbers follow each other, from the first on.
SMOKE_GROUND_PART std::size_t runOf(const std::uint32_t* numbers) {
  constexpr Ints kSteps = {0, 1, 2, 3, 4, 5, 6, 7};
  Ints eight;
  std::memcpy(&eight, numbers, sizeof(eight));
  const Bytes follow = bytesOf(eight - kSteps == eight[0]);
  std::uint64_t bits = 0;
  std::memcpy(&bits, &follow, sizeof(bits));
  return bits == ~std::uint64_t{0} ? kLanes : static_cast<std::size_t>(__builtin_ctzll(~bits)) / 8;
}

/// Some numbers of returns, of each of which so many are known.
template <typename Number>
struct Copy {
  const Number* from;
  Number* to;

  void one(std::size_t i, std::size_t n) const { to[n] = from[i]; }
  void eight(std::size_t i, std::size_t n) const {
    std::memcpy(to + n, from + i, kLanes * sizeof(Number));
  }
};

/// Takes the returns [begin, end) of those that are measured, which mostly follow each other.
SMOKE_GROUND_MULTIVERSION
void takeMeasured(const SensedReturns& sensed, const std::uint32_t* measured, std::size_t begin,
                  std::size_t end, FloorSurface* surface) {
  const Copy<float> x{sensed.points.x.data(), surface->x.data()};
  const Copy<float> y{sensed.points.y.data(), surface->y.data()};
  const Copy<float> z{sensed.points.z.data(), surface->z.data()};
  const Copy<float> intensity{sensed.intensity.data(), surface->intensity.data()};
  const Copy<std::uint16_t> ring{sensed.ring.data(), surface->ring.data()};
  const std::size_t returns = sensed.points.size();
  std::size_t n = begin;
  while (n + kLanes <= end && measured[n] + kLanes <= returns) {
    const std::uint32_t i = measured[n];
    x.eight(i, n), y.eight(i, n), z.eight(i, n), intensity.eight(i, n), ring.eight(i, n);
    n += runOf(measured + n);
  }
  for (; n < end; ++n) {
    const std::uint32_t i = measured[n];
    x.one(i, n), y.one(i, n), z.one(i, n), intensity.one(i, n), ring.one(i, n);
  }
}

/// Points worked on together.
struct Block {
  static constexpr std::size_t kMost = 256;

  std::array<float, kMost> x, y, z;

  PointArrays take(const Points& points, const std::uint32_t* which, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t i = which[k];
      x[k] = points.x[i];
      y[k] = points.y[i];
      z[k] = points.z[i];
    }
    return {x.data(), y.data(), z.data(), count};
  }
};

/// Of measured points' heights: a range's noise lifts a return by the sine of its grazing angle.
SMOKE_GROUND_MULTIVERSION
void tellMeasuredSigma(const FloorModel& floor, const PointArrays& points, float* sigma) {
  const auto common = static_cast<float>(floor.commonVariance());
  const auto variance = static_cast<float>(floor.noise * floor.noise);
  const PointArrays at = points;
  for (std::size_t n = 0; n < at.size; ++n) {
    const float height = at.z[n] * at.z[n];
    const float range = (at.x[n] * at.x[n] + at.y[n] * at.y[n]) + height;
    sigma[n] = std::sqrt(variance * (height / range) + common);
  }
}

/// Adds to sigmas that of the floor's plane.
SMOKE_GROUND_MULTIVERSION
void addVariance(const FloorModel& floor, const PointArrays& points, float* sigma) {
  const FloorModel of = floor;
  const float *const x = points.x, *const y = points.y;
  for (std::size_t i = 0, size = points.size; i < size; ++i) {
    const double relief = sigma[i];
    const double variance = of.variance(x[i], y[i]);
    sigma[i] = static_cast<float>(std::sqrt(variance + relief * relief));
  }
}

/// Of the points' elevations.
SMOKE_GROUND_MULTIVERSION
void tangentsOf(const PointArrays& points, double* tangent) {
  const float *const px = points.x, *const py = points.y, *const pz = points.z;
  for (std::size_t i = 0, size = points.size; i < size; ++i) {
    const double x = px[i];
    const double y = py[i];
    const double planar = std::sqrt(x * x + y * y);
    tangent[i] = static_cast<double>(pz[i]) / (planar > 1e-6 ? planar : 1e-6);
  }
}

/// Places that are looked at together.
struct EightPlaces {
  std::array<double, kLanes> planar;
  std::array<float, kLanes> x, y, z;
};

/// Which of eight cells are among some, one bit each.
SMOKE_GROUND_PART std::uint32_t containedIn(const CellSet& cells, const Ints& eight) {
  std::uint32_t bits = 0;
  for (std::uint32_t k = kLanes; k-- > 0;) {
    bits = 2 * bits + cells.bit(static_cast<std::uint32_t>(eight[k]));
  }
  return bits;
}

/// Which of eight numbers lie between two others, one bit each.
SMOKE_GROUND_PART std::uint32_t between(const std::array<double, kLanes>& eight, double low,
                                        double high) {
  std::uint32_t bits = 0;
  for (std::uint32_t k = 0; k < kLanes; ++k) {
    bits |= ((eight[k] > low) & (eight[k] < high) ? 1U : 0U) << k;
  }
  return bits;
}

/// Adds those of eight places of a column whose bits are set. There must be room for eight.
SMOKE_GROUND_PART void addPlaces(const EightPlaces& places, std::uint32_t which,
                                 std::uint16_t column, std::uint16_t ring, DrawnFloor* drawn) {
  const Ints lanes = lanesOfBits(which);
  std::array<float, kLanes> planar;
  for (std::uint32_t k = 0; k < kLanes; ++k) planar[k] = static_cast<float>(places.planar[k]);
  const auto put = [lanes, at = drawn->size](const std::array<float, kLanes>& from,
                                             std::vector<float>* to) {
    const Floats values = picked(loadLanes(from.data()), lanes);
    std::memcpy(to->data() + at, &values, sizeof(values));
  };
  put(places.x, &drawn->points.x);
  put(places.y, &drawn->points.y);
  put(places.z, &drawn->points.z);
  put(planar, &drawn->planar);
  std::fill_n(drawn->column.begin() + static_cast<std::ptrdiff_t>(drawn->size), kLanes, column);
  std::fill_n(drawn->ring.begin() + static_cast<std::ptrdiff_t>(drawn->size), kLanes, ring);
  drawn->size += countOfBits(which);
}

/// Planar ranges from which on columns are filled [m]: every 16th from the first step on, those
/// between them from where their neighbours are farther apart than a step.
class FillBegins {
 public:
  explicit FillBegins(double spacing) {
    for (std::size_t bit = 0; bit < kBits; ++bit) {
      begins_[bit] = spacing / (static_cast<double>(2U << bit) * kColumn);
    }
    begins_[kBits] = spacing;
  }
  double of(std::size_t column) const {
    return begins_[static_cast<std::size_t>(__builtin_ctzll(column | 1U << kBits))];
  }

 private:
  static constexpr std::size_t kBits = 4;
  std::array<double, kBits + 1> begins_;  // by the lowest bit of a column's number
};

}  // namespace

void DrawnFloor::reserveMore(std::size_t more) {
  const std::size_t wanted = size + more;
  if (wanted <= column.size()) return;
  const std::size_t room = std::max(wanted, 2 * column.size());
  for (auto* values : {&points.x, &points.y, &points.z}) values->resize(room);
  column.resize(room);
  planar.resize(room);
  ring.resize(room);
}

void FloorCompletion::Stretch::reserve(std::size_t size) {
  if (size <= x.size()) return;
  for (auto* values : {&x, &y, &z}) values->resize(size);
  for (auto* values : {&column, &cell, &chosen, &is_claimed}) values->resize(size);
  for (auto* values : {&planar, &limit, &begin, &end}) values->resize(size);
}

FloorCompletion::FloorCompletion(const AzimuthBins& bins, const ColumnDirections& directions)
    : bins_(bins), directions_(directions) {}

const FloorClaim& FloorCompletion::claim(const Room& room) {
  const std::size_t columns = directions_.count();
  auto& limit = claim_.limit;
  limit.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    const double distance = room.profile().distance[c];
    // What stands stands on a floor.
    const double open_end =
        std::max({room.seenFloor()[c], room.drops().floor_to[c], room.standingLow()[c]});
    limit[c] = distance > 0.0 ? std::max(0.0, distance - kAtWall) : open_end;
    limit[c] = std::min(limit[c], room.certainFloor()[c]);
  }
  findMeasured(room);
  drawOn(room);
  return claim_;
}

/// Which low returns are floor, and which of them lie past the limits.
void FloorCompletion::findMeasured(const Room& room) {
  findSurelyFloor(room);
  past_.clear();
  auto& measured = claim_.measured;
  measured.resize(room.low().size());
  column_.resize(measured.size());
  planar_.resize(measured.size());
  std::size_t count = 0;
  for (const std::uint32_t i : room.low()) {
    const std::size_t c = room.column(i);
    const float planar = room.planar(i);
    measured[count] = i;
    column_[count] = static_cast<std::uint16_t>(c);
    planar_[count] = planar;
    if (planar < surely_floor_[c]) {
      ++count;
    } else if (isMeasured(room, i)) {
      ++count;
      if (planar > claim_.limit[c] + Room::kBeyond) past_.push_back(i);
    }
  }
  measured.resize(count);
}

/// What low returns nearer than this need not be asked one by one.
void FloorCompletion::findSurelyFloor(const Room& room) {
  constexpr double kRounding = 1.0 - 1e-6;  // to single precision
  surely_floor_.resize(claim_.limit.size());
  for (std::size_t c = 0; c < surely_floor_.size(); ++c) {
    const double wall = room.nearestWall(c);
    const double nearest = std::min({claim_.limit[c], room.drops().begin[c], wall});
    surely_floor_[c] = static_cast<float>(kRounding * nearest);
  }
}

bool FloorCompletion::isMeasured(const Room& room, std::uint32_t low) const {
  const std::size_t c = room.column(low);
  const double planar = room.planar(low);
  if (room.drops().hides(c, planar)) return false;
  if (planar <= claim_.limit[c]) return room.pastWall(low) <= -kAtWall;
  // Where nothing is known to bound the floor a cell of it will do, and behind single posts, mostly
  // of furniture; behind an opening a level one.
  if (room.profile().distance[c] == 0.0) return room.isFloorCell(low);
  // The foot of a house over the way is no floor of this one.
  if (!(planar > claim_.limit[c] + Room::kBeyond) || room.isAtWall(low)) return false;
  return room.goesOnLevel(low) || (room.profile().line[c] < 0 && room.isFloorCell(low));
}

/// Past a limit the floor goes on up to what is measured.
void FloorCompletion::drawOn(const Room& room) {
  farthest_.clear(claim_.limit.size());
  for (const std::uint32_t i : past_) farthest_.add(room.column(i), room.planar(i));
  farthest_.find(1, &beyond_);
  for (std::size_t c = 0; c < claim_.limit.size(); ++c) {
    claim_.limit[c] = std::min(std::max(claim_.limit[c], beyond_[c]), room.params().max_range);
  }
}

/// Claimed floor where none was measured.
void FloorCompletion::draw(Room* room, const SensorModel& sensor, const Mounting& mounting) {
  drawn_.size = 0;
  drawBeams(*room, sensor, mounting);
  drawn_.beams = drawn_.size;
  drawFill(*room);
  raise(&room->relief());
}

/// From the plane to the floor.
void FloorCompletion::raise(FloorRelief* relief) {
  if (relief->isFlat()) return;
  Points& points = drawn_.points;
  for (std::size_t k = 0; k < drawn_.size; ++k) {
    const double over = relief->at(points.x[k], points.y[k]);
    points.z[k] = static_cast<float>(points.z[k] + over);
  }
}

/// Where the beams of all rings, at all azimuths, meet the claimed floor.
void FloorCompletion::drawBeams(const Room& room, const SensorModel& sensor,
                                const Mounting& mounting) {
  layBeams(room, mounting);
  layScreen();
  const double farthest = *std::max_element(claim_.limit.begin(), claim_.limit.end());
  for (const std::uint16_t ring : sensor.ringsByElevation()) {
    const double tangent = sensor.tangent(ring);
    if (!mayMeetFloor(tangent, farthest)) continue;
    const std::size_t count = chooseBeams(tangent);
    if (count == 0) continue;
    cutBeams(tangent, count);
    if (beams_.is_level) {
      std::copy_n(screen_.chosen.begin(), count, stretch_.column.begin());
    } else {
      bins_.indices(stretch_.x.data(), stretch_.y.data(), count, stretch_.column.data());
    }
    lookUpClaim(room.drops(), count);
    if (findClaimed(count)) keep(count, ring);
  }
}

void FloorCompletion::layBeams(const Room& room, const Mounting& mounting) {
  const Matrix3 turn = times(room.rotation(), mounting.rotation);
  const std::size_t columns = directions_.count();
  stretch_.reserve(columns);
  for (auto* values : {&beams_.x, &beams_.y, &beams_.z, &beams_.slope}) values->resize(columns);
  const auto& plane = room.plane();
  for (std::size_t c = 0; c < columns; ++c) {
    const auto& [cosine, sine] = directions_.middle[c];
    beams_.x[c] = turn[0] * cosine + turn[1] * sine;
    beams_.y[c] = turn[3] * cosine + turn[4] * sine;
    beams_.z[c] = turn[6] * cosine + turn[7] * sine;
    beams_.slope[c] = beams_.z[c] - (plane[0] * beams_.x[c] + plane[1] * beams_.y[c]);
  }
  beams_.up = {turn[2], turn[5], turn[8]};
  beams_.up_slope = turn[8] - (plane[0] * turn[2] + plane[1] * turn[5]);
  beams_.plane = plane;
  beams_.lowest = *std::min_element(beams_.slope.begin(), beams_.slope.end());
  beams_.is_level = turn == kIdentity;
}

/// False where every beam of a ring surely passes over the floor, or meets it too far away.
bool FloorCompletion::mayMeetFloor(double tangent, double farthest) const {
  constexpr double kMargin = 1e-6;
  constexpr double kShortest = 0.5;  // planar length of a beam, at least
  const double aside = std::sqrt(beams_.up[0] * beams_.up[0] + beams_.up[1] * beams_.up[1]);
  const bool is_long = 0.9 - std::fabs(tangent) * aside > kShortest && beams_.up[2] > 0.9;
  const double steepest = is_long ? kShortest * beams_.plane[2] / (farthest + kMargin) : kFlattest;
  return beams_.lowest + tangent * beams_.up_slope < std::min(steepest, kFlattest) + kMargin;
}

void FloorCompletion::layScreen() {
  const auto& limit = claim_.limit;
  const double farthest = *std::max_element(limit.begin(), limit.end());
  const std::size_t columns = limit.size(), padded = (columns + kLanes - 1) / kLanes * kLanes;
  for (auto* values : {&screen_.x, &screen_.y, &screen_.slope, &screen_.reach}) {
    values->assign(padded, 0.0F);
  }
  screen_.chosen.resize(padded + kLanes);
  for (std::size_t c = 0; c < columns; ++c) {
    screen_.x[c] = static_cast<float>(beams_.x[c]);
    screen_.y[c] = static_cast<float>(beams_.y[c]);
    screen_.slope[c] = static_cast<float>(beams_.slope[c]);
    const double reach = 1.001 * (beams_.is_level ? limit[c] : farthest) + 1e-3;
    screen_.reach[c] = static_cast<float>(reach * reach);
  }
}

/// Which of a ring's beams may meet claimed floor that was not measured. Tells their number.
SMOKE_GROUND_MULTIVERSION
std::size_t FloorCompletion::chooseBeams(double tangent) {
  constexpr double kSlopeError = 1e-6;  // in single precision
  const CellGrid& grid = measured_cells_.grid();
  const CellGuess guess(grid);
  const double height = beams_.plane[2];
  const auto drop = static_cast<float>(height),
             up_slope = static_cast<float>(beams_.up_slope * tangent);
  const auto up_x = static_cast<float>(beams_.up[0] * tangent),
             up_y = static_cast<float>(beams_.up[1] * tangent);
  const auto per_square = static_cast<float>(kSlopeError / (std::fabs(height) * grid.size()));
  const float *const beam_x = screen_.x.data(), *const beam_y = screen_.y.data();
  const float *const beam_slope = screen_.slope.data(), *const reach = screen_.reach.data();
  std::uint32_t* end = screen_.chosen.data();
  for (std::size_t i = 0; i < screen_.x.size(); i += kLanes) {
    const Floats slope = loadLanes(beam_slope + i) + up_slope;
    const Floats along = drop / slope;
    const Floats x = along * (loadLanes(beam_x + i) + up_x);
    const Floats y = along * (loadLanes(beam_y + i) + up_y);
    const Floats square = x * x + y * y;
    const Ints may_be =
        (slope < static_cast<float>(kFlattest + kSlopeError)) & (square < loadLanes(reach + i));
    if (isNone(may_be)) continue;
    const Ints cell = guess.at(x, y, CellGuess::kDoubt + per_square * square);
    const Ints asked = may_be ? cell : static_cast<std::int32_t>(CellSet::kAlways) + Ints{};
    const std::uint32_t which = 0xFF & ~containedIn(measured_cells_, asked);
    end = putPlaces(which, i, end);
  }
  return static_cast<std::size_t>(end - screen_.chosen.data());
}

/// Cuts the chosen beams of a ring with the floor's plane; those that never meet it end at
/// infinity.
SMOKE_GROUND_MULTIVERSION
void FloorCompletion::cutBeams(double tangent, std::size_t count) {
  const auto [a, b, c] = beams_.plane;
  const auto [up_x, up_y, up_z] = beams_.up;
  Stretch& to = stretch_;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = screen_.chosen[k];
    const double ray_x = beams_.x[i] + up_x * tangent;
    const double ray_y = beams_.y[i] + up_y * tangent;
    const double ray_z = beams_.z[i] + up_z * tangent;
    const double slope = ray_z - (a * ray_x + b * ray_y);
    const double along = c / slope;
    const auto x = static_cast<float>(along * ray_x);
    const auto y = static_cast<float>(along * ray_y);
    const double planar = std::sqrt(static_cast<double>(x) * static_cast<double>(x) +
                                    static_cast<double>(y) * static_cast<double>(y));
    to.x[k] = x;
    to.y[k] = y;
    to.z[k] = static_cast<float>(along * ray_z);
    to.planar[k] = slope < kFlattest ? planar : kInfinity;
  }
}

/// Evenly spaced places of a column up to its limit, as far as they lie on claimed floor that was
/// not measured.
SMOKE_GROUND_MULTIVERSION
void FloorCompletion::fill(const Room& room, std::size_t column, double begin, double spacing,
                           std::uint32_t count) {
  const auto [cosine, sine] = directions_.middle[column];
  const double limit = claim_.limit[column];
  const double drop_begin = room.drops().begin[column], drop_end = room.drops().end[column];
  const auto [a, b, c] = room.plane();
  const CellGuess guess(measured_cells_.grid());
  constexpr std::array<double, kLanes> kNumbers = {0, 1, 2, 3, 4, 5, 6, 7};
  const double last = count - 1;
  const bool has_drop = drop_begin < limit;
  drawn_.reserveMore(count + kLanes);
  for (std::uint32_t first = 0; first < count; first += kLanes) {
    EightPlaces at;
    for (std::uint32_t k = 0; k < kLanes; ++k) {
      const double number = static_cast<double>(first) + kNumbers[k];
      const double step = begin + number * spacing;
      const double within = step < limit ? step : limit;
      at.planar[k] = number < last ? within : limit;
    }
    for (std::uint32_t k = 0; k < kLanes; ++k) {
      const double x = at.planar[k] * cosine;
      const double y = at.planar[k] * sine;
      at.x[k] = static_cast<float>(x);
      at.y[k] = static_cast<float>(y);
      at.z[k] = static_cast<float>((a * x + b * y) + c);
    }
    const std::uint32_t rest = count - first;
    std::uint32_t which = rest < kLanes ? (1U << rest) - 1 : (1U << kLanes) - 1;
    which &= ~containedIn(measured_cells_, guess.ofEight(at.x.data(), at.y.data()));
    if (has_drop) which &= ~between(at.planar, drop_begin, drop_end);
    addPlaces(at, which, static_cast<std::uint16_t>(column), DrawnFloor::kNoRing, &drawn_);
  }
}

/// Floor between the rings and up to the boundary. Columns are left out near the sensor, where they
/// lie closer than need be.
SMOKE_GROUND_MULTIVERSION
void FloorCompletion::drawFill(const Room& room) {
  const double spacing = kFill * room.params().cell_size;
  const FillBegins begins(spacing);
  for (std::size_t c = 0; c < directions_.count(); ++c) {
    if (!(claim_.limit[c] > 0.0)) continue;
    const double begin = begins.of(c);
    const double steps = std::max(0.0, std::ceil((claim_.limit[c] - begin) / spacing));
    fill(room, c, begin, spacing, static_cast<std::uint32_t>(steps) + 1);
  }
}

/// How far the floor is claimed in the columns of a stretch.
void FloorCompletion::lookUpClaim(const DropOffs& drops, std::size_t size) {
  Stretch& of = stretch_;
  for (std::size_t k = 0; k < size; ++k) {
    const std::uint32_t c = of.column[k];
    of.limit[k] = claim_.limit[c];
    of.begin[k] = drops.begin[c];
    of.end[k] = drops.end[c];
  }
}

/// What of a stretch lies on claimed floor. Does anything?
SMOKE_GROUND_MULTIVERSION
bool FloorCompletion::findClaimed(std::size_t size) {
  Stretch& of = stretch_;
  std::uint32_t any = 0;
  for (std::size_t k = 0; k < size; ++k) {
    const double planar = of.planar[k];
    const bool is_hidden = (planar > of.begin[k]) & (planar < of.end[k]);
    const bool is_claimed = (planar <= of.limit[k]) & !is_hidden;
    of.is_claimed[k] = is_claimed ? 1 : 0;
    any |= of.is_claimed[k];
  }
  return any != 0;
}

/// Adds what lies on claimed floor that was not measured.
void FloorCompletion::keep(std::size_t size, std::uint16_t ring) {
  Stretch& from = stretch_;
  measured_cells_.grid().cellsOf(from.x.data(), from.y.data(), size, from.cell.data());
  std::size_t kept = 0;
  for (std::uint32_t k = 0; k < size; ++k) {
    from.chosen[kept] = k;
    kept += measured_cells_.contains(from.cell[k]) ? 0U : from.is_claimed[k];
  }
  drawn_.reserveMore(kept);
  for (std::size_t n = 0; n < kept; ++n) {
    const std::uint32_t k = from.chosen[n];
    const std::size_t at = drawn_.size + n;
    drawn_.points.x[at] = from.x[k];
    drawn_.points.y[at] = from.y[k];
    drawn_.points.z[at] = from.z[k];
    drawn_.column[at] = static_cast<std::uint16_t>(from.column[k]);
    drawn_.planar[at] = static_cast<float>(from.planar[k]);
    drawn_.ring[at] = ring;
  }
  drawn_.size += kept;
}

void FloorCompletion::complete(const SensedReturns& sensed, Room* room, const SensorModel& sensor,
                               const Mounting& mounting, const FloorModel& floor,
                               FloorSurface* surface) {
  confidence_.look(*room, claim_.limit);
  // With room for as much as was drawn last time, so that a new surface seldom has to grow.
  surface->resize(std::max(surface->size(), claim_.measured.size() + drawn_.size));
  placeMeasured(sensed, *room, floor, surface);
  draw(room, sensor, mounting);
  surface->resize(claim_.measured.size() + drawn_.size);
  placeDrawn(room, sensor, mounting, floor, surface);
  outline(*room, mounting, &surface->boundary);
  surface->floor_plane = rotatedPlane(floor.plane, transposed(mounting.rotation));
}

/// In input order. Marks their cells.
void FloorCompletion::placeMeasured(const SensedReturns& sensed, const Room& room,
                                    const FloorModel& floor, FloorSurface* surface) {
  const std::size_t size = claim_.measured.size();
  const bool is_upright = &sensed.points == &room.points();
  measured_cells_.clear(room.params().cell_size);
  Block block;
  for (std::size_t begin = 0; begin < size; begin += Block::kMost) {
    const std::size_t count = std::min(Block::kMost, size - begin);
    const std::uint32_t* const measured = claim_.measured.data();
    takeMeasured(sensed, measured, begin, begin + count, surface);
    const PointArrays at = is_upright
                               ? PointArrays{surface->x.data() + begin, surface->y.data() + begin,
                                             surface->z.data() + begin, count}
                               : block.take(room.points(), measured + begin, count);
    measured_cells_.insert(at.x, at.y, count);
    tellMeasuredSigma(floor, at, surface->sigma.data() + begin);
    confidence_.measured(column_.data() + begin, planar_.data() + begin, count,
                         surface->confidence.data() + begin);
  }
  std::fill_n(surface->provenance.begin(), size, Provenance::kMeasured);
}

/// After the measured ones.
void FloorCompletion::placeDrawn(Room* room, const SensorModel& sensor, const Mounting& mounting,
                                 const FloorModel& floor, FloorSurface* surface) {
  const std::size_t size = drawn_.size;
  const std::size_t first = claim_.measured.size();
  const Points* level = &drawn_.points;
  if (room->rotation() != kIdentity) {
    for (auto* values : {&level_.x, &level_.y, &level_.z}) values->resize(drawn_.column.size());
    turnPoints(arraysOf(drawn_.points, size), transposed(room->rotation()), level_.x.data(),
               level_.y.data(), level_.z.data());
    level = &level_;
  }
  float* const x = surface->x.data() + first;
  float* const y = surface->y.data() + first;
  float* const z = surface->z.data() + first;
  if (mounting.isLevel()) {
    std::copy_n(level->x.begin(), size, x);
    std::copy_n(level->y.begin(), size, y);
    std::copy_n(level->z.begin(), size, z);
  } else {
    turnPoints(arraysOf(*level, size), transposed(mounting.rotation), x, y, z);
  }
  std::fill_n(surface->intensity.begin() + static_cast<std::ptrdiff_t>(first), size, 0.0F);
  std::fill_n(surface->provenance.begin() + static_cast<std::ptrdiff_t>(first), size,
              Provenance::kReconstructed);
  placeRings(sensor, surface);
  confidence_.drawn(drawn_.column.data(), drawn_.planar.data(), size,
                    surface->confidence.data() + first);
  tellSigma(room, floor, *level, surface);
}

/// Each beam's own; of fill the ring next in elevation in the sensor frame.
void FloorCompletion::placeRings(const SensorModel& sensor, FloorSurface* surface) {
  const auto& rings = sensor.ringsByElevation();
  between_rings_.clear();
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    between_rings_.push_back(0.5 * (sensor.tangent(rings[r + 1]) + sensor.tangent(rings[r])));
  }
  const std::size_t first = claim_.measured.size();
  std::copy_n(drawn_.ring.begin(), drawn_.size, surface->ring.begin() + first);
  const std::size_t fill = first + drawn_.beams, size = drawn_.size - drawn_.beams;
  tangents_.resize(size);
  tangentsOf({surface->x.data() + fill, surface->y.data() + fill, surface->z.data() + fill, size},
             tangents_.data());
  std::size_t above = 0;  // points of a column follow each other from the foot on
  for (std::size_t k = 0; k < size; ++k) {
    const double tangent = tangents_[k];
    while (above > 0 && !(between_rings_[above - 1] < tangent)) --above;
    while (above < between_rings_.size() && between_rings_[above] < tangent) ++above;
    surface->ring[fill + k] = rings.empty() ? std::uint16_t{0} : rings[above];
  }
}

/// That of the plane, its unevenness and the relief.
void FloorCompletion::tellSigma(Room* room, const FloorModel& floor, const Points& level,
                                FloorSurface* surface) {
  const Points& upright = drawn_.points;
  float* const sigma = surface->sigma.data() + claim_.measured.size();
  room->relief().sigmas(upright.x.data(), upright.y.data(), drawn_.size, room->flatness(), sigma);
  addVariance(floor, arraysOf(level, drawn_.size), sigma);
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
    if (!(r > 0.0) && !(radius(wrapped(c + columns - 1, columns)) > 0.0)) continue;
    const double distance = room.profile().distance[c];
    const bool ends_at_wall = r > 0.0 && r >= std::max(0.0, distance - kAtWall) && r <= distance;
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
