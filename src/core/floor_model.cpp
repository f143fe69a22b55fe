#include "smoke_ground_reconstruction/floor_model.hpp"

#include <algorithm>
#include <cmath>

#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kNearest = 0.3;  // planar range of the returns that vote [m]
constexpr double kFarthest = 15.0;
constexpr std::size_t kVotes = 1500;  // returns, at least, that take part in the search of the tilt
constexpr std::size_t kFitted = 8000;     // and in the fit
constexpr double kSlotsPerMetre = 100.0;  // of heights that are voted for
constexpr std::size_t kMostSlots = 100;   // 0.5 m to either side
constexpr double kCell = 0.1;             // each cell of the floor has about one vote [m]
constexpr int kCellsAcross = 302, kMiddleCell = 151;
constexpr double kPriorSlope = 0.0524;  // one sigma of the prior: 3 deg
constexpr double kPriorHeight = 0.05;
constexpr double kTaken = 0.25;  // residuals from the winner of the votes that the fit looks at [m]
constexpr std::array<double, 3> kScales = {0.05, 0.03, 0.02};
constexpr int kSteps = 4;          // of reweighting by the noise
constexpr double kTukey = 3.0;     // residuals beyond so many scales have no weight
constexpr double kUneven = 0.003;  // no floor is flatter, one sigma [m]
constexpr double kNoiseLeast = 0.002, kNoiseMost = 0.03;  // of a range [m]
constexpr double kMad = 1.4826;                           // a sigma in median absolute deviations
constexpr double kSines = 1024.0, kLengths = 20000.0;     // steps in which medians are taken
constexpr double kFewest = 50.0;                          // returns that make a plane
constexpr double kNarrowest = 0.6;  // and the length they must span across, two sigma [m]
constexpr std::size_t kLanes = OrderedSum::kLanes;

// Rounded, for libraries that differ in the last bit.
double slopeOf(int degrees) {
  return static_cast<double>(static_cast<float>(std::tan(degrees * (M_PI / 180.0))));
}

/// Counts of values >= 0 in steps, and their median.
class Histogram {
 public:
  explicit Histogram(double per_unit) : per_unit_(per_unit), counts_(kSize, 0) {}

  void add(double value) {
    ++counts_[static_cast<std::size_t>(value * per_unit_)];
    ++total_;
  }
  bool isEmpty() const { return total_ == 0; }
  double median() const {
    std::size_t below = 0;
    std::size_t slot = 0;
    while ((below += counts_[slot]) <= (total_ - 1) / 2) ++slot;
    return (static_cast<double>(slot) + 0.5) / per_unit_;
  }

 private:
  static constexpr std::size_t kSize = 1202;  // sines up to 1, lengths up to 0.06 m
  double per_unit_;
  std::vector<std::uint32_t> counts_;
  std::size_t total_ = 0;
};

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

double FloorModel::sigma(double x, double y) const {
  const auto& c = covariance;
  const double plane_part = x * (c[0] * x + c[1] * y + c[2]) + y * (c[3] * x + c[4] * y + c[5]) +
                            (c[6] * x + c[7] * y + c[8]);
  return std::sqrt(plane_part + uneven * uneven);
}

FloorModel FloorFitter::fit(const Points& returns, double sensor_height, const FloorModel* before,
                            const RoomBoundaryParams& params) {
  params_ = params;
  collectLow(returns, sensor_height);
  FloorModel found;
  if (static_cast<double>(count_) >= kFewest &&
      refine(coarse(sensor_height), sensor_height, &found)) {
    return found;
  }
  return before != nullptr ? remembered(*before) : mountingModel(sensor_height);
}

void FloorFitter::collectLow(const Points& returns, double sensor_height) {
  for (auto* values : {&x_, &y_, &z_}) values->clear();
  const double bound = params_.max_height_deviation;
  const double steepest = slopeOf(params_.max_floor_tilt_deg);
  const double highest_reach = bound + steepest * kFarthest;
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const double z = returns.z[i];
    const double off = std::fabs(z + sensor_height);
    if (off >= highest_reach) continue;
    const double x = returns.x[i];
    const double y = returns.y[i];
    const double planar = std::sqrt(x * x + y * y);
    if (!(off < bound + steepest * planar && planar > kNearest && planar < kFarthest)) {
      continue;
    }
    x_.push_back(x);
    y_.push_back(y);
    z_.push_back(z);
  }
  count_ = x_.size();
}

