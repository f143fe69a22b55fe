#include "smoke_ground_reconstruction/floor_model.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "lanes.hpp"
#include "multiversion.hpp"
#include "ordered.hpp"
#include "point_loops.hpp"
#include "sample.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kNearest = 0.3F;  // planar range of the returns that vote [m]
constexpr float kFarthest = 15.0F;
constexpr std::size_t kFitted = 2500;     // returns, at least, that stand for all low ones
constexpr std::size_t kFirstVotes = 200;  // ... of these, in the search among all tilts
constexpr int kTiltStep = 2;              // [deg]
constexpr float kSlotsPerMetre = 100.0F;  // of heights that are voted for
constexpr double kVote = 1024.0;          // a cell with one return
constexpr double kCell = 0.1;             // each cell of the floor has about one vote [m]
constexpr int kCellsAcross = 302, kMiddleCell = 151;
constexpr double kPriorSlope = 0.0524;  // one sigma of the prior: 3 deg
constexpr double kPriorHeight = 0.05;
constexpr double kTaken = 0.25;  // residuals from the winner of the votes that the fit looks at [m]
constexpr std::array<double, 3> kScales = {0.05, 0.03, 0.02};
constexpr int kSteps = 4;          // of reweighting by the noise, at most
constexpr double kStill = 2e-4;    // ... and none once the plane moves less [m]
constexpr double kTukey = 3.0;     // residuals beyond so many scales have no weight
constexpr double kUneven = 0.003;  // no floor is flatter, one sigma [m]
constexpr double kRough = 0.01;    // a floor more uneven may be two of different heights [m]
constexpr double kSmoother = 0.5;  // times the whole's unevenness has the one that the robot is on
constexpr double kNoiseLeast = 0.002, kNoiseMost = 0.1;  // of a range [m]
constexpr double kMad = 1.4826;                          // a sigma in median absolute deviations
constexpr double kSines = 1024.0, kLengths = 20000.0;    // steps in which medians are taken
constexpr double kFewest = 50.0;                         // returns that make a plane
constexpr double kNarrowest = 0.6;  // and the length they must span across, two sigma [m]
constexpr std::size_t kSumLanes = OrderedSum::kLanes;

/// As OrderedSum has it.
SMOKE_GROUND_PART double sumOf(const FourDoubles& lanes) {
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

// Rounded, for libraries that differ in the last bit. Not inline: where GCC 12 makes a vector of
// two slopes, it loses the rounding.
[[gnu::noinline]] double slopeOf(int degrees) {
  return static_cast<double>(static_cast<float>(std::tan(degrees * (M_PI / 180.0))));
}

/// The cell of a place within kFarthest.
std::uint32_t cellOf(double x, double y) {
  const int column = floorToInt(x / kCell) + kMiddleCell;
  const int row = floorToInt(y / kCell) + kMiddleCell;
  return static_cast<std::uint32_t>(column * kCellsAcross + row);
}

SMOKE_GROUND_MULTIVERSION
void cellsOf(const float* x, const float* y, std::size_t size, std::uint32_t* cell) {
  for (std::size_t k = 0; k < size; ++k) cell[k] = cellOf(x[k], y[k]);
}

/// From the number of votes in each one's cell to its weight.
SMOKE_GROUND_MULTIVERSION
void weigh(const std::uint32_t* votes, std::size_t size, int* weight) {
  for (std::size_t k = 0; k < size; ++k) {
    const auto in_cell = static_cast<double>(static_cast<std::int32_t>(votes[k]));
    weight[k] = floorToInt(kVote / std::sqrt(in_cell) + 0.5);
  }
}

/// Counts of values >= 0 in steps, and their median.
class Histogram {
 public:
  static constexpr int kSteps = 1202;  // sines up to 1, lengths up to 0.06 m; the rest in the last
  static constexpr int kNone = kSteps;

  void add(std::int32_t step) { ++counts_[static_cast<std::uint32_t>(step)]; }
  std::uint32_t total() const { return std::accumulate(counts_.begin(), counts_.end() - 1, 0U); }
  double median(double per_unit) const {
    const std::uint32_t half = (total() - 1) / 2;
    std::uint32_t below = 0;
    std::size_t step = 0;
    while ((below += counts_[step]) <= half) ++step;
    return (static_cast<double>(step) + 0.5) / per_unit;
  }

 private:
  std::array<std::uint32_t, kSteps + 1> counts_{};
};

/// Which returns lie so near to the mounting height that they may be floor.
SMOKE_GROUND_MULTIVERSION
void markLow(const Points& returns, float sensor_height, float bound, float steepest,
             std::uint8_t* is_low) {
  const float* px = returns.x.data();
  const float* py = returns.y.data();
  const float* pz = returns.z.data();
  const std::size_t size = returns.size();
  for (std::size_t i = 0; i < size; ++i) {
    const float x = px[i];
    const float y = py[i];
    const float off = std::fabs(pz[i] + sensor_height);
    const float planar = std::sqrt(x * x + y * y);
    is_low[i] = (off < bound + steepest * planar) & (planar > kNearest) & (planar < kFarthest);
  }
}

FloorModel mountingModel(double sensor_height) {
  FloorModel model;
  model.plane = {0.0, 0.0, -sensor_height};
  model.covariance = {kPriorSlope * kPriorSlope,  0, 0, 0, kPriorSlope * kPriorSlope, 0, 0, 0,
                      kPriorHeight * kPriorHeight};
  model.noise = 0.01;
  model.uneven = kUneven;
  return model;
}

FloorModel remembered(const FloorModel& before) {
  FloorModel model = before;
  for (double& entry : model.covariance) entry *= 4.0;
  model.weight = 0.0;
  model.source = FloorSource::kMeasuredBefore;
  model.height_error = 0.0;
  return model;
}

}  // namespace

