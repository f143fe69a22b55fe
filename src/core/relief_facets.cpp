#include <algorithm>
#include <cmath>
#include <limits>

#include "multiversion.hpp"
#include "ordered.hpp"
#include "smoke_ground_reconstruction/floor_relief.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInlier = 0.015;   // a cell lies on a facet if its mean height is so near [m]
constexpr std::size_t kFewest = 6;  // cells of a facet
constexpr std::size_t kMostFacets = 6;
constexpr std::size_t kSeeds = 48;  // cells around which facets are sought
constexpr double kAround = 0.5;     // half the window around a seed [m]
constexpr std::uint32_t kMostWeight = 25;
constexpr double kPrior = 0.0025;      // keeps slopes from what too short a piece cannot tell [m^2]
constexpr double kLevel = 0.03;        // facets less steep are level
constexpr double kSteeper = 1.5625;    // a facet may be so many times as steep as the way onto it
constexpr double kBend = 0.03;         // facets whose slopes differ by less do not cross
constexpr double kShare = 0.85;        // of the cells lie on their own side of a crease,
constexpr double kCreaseSlack = 0.15;  // or no farther than this beyond it [m]

constexpr double kRiserLowest = 0.03;  // heights of what may be a riser [m]
constexpr double kRiserOver = 0.02;    // ... up to so much over the highest step
constexpr double kRiserExtent = 0.06;  // between lowest and highest return of a riser's cell [m]
constexpr double kStepTop = 0.05;  // nothing in a riser's cell is higher, over the highest step [m]
constexpr int kAngles = 180;       // 1 deg apart
constexpr double kRhoStep = 0.04;  // [m]
constexpr double kLineHalf = 0.03;  // returns of a riser lie so near to its line [m]
constexpr std::size_t kLineCells = 8;
constexpr double kLineLength = 1.5;  // [m]
constexpr double kTopShare = 0.9;    // of the cells' tops lie below the platform
constexpr double kOnTop = 0.05;      // so far behind and near its top: returns on its platform [m]
constexpr std::size_t kFewestOnTop = 8;  // tell its height
constexpr double kBehind = 0.2;          // what lies so far behind a riser lies on its platform [m]
constexpr std::size_t kMostAgainst = 2;
constexpr double kLower = 0.04;  // returns so far below a facet: the floor is lower there [m]
constexpr std::size_t kFewestLower = 3;  // returns
constexpr double kBeside = 1.0;          // the lowest of them counts if the next lies so near [m]

/// Slots of the distances that lines of a normal through places have, that of 0 being the middle.
SMOKE_GROUND_MULTIVERSION
void slotsOf(const std::vector<double>& x, const std::vector<double>& y, const Direction& normal,
             int middle, int* slot) {
  const double* px = x.data();
  const double* py = y.data();
  const double cosine = normal.cosine, sine = normal.sine;
  for (std::size_t i = 0, n = x.size(); i < n; ++i) {
    slot[i] = floorToInt((cosine * px[i] + sine * py[i]) / kRhoStep) + middle;
  }
}

/// No line through one of the places passes the origin farther away than by so many slots.
int farthestSlot(const std::vector<double>& x, const std::vector<double>& y) {
  double square = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) square = std::max(square, x[i] * x[i] + y[i] * y[i]);
  return static_cast<int>(std::sqrt(square) / kRhoStep) + 1;
}

/// The most votes that two slots side by side have.
SMOKE_GROUND_MULTIVERSION
int mostInPairs(const int* votes, std::size_t size) {
  int most = 0;
  for (std::size_t s = 0; s + 1 < size; ++s) most = std::max(most, votes[s] + votes[s + 1]);
  return most;
}

}  // namespace

bool ReliefStep::holds(double x, double y, double over_plane) const {
  return over_plane > kRiserLowest && over_plane < height + kLineHalf &&
         std::fabs(side(x, y)) < kLineHalf;
}

// --- the step ---------------------------------------------------------------------------------

/// The longest riser of a platform, if nothing speaks against it.
bool FloorRelief::findStep() {
  collectRisers();
  if (riser_.size() < kLineCells) return false;
  collectRiserCells();
  if (riser_cells_.size() < kLineCells) return false;
  Line line = straightestRiser();
  return refineRiser(&line) && line.rho >= kBehind && placeStep(line);
}

/// Returns that may be a riser's.
void FloorRelief::collectRisers() {
  riser_.clear();
  const double highest = params_.max_step_height;
  for (const std::uint32_t i : grid_.off) {
    const auto one = grid_.at(i);
    const double top = grid_.cells[one.cell].top;
    const double bottom = grid_.cells[one.cell].bottom;
    if (!(top < highest + kStepTop) || !(top - bottom > kRiserExtent)) continue;
    if (one.height > kRiserLowest && one.height < highest + kRiserOver) riser_.push_back(i);
  }
}