/// Tilt and height that most cells of the floor vote for; slight tilts win ties.
FloorFitter::Plane FloorFitter::coarse(double sensor_height) {
  const std::size_t stride = std::max<std::size_t>(1, count_ / kVotes);
  weighVotes(stride);
  over_lowest_.clear();
  for (std::size_t i = 0; i < count_; i += stride) {
    over_lowest_.push_back((z_[i] + sensor_height) + params_.max_height_deviation);
  }
  turned_.resize(vote_.size());
  slot_.resize(vote_.size());
  double best = -1.0;
  Plane plane{};
  const int steepest = params_.max_floor_tilt_deg;
  for (int along_x = -steepest; along_x <= steepest; ++along_x) {
    const double a = slopeOf(along_x);
    for (std::size_t i = 0; i < vote_.size(); ++i) turned_[i] = over_lowest_[i] - a * vote_x_[i];
    for (int along_y = -steepest; along_y <= steepest; ++along_y) {
      const double b = slopeOf(along_y);
      double slot = 0.0;
      const double most =
          strongest(b, &slot) * (1.0 - 0.002 * (std::abs(along_x) + std::abs(along_y)));
      if (most <= best) continue;
      best = most;
      plane = {a, b, -sensor_height - params_.max_height_deviation + (slot + 0.5) / kSlotsPerMetre};
    }
  }
  return plane;
}

/// Each cell of the floor has about one vote.
void FloorFitter::weighVotes(std::size_t stride) {
  for (auto* values : {&vote_x_, &vote_y_, &vote_}) values->clear();
  vote_cell_.clear();
  cell_count_.resize(static_cast<std::size_t>(kCellsAcross * kCellsAcross), 0);
  for (std::size_t i = 0; i < count_; i += stride) {
    const int column = floorToInt(x_[i] / kCell) + kMiddleCell;
    const int row = floorToInt(y_[i] / kCell) + kMiddleCell;
    vote_cell_.push_back(static_cast<std::uint32_t>(column * kCellsAcross + row));
    ++cell_count_[vote_cell_.back()];
    vote_x_.push_back(x_[i]);
    vote_y_.push_back(y_[i]);
  }
  for (const std::uint32_t cell : vote_cell_) {
    vote_.push_back(1.0 / std::sqrt(static_cast<double>(cell_count_[cell])));
  }
  for (const std::uint32_t cell : vote_cell_) cell_count_[cell] = 0;
}

/// The most votes that three slots side by side have under a tilt, and the middle one.
double FloorFitter::strongest(double b, double* slot) {
  const auto slots =
      static_cast<std::size_t>(2.0 * params_.max_height_deviation * kSlotsPerMetre + 0.5);
  const auto nowhere = static_cast<std::uint8_t>(slots + 2);
  for (std::size_t i = 0; i < slot_.size(); ++i) {
    const double at = (turned_[i] - b * vote_y_[i]) * kSlotsPerMetre;
    const bool is_inside = at >= 0.0 && at < static_cast<double>(slots);
    slot_[i] = is_inside ? static_cast<std::uint8_t>(static_cast<int>(at) + 1) : nowhere;
  }
  std::array<double, kMostSlots + 3> votes{};
  for (std::size_t i = 0; i < slot_.size(); ++i) votes[slot_[i]] += vote_[i];
  double most = -1.0;
  for (std::size_t s = 0; s < slots; ++s) {
    const double around = (votes[s] + votes[s + 1]) + votes[s + 2];
    if (around <= most) continue;
    most = around;
    *slot = static_cast<double>(s);
  }
  return most;
}

/// Tukey's reweighted least squares; false where too little floor is left.
bool FloorFitter::refine(Plane plane, double sensor_height, FloorModel* found) {
  keepNear(plane);
  for (const double scale : kScales) {
    std::fill(scale_.begin(), scale_.end(), scale);
    residuals(plane);
    plane = reweighted(sensor_height).plane;
  }
  Step step{};
  for (int i = 0; i < kSteps; ++i) {
    residuals(plane);
    tellNoise(&found->noise, &found->uneven);
    for (std::size_t k = 0; k < scale_.size(); ++k) {
      const double lift = found->noise * sine_[k];
      scale_[k] = std::sqrt(lift * lift + found->uneven * found->uneven);
    }
    step = reweighted(sensor_height);
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

/// Leaves only what lies near to a plane, padded to whole lanes by what no weight falls on.
void FloorFitter::keepNear(const Plane& plane) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const double residual = z_[i] - ((plane.a * x_[i] + plane.b * y_[i]) + plane.c);
    if (!(std::fabs(residual) < kTaken)) continue;
    x_[kept] = x_[i];
    y_[kept] = y_[i];
    z_[kept++] = z_[i];
  }
  count_ = kept;
  const std::size_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  for (auto* values : {&x_, &y_}) {
    values->resize(count_);
    values->resize(padded, 0.0);
  }
  z_.resize(count_);
  z_.resize(padded, 1e6);
  for (auto* values : {&sine_, &residual_, &scale_, &weight_}) values->resize(padded);
  for (std::size_t i = 0; i < padded; ++i) {
    sine_[i] = std::fabs(z_[i]) / std::sqrt((x_[i] * x_[i] + y_[i] * y_[i]) + z_[i] * z_[i]);
  }
}

void FloorFitter::residuals(const Plane& plane) {
  for (std::size_t i = 0; i < residual_.size(); ++i) {
    residual_[i] = z_[i] - ((plane.a * x_[i] + plane.b * y_[i]) + plane.c);
  }
}

