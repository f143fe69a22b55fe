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
constexpr double kOpaque = 1e-18;     // of the light there and back: nothing more to be seen
constexpr double kFinestStep = 0.03;  // [m]
constexpr double kFarthest = 1000.0;  // [m]

std::size_t index(int x, int y, int z) {
  return (static_cast<std::size_t>(z & (kSizeZ - 1)) * kSizeXY + (y & (kSizeXY - 1))) * kSizeXY +
         (x & (kSizeXY - 1));
}

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

/// One cell of gradient noise (Perlin) sampled on a regular raster: what is the same in each cell.
class CellSampler {
 public:
  explicit CellSampler(int samples) : samples_(samples) {
    for (int k = 0; k < samples; ++k) {
      const float inside = (static_cast<float>(k) + 0.5F) / static_cast<float>(samples);
      offset_[static_cast<std::size_t>(k)] = inside;
      weight_[static_cast<std::size_t>(k)] = fade(inside);
    }
  }

  /// Adds the cell with these corner gradients (x fastest) to the tile, first sample at (x, y, z).
  void add(const std::array<Gradient, 8>& corners, float amplitude, int x, int y, int z,
           std::vector<float>& tile) const {
    for (int k = 0; k < samples_; ++k) {
      for (int j = 0; j < samples_; ++j) {
        for (int i = 0; i < samples_; ++i) {
          tile[index(x + i, y + j, z + k)] += amplitude * noise(corners, i, j, k);
        }
      }
    }
  }

 private:
  float noise(const std::array<Gradient, 8>& corners, int i, int j, int k) const {
    const float x = offset_[static_cast<std::size_t>(i)], y = offset_[static_cast<std::size_t>(j)],
                z = offset_[static_cast<std::size_t>(k)];
    const auto dot = [&](std::size_t corner, float dx, float dy, float dz) {
      const Gradient& g = corners[corner];
      return g[0] * (x - dx) + g[1] * (y - dy) + g[2] * (z - dz);
    };
    const auto mix = [](float a, float b, float weight) { return a + weight * (b - a); };
    const float u = weight_[static_cast<std::size_t>(i)], v = weight_[static_cast<std::size_t>(j)],
                w = weight_[static_cast<std::size_t>(k)];
    const float low =
        mix(mix(dot(0, 0, 0, 0), dot(1, 1, 0, 0), u), mix(dot(2, 0, 1, 0), dot(3, 1, 1, 0), u), v);
    const float high =
        mix(mix(dot(4, 0, 0, 1), dot(5, 1, 0, 1), u), mix(dot(6, 0, 1, 1), dot(7, 1, 1, 1), u), v);
    return mix(low, high, w);
  }

  int samples_;
  std::array<float, kSamplesPerCell> offset_{}, weight_{};
};