void Points::clear() {
  x.clear();
  y.clear();
  z.clear();
}

void Points::push(float px, float py, float pz) {
  x.push_back(px);
  y.push_back(py);
  z.push_back(pz);
}

double FloorModel::commonVariance() const {
  return std::max(0.0, uneven * uneven - kUneven * kUneven);
}

FloorModel FloorFitter::fit(const Points& returns, double sensor_height, const FloorModel* before,
                            const RoomBoundaryParams& params) {
  params_ = params;
  collectLow(returns, sensor_height);
  takeSome(returns, kFitted);
  FloorModel found;
  if (static_cast<double>(low_.size()) >= kFewest &&
      refineSome(returns, coarse(sensor_height), sensor_height, &found)) {
    if (found.uneven > kRough) fitNearer(returns, sensor_height, &found);
    return found;
  }
  return before != nullptr ? remembered(*before) : mountingModel(sensor_height);
}

void FloorFitter::collectLow(const Points& returns, double sensor_height) {
  is_low_.resize(returns.size());
  markLow(returns, static_cast<float>(sensor_height),
          static_cast<float>(params_.max_height_deviation),
          static_cast<float>(slopeOf(params_.max_floor_tilt_deg)), is_low_.data());
  listWhere(is_low_, 1, 1, &low_);
}

/// Takes some of the low returns together.
void FloorFitter::takeSome(const Points& returns, std::size_t fewest) {
  const Sample sample(low_.size(), fewest);
  for (auto* values : {&some_.x, &some_.y, &some_.z}) values->resize(sample.size());
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const std::uint32_t i = low_[sample[k]];
    some_.x[k] = returns.x[i];
    some_.y[k] = returns.y[i];
    some_.z[k] = returns.z[i];
  }
  countTogether();
}

/// How many of some returns share each one's cell: its height above the plane is common to them.
void FloorFitter::countTogether() {
  for (auto* values : {&cell_, &in_cell_}) values->resize(some_.size());
  cellsOf(some_.x.data(), some_.y.data(), some_.size(), cell_.data());
  cell_count_.resize(static_cast<std::size_t>(kCellsAcross * kCellsAcross), 0);
  for (const std::uint32_t cell : cell_) ++cell_count_[cell];
  for (std::size_t k = 0; k < cell_.size(); ++k) in_cell_[k] = cell_count_[cell_[k]];
  for (const std::uint32_t cell : cell_) cell_count_[cell] = 0;
}