/// One step about the plane of the residuals: the next plane, the weights and the covariance.
FloorFitter::Step FloorFitter::reweighted(double sensor_height) {
  enum { kS, kX, kY, kZ, kXx, kXy, kXz, kYy, kYz, kSums };
  std::array<std::array<double, kLanes>, kSums> sums{};
  for (std::size_t i = 0; i < x_.size(); i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t k = i + lane;
      const double u = residual_[k] / (kTukey * scale_[k]);
      const double rest = 1.0 - u * u;
      const double weight = std::fabs(u) < 1.0 ? rest * rest : 0.0;
      weight_[k] = weight;
      const double inverse = weight / (scale_[k] * scale_[k]);
      const double wx = inverse * x_[k];
      const double wy = inverse * y_[k];
      sums[kS][lane] += inverse;
      sums[kX][lane] += wx;
      sums[kY][lane] += wy;
      sums[kZ][lane] += inverse * z_[k];
      sums[kXx][lane] += wx * x_[k];
      sums[kXy][lane] += wx * y_[k];
      sums[kXz][lane] += wx * z_[k];
      sums[kYy][lane] += wy * y_[k];
      sums[kYz][lane] += wy * z_[k];
    }
  }
  std::array<double, kSums> s{};
  for (std::size_t k = 0; k < kSums; ++k) {
    s[k] = (sums[k][0] + sums[k][1]) + (sums[k][2] + sums[k][3]);
  }
  const double slope = 1.0 / (kPriorSlope * kPriorSlope);
  const double height = 1.0 / (kPriorHeight * kPriorHeight);
  const Matrix3 covariance = symmetricInverse(
      {s[kXx] + slope, s[kXy], s[kX], s[kXy], s[kYy] + slope, s[kY], s[kX], s[kY], s[kS] + height});
  const Vector3 plane = times(covariance, Vector3{s[kXz], s[kYz], s[kZ] - sensor_height * height});
  return {{plane[0], plane[1], plane[2]}, covariance};
}

/// A height's variance is (noise sine)^2 + unevenness^2; the medians of the steeper and of the
/// flatter half of the returns tell both.
void FloorFitter::tellNoise(double* noise, double* uneven) {
  *noise = kNoiseLeast;
  *uneven = kUneven;
  const double nearest = kTukey * kScales.back();
  Histogram sines(kSines);
  std::size_t near = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (!(std::fabs(residual_[i]) < nearest)) continue;
    sines.add(sine_[i]);
    ++near;
  }
  if (static_cast<double>(near) < kFewest) return;
  const double middle = sines.median();
  std::array<Histogram, 2> lengths = {Histogram(kLengths), Histogram(kLengths)};
  std::array<Histogram, 2> halves = {Histogram(kSines), Histogram(kSines)};
  for (std::size_t i = 0; i < count_; ++i) {
    if (!(std::fabs(residual_[i]) < nearest)) continue;
    const std::size_t half = sine_[i] >= middle ? 0 : 1;
    lengths[half].add(std::fabs(residual_[i]));
    halves[half].add(sine_[i]);
  }
  if (lengths[0].isEmpty() || lengths[1].isEmpty()) return;
  const double high = kMad * lengths[0].median();
  const double low = kMad * lengths[1].median();
  const double steeper = halves[0].median() * halves[0].median();
  const double flatter = halves[1].median() * halves[1].median();
  const double slope = (high * high - low * low) / std::max(steeper - flatter, 1e-6);
  *noise = std::sqrt(std::min(std::max(slope, kNoiseLeast * kNoiseLeast), kNoiseMost * kNoiseMost));
  const double rest = low * low - *noise * *noise * flatter;
  *uneven = std::sqrt(std::max(rest, kUneven * kUneven));
}

double FloorFitter::totalWeight() const {
  OrderedSum sum;
  for (const double weight : weight_) sum.add(weight);
  return sum.value();
}

/// Two sigma of the returns' spread in the direction in which they spread least [m].
double FloorFitter::width(double total) const {
  OrderedSum sum_x, sum_y;
  for (std::size_t i = 0; i < count_; ++i) {
    sum_x.add(weight_[i] * x_[i]);
    sum_y.add(weight_[i] * y_[i]);
  }
  const double mean_x = sum_x.value() / total;
  const double mean_y = sum_y.value() / total;
  OrderedSum xx, xy, yy;
  for (std::size_t i = 0; i < count_; ++i) {
    const double x = x_[i] - mean_x;
    const double y = y_[i] - mean_y;
    xx.add(weight_[i] * x * x);
    xy.add(weight_[i] * x * y);
    yy.add(weight_[i] * y * y);
  }
  const double spread =
      leastAxis(xx.value() / total, xy.value() / total, yy.value() / total).spread;
  return 2.0 * std::sqrt(std::max(0.0, spread));
}

}  // namespace smoke_ground_reconstruction