/// The line that runs through most cells with returns: a Hough transform, one vote a cell.
FloorRelief::Line FloorRelief::straightestRiser() {
  int best = 0;
  Line line{1.0, 0.0, 0.0};
  slots_.resize(riser_x_.size());
  const int middle = farthestSlot(riser_x_, riser_y_) + 2;  // none is voted for at either end
  for (int k = 0; k < kAngles; ++k) {
    const Direction normal = Direction::fromDegrees(k);
    slotsOf(riser_x_, riser_y_, normal, middle, slots_.data());
    votes_.assign(static_cast<std::size_t>(2 * middle), 0);
    for (const int slot : slots_) ++votes_[static_cast<std::size_t>(slot)];
    const int most = mostInPairs(votes_.data(), votes_.size());
    if (most <= best) continue;
    best = most;
    int at = 0;
    while (votes_[static_cast<std::size_t>(at)] + votes_[static_cast<std::size_t>(at) + 1] != most)
      ++at;
    line = {normal.cosine, normal.sine, (at - middle + 1) * kRhoStep};
  }
  return line;
}

/// Cells with returns that may be a riser's, and the means of their places.
void FloorRelief::collectRiserCells() {
  riser_counts_.assign(ReliefGrid::kCells, 0);
  sums_.resize(ReliefGrid::kCells);
  for (const std::uint32_t i : riser_) {
    const auto one = grid_.at(i);
    auto& sum = sums_[one.cell];
    if (riser_counts_[one.cell]++ == 0) sum = {0.0, 0.0};
    sum[0] += one.x;
    sum[1] += one.y;
  }
  riser_cells_.clear();
  riser_x_.clear();
  riser_y_.clear();
  for (const std::uint32_t c : grid_.used) {
    if (riser_counts_[c] == 0) continue;
    riser_cells_.push_back(c);
    riser_x_.push_back(sums_[c][0] / riser_counts_[c]);
    riser_y_.push_back(sums_[c][1] / riser_counts_[c]);
  }
}

/// Total least squares through the returns near a line, twice; false where too few are left. The
/// normal then points away from the sensor.
bool FloorRelief::refineRiser(Line* line) const {
  for (int round = 0; round < 2; ++round) {
    const auto is_near = [&](const ReliefGrid::Return& one) {
      return std::fabs((line->nx * one.x + line->ny * one.y) - line->rho) < 2.0 * kLineHalf;
    };
    OrderedSum x, y, xx, xy, yy;
    for (const std::uint32_t i : riser_) {
      const auto one = grid_.at(i);
      if (!is_near(one)) continue;
      x.add(one.x);
      y.add(one.y);
    }
    if (x.count() < kLineCells) return false;
    const double mean_x = x.value() / static_cast<double>(x.count());
    const double mean_y = y.value() / static_cast<double>(y.count());
    for (const std::uint32_t i : riser_) {
      const auto one = grid_.at(i);
      if (!is_near(one)) continue;
      const double dx = one.x - mean_x, dy = one.y - mean_y;
      xx.add(dx * dx);
      xy.add(dx * dy);
      yy.add(dy * dy);
    }
    const LeastAxis axis = leastAxis(xx.value(), xy.value(), yy.value());
    const double rho = axis.x * mean_x + axis.y * mean_y;
    *line = rho >= 0.0 ? Line{axis.x, axis.y, rho} : Line{-axis.x, -axis.y, -rho};
  }
  return true;
}

/// The platform behind a riser's line; false where the riser is short or something speaks against.
bool FloorRelief::placeStep(const Line& line) {
  sorted_.clear();
  riser_counts_.assign(ReliefGrid::kCells, 0);
  for (const std::uint32_t i : riser_) {
    const auto one = grid_.at(i);
    if (!(std::fabs((line.nx * one.x + line.ny * one.y) - line.rho) < kLineHalf)) continue;
    sorted_.push_back(line.nx * one.y - line.ny * one.x);
    riser_counts_[one.cell] = 1;
  }
  if (sorted_.empty()) return false;
  std::sort(sorted_.begin(), sorted_.end());
  const double from = sorted_[sorted_.size() / 20];
  const double to = sorted_[sorted_.size() - 1 - sorted_.size() / 20];
  sorted_.clear();
  for (const std::uint32_t c : riser_cells_) {
    if (riser_counts_[c] != 0) sorted_.push_back(grid_.cells[c].top);
  }
  if (sorted_.size() < kLineCells || !(to - from >= kLineLength)) return false;
  std::sort(sorted_.begin(), sorted_.end());
  const auto top = static_cast<std::size_t>(kTopShare * static_cast<double>(sorted_.size() - 1));
  step_ = {line.nx, line.ny, line.rho, sorted_[top], 0};
  if (!stands(from, to)) return false;
  step_.height = platformHeight(from, to);
  return true;
}