/// Tilt and height that most cells of the floor vote for. Some of the votes tell which tilt about,
/// all of them which of those beside it.
FloorFitter::Plane FloorFitter::coarse(double sensor_height) {
  castVotes(sensor_height);
  const Sample sample(votes_.size(), kFirstVotes);
  first_votes_.resize(sample.size());
  for (std::size_t k = 0; k < sample.size(); ++k) first_votes_.take(k, votes_, sample[k]);
  const int steepest = params_.max_floor_tilt_deg, even = steepest / kTiltStep * kTiltStep;
  const Tilts about = {-even, even, kTiltStep};
  Tilt tilt = strongestTilt(first_votes_, about, about);
  const auto beside = [steepest](int degrees) {
    return Tilts{std::max(-steepest, degrees - 1), std::min(steepest, degrees + 1), 1};
  };
  tilt = strongestTilt(votes_, beside(tilt.x), beside(tilt.y));
  const double lowest = -sensor_height - params_.max_height_deviation;
  return {slopeOf(tilt.x), slopeOf(tilt.y), lowest + (tilt.slot + 0.5) / kSlotsPerMetre};
}

/// The tilt, among some along both axes, that most votes agree on; slight tilts win ties.
FloorFitter::Tilt FloorFitter::strongestTilt(const Votes& votes, const Tilts& along_x,
                                             const Tilts& along_y) {
  std::int64_t best = -1;
  Tilt strongest{};
  for (int x = along_x.first; x <= along_x.last; x += along_x.step) {
    countVotes(votes, static_cast<float>(slopeOf(x)), along_y);
    for (std::size_t k = 0; k < along_y.count(); ++k) {
      const int y = along_y[k];
      int slot = 0;
      const std::int64_t steepness = std::abs(x) + std::abs(y);
      const std::int64_t most = mostVotes(k, &slot) * (500 - steepness);
      if (most <= best) continue;
      best = most;
      strongest = {x, y, slot};
    }
  }
  return strongest;
}

void FloorFitter::Votes::resize(std::size_t size) {
  for (auto* values : {&x, &y, &over_lowest}) values->resize(size);
  weight.resize(size);
}

void FloorFitter::Votes::take(std::size_t place, const Votes& from, std::size_t k) {
  x[place] = from.x[k];
  y[place] = from.y[k];
  over_lowest[place] = from.over_lowest[k];
  weight[place] = from.weight[k];
}

/// Each cell of the floor has about one vote.
void FloorFitter::castVotes(double sensor_height) {
  const auto height = static_cast<float>(sensor_height);
  const auto deviation = static_cast<float>(params_.max_height_deviation);
  votes_.resize(some_.size());
  votes_.x = some_.x;
  votes_.y = some_.y;
  for (std::size_t k = 0; k < some_.size(); ++k) {
    votes_.over_lowest[k] = (some_.z[k] + height) + deviation;
  }
  weigh(in_cell_.data(), votes_.size(), votes_.weight.data());
}

/// Slots of height that are voted for.
std::size_t FloorFitter::slots() const {
  return static_cast<std::size_t>(2.0 * params_.max_height_deviation * kSlotsPerMetre + 0.5);
}

/// Some votes by slot of height under one tilt along x and several along y, in single precision:
/// slots are 10 mm high.
SMOKE_GROUND_MULTIVERSION
void FloorFitter::countVotes(const Votes& votes, float slope_x, const Tilts& along_y) {
  const std::size_t tilts = along_y.count();
  std::array<float, kMostTilts> slopes{};
  for (std::size_t k = 0; k < tilts; ++k) slopes[k] = static_cast<float>(slopeOf(along_y[k]));
  for (std::size_t k = 0; k < tilts; ++k) std::fill_n(counts_[k].begin(), slots() + 3, 0);
  const auto highest = static_cast<float>(slots());
  const Floats nowhere = Floats{} + (highest + 1.0F);
  for (std::size_t n = 0; n < votes.size(); ++n) {
    const float turned = votes.over_lowest[n] - slope_x * votes.x[n];
    for (std::size_t first = 0; first < tilts; first += kLanes) {
      const Floats at = (turned - loadLanes(&slopes[first]) * votes.y[n]) * kSlotsPerMetre;
      const Ints is_inside = (at >= 0.0F) & (at < highest);
      const Ints slot = __builtin_convertvector(is_inside ? at : nowhere, Ints) + 1;
      const std::size_t some = std::min<std::size_t>(kLanes, tilts - first);
      for (std::size_t k = 0; k < some; ++k) counts_[first + k][slot[k]] += votes.weight[n];
    }
  }
}

