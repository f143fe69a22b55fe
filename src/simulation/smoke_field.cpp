#include "smoke_ground_reconstruction/simulation/smoke_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "smoke_ground_reconstruction/simulation/counter_random.hpp"

namespace smoke_ground_reconstruction {
namespace simulation {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kSamplesPerCell = 8;
constexpr int kSizeXY = 128;  // samples a period; a power of two, so that & wraps
constexpr int kSizeZ = 32;
constexpr std::size_t kBatch = 32;    // places along a beam that are looked up together
constexpr double kOpaque = 1e-18;     // of the light there and back: nothing more to be seen
constexpr double kFinestStep = 0.03;  // [m]
constexpr double kFarthest = 1000.0;  // [m]

std::size_t index(int x, int y, int z) {
  return (static_cast<std::size_t>(z & (kSizeZ - 1)) * kSizeXY + (y & (kSizeXY - 1))) * kSizeXY +
         (x & (kSizeXY - 1));
}

/// Place in SmokeField's tile, whose rows end with their first entry again.
int tileIndex(int x, int y, int z) { return (z * kSizeXY + y) * (kSizeXY + 1) + x; }

float fade(float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); }

using Gradient = std::array<float, 3>;

/// The gradients at the corners of one octave's cells, as [z][y][x].
std::vector<Gradient> randomGradients(std::uint64_t seed, int octave) {
  const CounterRandom random(seed);
  const auto stream = static_cast<std::uint64_t>(octave);
  std::vector<Gradient> gradients(std::size_t{16 * 16 * 4} << (3 * octave));
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    const double z = 2.0 * random.uniform(stream, 2 * i) - 1.0;
    const double angle = 2.0 * kPi * random.uniform(stream, 2 * i + 1);
    const double rho = std::sqrt(1.0 - z * z);
    gradients[i] = {static_cast<float>(rho * std::cos(angle)),
                    static_cast<float>(rho * std::sin(angle)), static_cast<float>(z)};
  }
  return gradients;
}

/// One octave of gradient noise (Perlin) along a row of cells: what is the same in each of its
/// samples is spread over arrays, so that four are computed at a time.
class NoiseRow {
 public:
  explicit NoiseRow(int samples) : samples_(samples) {
    for (int x = 0; x < kSizeXY; ++x) {
      const auto i = static_cast<std::size_t>(x);
      offset_[0][i] = inside(x % samples);
      offset_[1][i] = offset_[0][i] - 1.0F;
      weight_[i] = fade(offset_[0][i]);
    }
  }

  /// Where a sample lies within its cell, 0 to 1.
  float inside(int sample) const {
    return (static_cast<float>(sample) + 0.5F) / static_cast<float>(samples_);
  }

  /// The gradients along one of the row's four edges, one a cell; `edge` is (dy, dz), dy fastest.
  void setEdge(std::size_t edge, const Gradient* gradients) {
    const int cells = kSizeXY / samples_;
    for (int x = 0; x < kSizeXY; ++x) {
      for (int side = 0; side < 2; ++side) {
        const Gradient& g = gradients[(x / samples_ + side) & (cells - 1)];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          edges_[edge][static_cast<std::size_t>(side)][axis][static_cast<std::size_t>(x)] = g[axis];
        }
      }
    }
  }

  /// Adds the row of samples at (y, z) within the cells.
  void add(float amplitude, float y, float z, float* samples) const {
    const float v = fade(y), w = fade(z);
    for (std::size_t x = 0; x < kSizeXY; ++x) {
      const float low = mix(edge(0, x, y, z), edge(1, x, y - 1.0F, z), v);
      const float high = mix(edge(2, x, y, z - 1.0F), edge(3, x, y - 1.0F, z - 1.0F), v);
      samples[x] += amplitude * mix(low, high, w);
    }
  }

 private:
  using Row = std::array<float, kSizeXY>;

  static float mix(float a, float b, float weight) { return a + weight * (b - a); }

  float edge(std::size_t edge, std::size_t x, float y, float z) const {
    const auto dot = [&](std::size_t side) {
      const auto& g = edges_[edge][side];
      return g[0][x] * offset_[side][x] + g[1][x] * y + g[2][x] * z;
    };
    return mix(dot(0), dot(1), weight_[x]);
  }

  int samples_;
  std::array<Row, 2> offset_{};
  Row weight_{};
  std::array<std::array<std::array<Row, 3>, 2>, 4> edges_{};  // edge, side, axis
};

void addOctave(std::uint64_t seed, int octave, float amplitude, std::vector<float>& tile) {
  const auto gradients = randomGradients(seed, octave);
  const int cells_xy = 16 << octave, cells_z = 4 << octave, samples = kSamplesPerCell >> octave;
  NoiseRow row(samples);
  for (int cell = 0; cell < cells_z * cells_xy; ++cell) {
    const int y = cell % cells_xy, z = cell / cells_xy;
    for (int edge = 0; edge < 4; ++edge) {
      const int next_y = (y + (edge & 1)) & (cells_xy - 1), next_z = (z + edge / 2) & (cells_z - 1);
      const auto first = static_cast<std::size_t>((next_z * cells_xy + next_y) * cells_xy);
      row.setEdge(static_cast<std::size_t>(edge), &gradients[first]);
    }
    for (int k = 0; k < samples; ++k) {
      for (int j = 0; j < samples; ++j) {
        row.add(amplitude, row.inside(j), row.inside(k),
                &tile[index(0, y * samples + j, z * samples + k)]);
      }
    }
  }
}