/// Does a return lie so far behind the riser, as far as it is seen to run?
bool FloorRelief::isBehind(const ReliefGrid::Return& one, double from, double to,
                           double far) const {
  const double along = step_.nx * one.y - step_.ny * one.x;
  return step_.side(one.x, one.y) > far && along > from && along < to;
}

/// The mean of what lies on the platform, no wall above it, if that is enough; else the riser's
/// top, which noise lifts.
double FloorRelief::platformHeight(double from, double to) const {
  OrderedSum height;
  for (const std::uint32_t i : grid_.off) {
    const auto one = grid_.at(i);
    const auto& cell = grid_.cells[one.cell];
    if (!(cell.top < step_.height + kLower) || !(cell.top > kOnPlane)) continue;
    if (!isBehind(one, from, to, kOnTop)) continue;
    if (one.height > step_.height - kLower) height.add(one.height);
  }
  if (height.count() < kFewestOnTop) return step_.height;
  return height.value() / static_cast<double>(height.count());
}

/// Does nothing behind a riser, as far as it is seen to run, lie lower than its top?
bool FloorRelief::stands(double from, double to) {
  group_.clear();
  for (std::size_t i = 0; i < grid_.size(); ++i) {
    const auto one = grid_.at(i);
    if (one.cell == ReliefGrid::kCells || !isBehind(one, from, to, kBehind)) continue;
    if (one.height < step_.height - kLower) group_.push_back(one.cell);
  }
  std::sort(group_.begin(), group_.end());
  group_.erase(std::unique(group_.begin(), group_.end()), group_.end());
  return group_.size() <= kMostAgainst;
}

/// Do cells lie on the step's platform?
bool FloorRelief::stepCarries(const Indices& group) const {
  return std::all_of(group.begin(), group.end(), [this](std::uint32_t c) {
    const auto& mean = grid_.means[c];
    return std::fabs(mean.height - step_.height) < kLower &&
           step_.side(mean.x, mean.y) > -kCreaseSlack;
  });
}

// --- the facets -------------------------------------------------------------------------------

/// Planes through the raised cells.
void FloorRelief::findFacets() {
  while (left_.size() >= kFewest && facets_.size() <= kMostFacets) {
    const ReliefFacet facet = strongest(left_);
    if (countOn(left_, facet) < kFewest) break;
    near_.clear();
    for (const std::uint32_t c : left_) {
      if (isOn(c, facet)) {
        facet_[c] = static_cast<std::int8_t>(facets_.size());
      } else {
        near_.push_back(c);
      }
    }
    facets_.push_back(facet);
    left_.swap(near_);
  }
}

bool FloorRelief::isOn(std::uint32_t cell, const ReliefFacet& facet) const {
  const auto& mean = grid_.means[cell];
  return std::fabs(mean.height - facet.at(mean.x, mean.y)) < kInlier;
}

std::size_t FloorRelief::countOn(const Indices& cells, const ReliefFacet& facet) const {
  return static_cast<std::size_t>(
      std::count_if(cells.begin(), cells.end(), [&](std::uint32_t c) { return isOn(c, facet); }));
}

/// The plane that most cells lie on, fitted to them.
ReliefFacet FloorRelief::strongest(const Indices& left) {
  const double steepest = kSteeper * params_.max_slope;
  ReliefFacet best;
  std::size_t count = 0;
  for (std::size_t s = 0; s < left.size(); s += std::max<std::size_t>(1, left.size() / kSeeds)) {
    const auto& seed = grid_.means[left[s]];
    on_.clear();
    for (const std::uint32_t c : left) {
      const auto& mean = grid_.means[c];
      const bool is_near =
          std::fabs(mean.x - seed.x) < kAround && std::fabs(mean.y - seed.y) < kAround;
      if (is_near) on_.push_back(c);
    }
    for (const ReliefFacet& facet : {ReliefFacet{0.0, 0.0, seed.height}, fitted(on_)}) {
      const std::size_t found = countOn(left, facet);
      const double square = facet.a * facet.a + facet.b * facet.b;
      if (found <= count || !(square < steepest * steepest)) continue;
      best = facet;
      count = found;
    }
  }
  for (int round = 0; round < 3; ++round) {
    on_.clear();
    for (const std::uint32_t c : left) {
      if (isOn(c, best)) on_.push_back(c);
    }
    if (!on_.empty()) best = fitted(on_);
  }
  return best;
}