/// The most votes that three slots side by side have under a tilt along y, and the middle one.
int FloorFitter::mostVotes(std::size_t tilt, int* slot) const {
  const auto& votes = counts_[tilt];
  int most = -1;
  for (std::size_t s = 0; s < slots(); ++s) {
    const int around = votes[s] + votes[s + 1] + votes[s + 2];
    if (around <= most) continue;
    most = around;
    *slot = static_cast<int>(s);
  }
  return most;
}

/// Refines a plane on some of the low returns, which are taken; what is too little among them may
/// be enough among all.
bool FloorFitter::refineSome(const Points& returns, const Plane& plane, double sensor_height,
                             FloorModel* found) {
  if (refine(plane, sensor_height, found)) return true;
  if (some_.size() == low_.size()) return false;
  takeSome(returns, low_.size());
  return refine(plane, sensor_height, found);
}

/// Tukey's reweighted least squares on some of the low returns; false where too little floor is
/// left.
SMOKE_GROUND_MULTIVERSION
bool FloorFitter::refine(Plane plane, double sensor_height, FloorModel* found) {
  keepNear(plane);
  for (const double scale : kScales) {
    std::fill(scale_.begin(), scale_.end(), scale);
    for (std::size_t k = 0; k < scale_.size(); ++k) variance_[k] = scale * scale * together_[k];
    residuals(plane);
    plane = reweighted(sensor_height).plane;
  }
  Step step{};
  double moved = kInfinity;
  for (int i = 0; i < kSteps && !(moved < kStill); ++i) {
    residuals(plane);
    tellNoise(&found->noise, &found->uneven);
    for (std::size_t k = 0; k < scale_.size(); ++k) {
      const double lift = found->noise * sine_[k];
      const double uneven = found->uneven * found->uneven;
      scale_[k] = std::sqrt(lift * lift + uneven);
      variance_[k] = lift * lift + uneven * together_[k];
    }
    step = reweighted(sensor_height);
    moved = step.plane.awayFrom(plane);
    plane = step.plane;
  }
  found->weight = totalWeight();
  found->plane = {plane.a, plane.b, plane.c};
  found->covariance = step.covariance;
  found->source = FloorSource::kMeasured;
  found->height_error = -plane.c - sensor_height;
  const double steepest = slopeOf(params_.max_floor_tilt_deg + 1);  // a step of the search more
  return plane.a * plane.a + plane.b * plane.b <= steepest * steepest && found->weight >= kFewest &&
         width(found->weight) >= kNarrowest &&
         std::fabs(found->height_error) <= params_.max_height_deviation;
}

/// Takes the plane of the nearer half of the returns where that is far more even: the floor is the
/// one that the robot stands on, not the mean of it and of a terrace behind glass.
void FloorFitter::fitNearer(const Points& returns, double sensor_height, FloorModel* found) {
  const auto square = [&](std::uint32_t i) {
    const double x = returns.x[i];
    const double y = returns.y[i];
    return x * x + y * y;
  };
  squares_.clear();
  for (const std::uint32_t i : low_) squares_.push_back(square(i));
  const auto middle = squares_.begin() + static_cast<std::ptrdiff_t>(squares_.size() / 2);
  std::nth_element(squares_.begin(), middle, squares_.end());
  const auto is_far = [&](std::uint32_t i) { return square(i) > *middle; };
  low_.erase(std::remove_if(low_.begin(), low_.end(), is_far), low_.end());
  takeSome(returns, kFitted);
  FloorModel nearer;
  const Plane plane = {found->plane[0], found->plane[1], found->plane[2]};
  if (!refineSome(returns, plane, sensor_height, &nearer)) return;
  if (nearer.uneven < kSmoother * found->uneven) *found = nearer;
}