void addOctave(std::uint64_t seed, int octave, float amplitude, std::vector<float>& tile) {
  const auto gradients = randomGradients(seed, octave);
  const int cells_xy = 16 << octave, cells_z = 4 << octave, samples = kSamplesPerCell >> octave;
  const CellSampler sampler(samples);
  const auto gradient = [&](int x, int y, int z) {
    const int row = (z & (cells_z - 1)) * cells_xy + (y & (cells_xy - 1));
    return gradients[static_cast<std::size_t>(row * cells_xy + (x & (cells_xy - 1)))];
  };
  for (int z = 0; z < cells_z; ++z) {
    for (int y = 0; y < cells_xy; ++y) {
      for (int x = 0; x < cells_xy; ++x) {
        std::array<Gradient, 8> corners;
        for (int c = 0; c < 8; ++c) {
          corners[static_cast<std::size_t>(c)] =
              gradient(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2));
        }
        sampler.add(corners, amplitude, x * samples, y * samples, z * samples, tile);
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
  tile_ = noiseTile(seed);
  const auto sigma = static_cast<float>(params_.sigma_ln);
  for (float& sample : tile_) {
    sample = std::exp(sigma * sample - 0.5F * sigma * sigma);
  }
}

void SmokeField::planSlices() {
  const double coarsest = std::max(kFinestStep, 0.25 * params_.correlation_length);
  double range = 0.0;
  while (range < kFarthest) {
    const double step = std::min(std::max(kFinestStep, 0.05 * range), coarsest);
    slices_.push_back({range, step});
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

/// \param x, y, z  in samples of the tile
double SmokeField::patchiness(float x, float y, float z) const {
  const int x0 = floorOf(x), y0 = floorOf(y), z0 = floorOf(z);
  const float u = x - static_cast<float>(x0), v = y - static_cast<float>(y0),
              w = z - static_cast<float>(z0);
  const float* tile = tile_.data();
  const auto row = [&](int dy, int dz) {
    const float left = tile[index(x0, y0 + dy, z0 + dz)];
    return left + u * (tile[index(x0 + 1, y0 + dy, z0 + dz)] - left);
  };
  const float near_z = row(0, 0) + v * (row(1, 0) - row(0, 0));
  const float far_z = row(0, 1) + v * (row(1, 1) - row(0, 1));
  return near_z + w * (far_z - near_z);
}

void SmokeField::fillExtinctions(const Ray& ray, double time, const Slice* slices,
                                 std::size_t count, double* extinctions) const {
  std::fill(extinctions, extinctions + count, params_.mean_extinction);
  if (!tile_.empty()) {
    const Eigen::Vector3d from = (ray.origin - params_.drift * time) * cells_per_metre_;
    const Eigen::Vector3d along = ray.direction * cells_per_metre_;
    for (std::size_t i = 0; i < count; ++i) {
      const double middle = slices[i].begin + 0.5 * slices[i].step;
      extinctions[i] *= patchiness(static_cast<float>(from.x() + middle * along.x()),
                                   static_cast<float>(from.y() + middle * along.y()),
                                   static_cast<float>(from.z() + middle * along.z()));
    }
  }
  for (std::size_t i = 0; has_shape_ && i < count; ++i) {
    const double middle = slices[i].begin + 0.5 * slices[i].step;
    extinctions[i] *= shape(ray.origin.x() + middle * ray.direction.x(),
                            ray.origin.y() + middle * ray.direction.y(),
                            ray.origin.z() + middle * ray.direction.z());
  }
}

double SmokeField::extinction(const Eigen::Vector3d& position, double time) const {
  double alpha = 0.0;
  const Slice here{0.0, 0.0};
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
  constexpr std::size_t kBatch = 32;  // extinctions do not wait for each other, the light does
  std::array<double, kBatch> extinctions;
  Passage passage;
  const double gain = kPi * params_.backscatter_ratio * params_.pulse_length;
  double transmission = 1.0;                          // two ways
  double strongest_seen = 0.0, nearest_square = 1.0;  // of the soft target so far
  for (std::size_t i = 0; i < slices_.size() && slices_[i].begin < length; ++i) {
    if (i % kBatch == 0) {
      if (transmission < kOpaque) {
        break;
      }
      std::size_t count = 0;
      while (count < kBatch && i + count < slices_.size() && slices_[i + count].begin < length) {
        ++count;
      }
      fillExtinctions(ray, time, &slices_[i], count, extinctions.data());
    }
    const Slice& slice = slices_[i];
    const double step = std::min(slice.step, length - slice.begin);
    const double middle = slice.begin + 0.5 * slice.step;
    const double alpha = extinctions[i % kBatch];
    const double half_way = decay(alpha * step);  // there and back over half a step
    const double reflectivity = gain * alpha * transmission * half_way;
    const double seen = reflectivity * overlap(middle);
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
  if (passage.soft_range > 0.0) {
    passage.soft_signal = limit.signal(strongest_seen, passage.soft_range);
  }
  return passage;
}

}  // namespace simulation
}  // namespace smoke_ground_reconstruction