/// Least squares through the means of cells; level where it is nearly so.
ReliefFacet FloorRelief::fitted(const Indices& cells) const {
  const auto weightOf = [this](std::uint32_t c) {
    return static_cast<double>(std::min(grid_.count[c], kMostWeight));
  };
  OrderedSum total, sum_x, sum_y, sum_h;
  for (const std::uint32_t c : cells) {
    const double weight = weightOf(c);
    total.add(weight);
    sum_x.add(weight * grid_.means[c].x);
    sum_y.add(weight * grid_.means[c].y);
    sum_h.add(weight * grid_.means[c].height);
  }
  const double mean_x = sum_x.value() / total.value(), mean_y = sum_y.value() / total.value();
  const double mean_h = sum_h.value() / total.value();
  OrderedSum of_xx, of_xy, of_yy, of_xh, of_yh;
  for (const std::uint32_t c : cells) {
    const auto& mean = grid_.means[c];
    const double weight = weightOf(c);
    const double x = mean.x - mean_x, y = mean.y - mean_y;
    const double h = mean.height - mean_h;
    of_xx.add(weight * (x * x));
    of_xy.add(weight * (x * y));
    of_yy.add(weight * (y * y));
    of_xh.add(weight * (x * h));
    of_yh.add(weight * (y * h));
  }
  const double xx = of_xx.value() + kPrior, xy = of_xy.value(), yy = of_yy.value() + kPrior;
  const double xh = of_xh.value(), yh = of_yh.value();
  const double determinant = xx * yy - xy * xy;
  const double a = (xh * yy - yh * xy) / determinant, b = (yh * xx - xh * xy) / determinant;
  if (a * a + b * b < kLevel * kLevel) return {0.0, 0.0, mean_h};
  return {a, b, mean_h - (a * mean_x + b * mean_y)};
}

/// The facet of the step's platform: one that is there, or one of its own.
void FloorRelief::joinStep() {
  for (std::size_t f = 1; f < facets_.size(); ++f) {
    if (!facets_[f].isLevel() || !(std::fabs(facets_[f].c - step_.height) < kOnPlane)) continue;
    step_.facet = static_cast<int>(f);
    return;
  }
  step_.facet = static_cast<int>(facets_.size());
  facets_.push_back({0.0, 0.0, step_.height});
}

// --- where they meet --------------------------------------------------------------------------

void FloorRelief::findCreases() {
  const int count = static_cast<int>(facets_.size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      Line line{step_.nx, step_.ny, step_.rho};
      const bool is_step = has_step_ && a == 0 && b == step_.facet;
      if (!is_step && !crossing(a, b, &line)) continue;
      creases_.push_back({a, b, line.nx, line.ny, line.rho});
      creases_.push_back({b, a, -line.nx, -line.ny, -line.rho});
    }
  }
}

/// Where two facets meet, the normal towards the second; false where no line parts them.
bool FloorRelief::crossing(int first, int second, Line* line) const {
  const ReliefFacet& one = facets_[static_cast<std::size_t>(first)];
  const ReliefFacet& other = facets_[static_cast<std::size_t>(second)];
  const double x = one.a - other.a, y = one.b - other.b;
  const double length = std::sqrt(x * x + y * y);
  if (length < kBend) return false;
  *line = {x / length, y / length, (other.c - one.c) / length};
  // By facet: cells, those on the positive side, those no farther than the slack on either side.
  struct Sides {
    std::size_t cells = 0, positive = 0, below_slack = 0, above_slack = 0;
  };
  std::array<Sides, 2> sides;
  for (const std::uint32_t c : grid_.used) {
    if (facet_[c] != first && facet_[c] != second) continue;
    const auto& mean = grid_.means[c];
    const double side = (line->nx * mean.x + line->ny * mean.y) - line->rho;
    Sides& of = sides[facet_[c] == first ? 0 : 1];
    ++of.cells;
    of.positive += side > 0.0 ? 1 : 0;
    of.below_slack += side < kCreaseSlack ? 1 : 0;
    of.above_slack += side > -kCreaseSlack ? 1 : 0;
  }
  const bool is_turned = 2 * sides[1].positive < sides[1].cells;
  if (is_turned) *line = {-line->nx, -line->ny, -line->rho};
  const std::size_t before = is_turned ? sides[0].above_slack : sides[0].below_slack;
  const std::size_t behind = is_turned ? sides[1].below_slack : sides[1].above_slack;
  return static_cast<double>(before) >= kShare * static_cast<double>(sides[0].cells) &&
         static_cast<double>(behind) >= kShare * static_cast<double>(sides[1].cells);
}