/// Takes what lies near to a plane, padded to whole lanes by what no weight falls on.
SMOKE_GROUND_MULTIVERSION
void FloorFitter::keepNear(const Plane& plane) {
  for (auto* values : {&x_, &y_, &z_, &together_}) values->resize(some_.size() + kSumLanes);
  std::size_t count = 0;
  for (std::size_t k = 0; k < some_.size(); ++k) {
    const double x = x_[count] = some_.x[k];
    const double y = y_[count] = some_.y[k];
    const double z = z_[count] = some_.z[k];
    together_[count] = in_cell_[k];
    const double residual = z - ((plane.a * x + plane.b * y) + plane.c);
    count += std::fabs(residual) < kTaken ? 1U : 0U;
  }
  count_ = count;
  const std::size_t padded = (count_ + kSumLanes - 1) / kSumLanes * kSumLanes;
  for (auto* values : {&x_, &y_, &z_, &together_}) values->resize(padded);
  for (std::size_t k = count_; k < padded; ++k) {
    x_[k] = y_[k] = 0.0;
    z_[k] = 1e6;
    together_[k] = 1.0;
  }
  for (auto* values : {&sine_, &residual_, &scale_, &variance_, &weight_}) values->resize(padded);
  for (std::size_t i = 0; i < padded; ++i) {
    sine_[i] = std::fabs(z_[i]) / std::sqrt((x_[i] * x_[i] + y_[i] * y_[i]) + z_[i] * z_[i]);
  }
}

SMOKE_GROUND_MULTIVERSION
void FloorFitter::residuals(const Plane& plane) {
  for (std::size_t i = 0; i < residual_.size(); ++i) {
    residual_[i] = z_[i] - ((plane.a * x_[i] + plane.b * y_[i]) + plane.c);
  }
}

/// One step about the plane of the residuals: the next plane, the weights and the covariance.
SMOKE_GROUND_MULTIVERSION
FloorFitter::Step FloorFitter::reweighted(double sensor_height) {
  enum { kS, kX, kY, kZ, kXx, kXy, kXz, kYy, kYz, kSums };
  std::array<FourDoubles, kSums> sums{};
  for (std::size_t i = 0; i < x_.size(); i += kSumLanes) {
    const FourDoubles x = loadFour(&x_[i]), y = loadFour(&y_[i]), z = loadFour(&z_[i]);
    const FourDoubles u = loadFour(&residual_[i]) / (kTukey * loadFour(&scale_[i]));
    const FourDoubles rest = 1.0 - u * u;
    const FourDoubles weight = (u > -1.0) & (u < 1.0) ? rest * rest : FourDoubles{};
    std::memcpy(&weight_[i], &weight, sizeof(weight));
    const FourDoubles inverse = weight / loadFour(&variance_[i]);
    const FourDoubles wx = inverse * x, wy = inverse * y;
    sums[kS] += inverse;
    sums[kX] += wx;
    sums[kY] += wy;
    sums[kZ] += inverse * z;
    sums[kXx] += wx * x;
    sums[kXy] += wx * y;
    sums[kXz] += wx * z;
    sums[kYy] += wy * y;
    sums[kYz] += wy * z;
  }
  std::array<double, kSums> s{};
  for (std::size_t k = 0; k < kSums; ++k) s[k] = sumOf(sums[k]);
  const double slope = 1.0 / (kPriorSlope * kPriorSlope);
  const double height = 1.0 / (kPriorHeight * kPriorHeight);
  const Matrix3 covariance = symmetricInverse(
      {s[kXx] + slope, s[kXy], s[kX], s[kXy], s[kYy] + slope, s[kY], s[kX], s[kY], s[kS] + height});
  const Vector3 plane = times(covariance, Vector3{s[kXz], s[kYz], s[kZ] - sensor_height * height});
  return {{plane[0], plane[1], plane[2]}, covariance};
}