void standardise(std::vector<float>& samples) {
  double sum = 0.0, squares = 0.0;
  for (const float sample : samples) {
    sum += sample;
    squares += static_cast<double>(sample) * sample;
  }
  const double mean = sum / static_cast<double>(samples.size());
  const double scale = 1.0 / std::sqrt(squares / static_cast<double>(samples.size()) - mean * mean);
  for (float& sample : samples) {
    sample = static_cast<float>((sample - mean) * scale);
  }
}

/// Largest whole number not above the value; std::floor is a call on plain x86-64.
int floorOf(float value) {
  const auto truncated = static_cast<int>(value);
  return truncated - (value < static_cast<float>(truncated) ? 1 : 0);
}

/// exp(-x) for x >= 0; its series where that is good to 1e-7.
double decay(double x) {
  return x > 0.1 ? std::exp(-x) : 1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0)));
}

void require(bool is_met, const char* what) {
  if (!is_met) {
    throw std::invalid_argument(std::string("smoke: ") + what);
  }
}

}  // namespace

void SmokeParams::validate() const {
  require(mean_extinction >= 0.0 && std::isfinite(mean_extinction),
          "mean_extinction must be a number of at least 0");
  require(sigma_ln >= 0.0 && sigma_ln <= 3.0, "sigma_ln must lie in [0, 3]");
  require(correlation_length > 0.0, "correlation_length must be above 0");
  require(backscatter_ratio >= 0.0, "backscatter_ratio must be at least 0");
  require(pulse_length > 0.0, "pulse_length must be above 0");
  require(overlap_begin >= 0.0 && overlap_end > overlap_begin,
          "overlap_end must be above overlap_begin, and that at least 0");
  require(range_jitter >= 0.0, "range_jitter must be at least 0");
  require(layer_thickness >= 0.0, "layer_thickness must be at least 0");
  require(below_layer >= 0.0, "below_layer must be at least 0");
  require(plume_radius >= 0.0, "plume_radius must be at least 0");
  require(plume_gain >= 0.0, "plume_gain must be at least 0");
  require(drift.allFinite(), "drift must be finite");
}

std::vector<float> noiseTile(std::uint64_t seed) {
  std::vector<float> tile(static_cast<std::size_t>(kSizeXY) * kSizeXY * kSizeZ, 0.0F);
  for (int octave = 0; octave < 3; ++octave) {
    addOctave(seed, octave, 1.0F / static_cast<float>(1 << octave), tile);
  }
  standardise(tile);
  return tile;
}

SmokeField::SmokeField(const SmokeParams& params, std::uint64_t seed) : params_(params) {
  params_.validate();
  cells_per_metre_ = kSamplesPerCell / params_.correlation_length;
  has_shape_ = params_.layer_thickness > 0.0 || params_.plume_radius > 0.0;
  plume_inverse_square_ =
      params_.plume_radius > 0.0 ? 1.0 / (params_.plume_radius * params_.plume_radius) : 0.0;
  planSlices();
  if (params_.sigma_ln == 0.0) {
    return;
  }
  std::vector<float> samples = noiseTile(seed);
  const auto sigma = static_cast<float>(params_.sigma_ln);
  for (float& sample : samples) {
    sample = std::exp(sigma * sample - 0.5F * sigma * sigma);
  }
  layTile(samples);
}

void SmokeField::layTile(const std::vector<float>& samples) {
  tile_.resize(static_cast<std::size_t>(tileIndex(0, 0, kSizeZ)));
  for (int z = 0; z < kSizeZ; ++z) {
    for (int y = 0; y < kSizeXY; ++y) {
      Eigen::Array4f* row = &tile_[static_cast<std::size_t>(tileIndex(0, y, z))];
      const float* corners[] = {&samples[index(0, y, z)], &samples[index(0, y + 1, z)],
                                &samples[index(0, y, z + 1)], &samples[index(0, y + 1, z + 1)]};
      for (int x = 0; x < kSizeXY; ++x) {
        row[x] << corners[0][x], corners[1][x], corners[2][x], corners[3][x];
      }
      row[kSizeXY] = row[0];
    }
  }
}

void SmokeField::planSlices() {
  const double coarsest = std::max(kFinestStep, 0.25 * params_.correlation_length);
  double range = 0.0;
  while (range < kFarthest) {
    const double step = std::min(std::max(kFinestStep, 0.05 * range), coarsest);
    begins_.push_back(range);
    steps_.push_back(step);
    middles_.push_back(range + 0.5 * step);
    overlaps_.push_back(overlap(middles_.back()));
    range += step;
  }
}