/// Gives each slope that returns from beneath it disprove a level end: a wall's returns from below
/// a ramp drawn on show that the ramp has ended before it.
void FloorRelief::lowerSlopes() {
  const int count = static_cast<int>(facets_.size());
  for (int f = 1; f < count; ++f) {
    const ReliefFacet facet = facets_[static_cast<std::size_t>(f)];
    if (facet.isLevel()) continue;
    const double highest = highestOf(f);
    std::size_t against = 0;
    const double lowest = beneath(f, highest, &against);
    if (against < kFewestLower) continue;
    endLevel(f, std::max(highest, lowest));
  }
}

void FloorRelief::endLevel(int facet, double level) {
  const ReliefFacet slope = facets_[static_cast<std::size_t>(facet)];
  const double length = std::sqrt(slope.a * slope.a + slope.b * slope.b);
  creases_.push_back({facet, static_cast<int>(facets_.size()), slope.a / length, slope.b / length,
                      (level - slope.c) / length});
  facets_.push_back({0.0, 0.0, level});
}

bool FloorRelief::isClimbable(double slope, double max_slope) {
  return std::fabs(slope) > kLevel && std::fabs(slope) < kSteeper * max_slope;
}

bool FloorRelief::addRamp(const WallRamp& ramp) {
  const ReliefFacet& slope = ramp.facet;
  std::size_t denying = 0;
  for (std::uint32_t c = 0; c < ReliefGrid::kCells; ++c) {
    if (is_floor_[c] == 0) continue;
    const int column = static_cast<int>(c) % ReliefGrid::kSide - ReliefGrid::kSide / 2;
    const int row = static_cast<int>(c) / ReliefGrid::kSide - ReliefGrid::kSide / 2;
    const double x = ReliefGrid::kCell * (column + 0.5), y = ReliefGrid::kCell * (row + 0.5);
    denying += slope.at(x, y) > 2.0 * kOnPlane ? 1U : 0U;
  }
  const double length = std::sqrt(slope.a * slope.a + slope.b * slope.b);
  const double nx = slope.a / length, ny = slope.b / length, rho = -slope.c / length;
  facets_.push_back(slope);
  creases_.push_back({0, 1, nx, ny, rho});
  creases_.push_back({1, 0, -nx, -ny, -rho});
  std::size_t lower = 0, beyond = 0;
  beneath(1, 0.0, &lower);
  const double lowest = beneath(1, ramp.top, &beyond);
  if (std::max(denying, lower - beyond) >= kFewestLower) {
    setFlat();
    return false;
  }
  if (beyond >= kFewestLower) endLevel(1, std::max(ramp.top, lowest));
  return true;
}

double FloorRelief::highestOf(int facet) const {
  double highest = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t c : grid_.used) {
    if (facet_[c] == facet) highest = std::max(highest, grid_.means[c].height);
  }
  return highest;
}

/// Lowest of the returns in unmeasured cells that lie beneath a facet drawn on to there, or the
/// second lowest if that is far from it, as one alone may be smoke; and how many there are.
double FloorRelief::beneath(int facet, double highest, std::size_t* count) const {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  ReliefGrid::Return lowest{0.0F, 0.0F, kNone, 0}, second = lowest;
  *count = 0;
  for (std::size_t i = 0; i < grid_.size(); ++i) {
    const auto one = grid_.at(i);
    if (one.cell == ReliefGrid::kCells) continue;
    const double model = facets_[static_cast<std::size_t>(facet)].at(one.x, one.y);
    if (!(one.height < model - kLower) || !(model > highest) || is_floor_[one.cell] != 0) continue;
    const bool is_beyond =
        std::any_of(creases_.begin(), creases_.end(), [&](const ReliefCrease& crease) {
          return crease.of == facet && crease.side(one.x, one.y) > 0.0;
        });
    if (is_beyond) continue;
    ++*count;
    if (one.height < lowest.height) {
      second = lowest;
      lowest = one;
    } else if (one.height < second.height) {
      second = one;
    }
  }
  const double x = static_cast<double>(lowest.x) - static_cast<double>(second.x);
  const double y = static_cast<double>(lowest.y) - static_cast<double>(second.y);
  return x * x + y * y < kBeside * kBeside ? lowest.height : second.height;
}

}  // namespace smoke_ground_reconstruction