/// Steps of the histograms in which sines and residuals fall; none of residuals beyond three of the
/// scales of the step before.
SMOKE_GROUND_MULTIVERSION
void FloorFitter::findSteps() {
  constexpr int kLast = Histogram::kSteps - 1;
  for (auto* values : {&sine_step_, &length_step_}) values->resize(residual_.size());
  const double *const residual = residual_.data(), *const scale = scale_.data();
  const double* const sine = sine_.data();
  std::int32_t *const sine_step = sine_step_.data(), *const length_step = length_step_.data();
  for (std::size_t i = 0; i < residual_.size(); ++i) {
    const double length = std::fabs(residual[i]);
    const bool is_near = length < kTukey * std::max(scale[i], kScales.back());
    const int of_length = static_cast<int>((is_near ? length : 0.0) * kLengths);
    const int of_sine = static_cast<int>(sine[i] * kSines);
    length_step[i] = is_near ? std::min(of_length, kLast) : Histogram::kNone;
    sine_step[i] = is_near ? std::min(of_sine, kLast) : Histogram::kNone;
  }
}

/// A height's variance is (noise sine)^2 + unevenness^2; the medians of the steeper and of the
/// flatter half of the returns tell both. Residuals beyond three of the scales of the step before
/// tell nothing.
void FloorFitter::tellNoise(double* noise, double* uneven) {
  *noise = kNoiseLeast;
  *uneven = kUneven;
  findSteps();
  Histogram sines;
  for (std::size_t i = 0; i < count_; ++i) sines.add(sine_step_[i]);
  if (static_cast<double>(sines.total()) < kFewest) return;
  const double middle = sines.median(kSines);
  std::array<Histogram, 2> lengths, halves;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t half = sine_[i] >= middle ? 0 : 1;
    lengths[half].add(length_step_[i]);
    halves[half].add(sine_step_[i]);
  }
  if (lengths[0].total() == 0 || lengths[1].total() == 0) return;
  const double high = kMad * lengths[0].median(kLengths);
  const double low = kMad * lengths[1].median(kLengths);
  const double steepest = halves[0].median(kSines), flattest = halves[1].median(kSines);
  const double steeper = steepest * steepest, flatter = flattest * flattest;
  const double slope = (high * high - low * low) / std::max(steeper - flatter, 1e-6);
  *noise = std::sqrt(std::min(std::max(slope, kNoiseLeast * kNoiseLeast), kNoiseMost * kNoiseMost));
  const double rest = low * low - *noise * *noise * flatter;
  *uneven = std::sqrt(std::max(rest, kUneven * kUneven));
}

SMOKE_GROUND_MULTIVERSION
double FloorFitter::totalWeight() const {
  FourDoubles sum{};
  for (std::size_t i = 0; i < weight_.size(); i += kSumLanes) sum += loadFour(&weight_[i]);
  return sumOf(sum);
}

/// Two sigma of the returns' spread in the direction in which they spread least [m].
SMOKE_GROUND_MULTIVERSION
double FloorFitter::width(double total) const {
  FourDoubles sum_x{}, sum_y{};
  for (std::size_t i = 0; i < weight_.size(); i += kSumLanes) {
    sum_x += loadFour(&weight_[i]) * loadFour(&x_[i]);
    sum_y += loadFour(&weight_[i]) * loadFour(&y_[i]);
  }
  const double mean_x = sumOf(sum_x) / total;
  const double mean_y = sumOf(sum_y) / total;
  FourDoubles xx{}, xy{}, yy{};
  for (std::size_t i = 0; i < weight_.size(); i += kSumLanes) {
    const FourDoubles weight = loadFour(&weight_[i]);
    const FourDoubles x = loadFour(&x_[i]) - mean_x, y = loadFour(&y_[i]) - mean_y;
    xx += weight * x * x;
    xy += weight * x * y;
    yy += weight * y * y;
  }
  const double spread = leastAxis(sumOf(xx) / total, sumOf(xy) / total, sumOf(yy) / total).spread;
  return 2.0 * std::sqrt(std::max(0.0, spread));
}

}  // namespace smoke_ground_reconstruction