double SmokeField::shape(double x, double y, double z) const {
  double factor = 1.0;
  if (params_.layer_thickness > 0.0) {
    const double steps = (z - params_.layer_height) / params_.layer_thickness;
    factor = params_.below_layer + (1.0 - params_.below_layer) / (1.0 + std::exp(-4.0 * steps));
  }
  const double square =
      (Eigen::Vector3d(x, y, z) - params_.plume_centre).squaredNorm() * plume_inverse_square_;
  if (params_.plume_radius > 0.0 && square < 16.0) {
    factor *= 1.0 + params_.plume_gain * std::exp(-square);
  }
  return factor;
}

void SmokeField::multiplyPatches(const Ray& ray, double time, const double* ranges,
                                 std::size_t count, double* extinctions) const {
  const Eigen::Vector3d from = (ray.origin - params_.drift * time) * cells_per_metre_;
  const Eigen::Vector3d along = ray.direction * cells_per_metre_;
  std::array<float, kBatch> u, v, w;
  std::array<int, kBatch> corner;
  for (std::size_t i = 0; i < count; ++i) {  // without the look-ups: four places at a time
    const auto x = static_cast<float>(from.x() + ranges[i] * along.x());
    const auto y = static_cast<float>(from.y() + ranges[i] * along.y());
    const auto z = static_cast<float>(from.z() + ranges[i] * along.z());
    const int x0 = floorOf(x), y0 = floorOf(y), z0 = floorOf(z);
    u[i] = x - static_cast<float>(x0);
    v[i] = y - static_cast<float>(y0);
    w[i] = z - static_cast<float>(z0);
    corner[i] = tileIndex(x0 & (kSizeXY - 1), y0 & (kSizeXY - 1), z0 & (kSizeZ - 1));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Array4f* left = &tile_[static_cast<std::size_t>(corner[i])];
    const Eigen::Array4f row = left[0] + u[i] * (left[1] - left[0]);
    const float near_z = row[0] + v[i] * (row[1] - row[0]);
    const float far_z = row[2] + v[i] * (row[3] - row[2]);
    extinctions[i] *= near_z + w[i] * (far_z - near_z);
  }
}

void SmokeField::fillExtinctions(const Ray& ray, double time, const double* ranges,
                                 std::size_t count, double* extinctions) const {
  std::fill(extinctions, extinctions + count, params_.mean_extinction);
  if (!tile_.empty()) {
    multiplyPatches(ray, time, ranges, count, extinctions);
  }
  for (std::size_t i = 0; has_shape_ && i < count; ++i) {
    extinctions[i] *= shape(ray.origin.x() + ranges[i] * ray.direction.x(),
                            ray.origin.y() + ranges[i] * ray.direction.y(),
                            ray.origin.z() + ranges[i] * ray.direction.z());
  }
}

double SmokeField::extinction(const Eigen::Vector3d& position, double time) const {
  double alpha = 0.0;
  const double here = 0.0;
  fillExtinctions({position, Eigen::Vector3d::UnitX()}, time, &here, 1, &alpha);
  return alpha;
}

double SmokeField::overlap(double range) const {
  if (range >= params_.overlap_end) {
    return 1.0;
  }
  const double share =
      (range - params_.overlap_begin) / (params_.overlap_end - params_.overlap_begin);
  return std::max(0.0, share);
}

SmokeField::Passage SmokeField::march(const Ray& ray, double length, double time,
                                      const DetectionLimit& limit) const {
  std::array<double, kBatch> extinctions;  // they do not wait for each other, the light does
  Passage passage;
  const double gain = kPi * params_.backscatter_ratio * params_.pulse_length;
  double transmission = 1.0;                          // two ways
  double strongest_seen = 0.0, nearest_square = 1.0;  // of the soft target so far
  const auto end = std::lower_bound(begins_.begin(), begins_.end(), length);
  const auto slices = static_cast<std::size_t>(end - begins_.begin());
  for (std::size_t first = 0; first < slices && !(transmission < kOpaque); first += kBatch) {
    const std::size_t count = std::min(kBatch, slices - first);
    fillExtinctions(ray, time, &middles_[first], count, extinctions.data());
    for (std::size_t i = 0; i < count; ++i) {
      const double middle = middles_[first + i], alpha = extinctions[i];
      const double step = std::min(steps_[first + i], length - begins_[first + i]);
      const double half_way = decay(alpha * step);  // there and back over half a step
      const double reflectivity = gain * alpha * transmission * half_way;
      const double seen = reflectivity * overlaps_[first + i];
      if (middle < length &&  // signals are compared without a division
          seen * nearest_square > strongest_seen * middle * middle) {
        strongest_seen = seen;
        nearest_square = middle * middle;
        passage.soft_range = middle;
        passage.soft_reflectivity = reflectivity;
      }
      transmission *= half_way * half_way;
      passage.optical_depth += alpha * step;
    }
  }
  if (passage.soft_range > 0.0) {
    passage.soft_signal = limit.signal(strongest_seen, passage.soft_range);
  }
  return passage;
}

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
