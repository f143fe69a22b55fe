#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace smoke_ground_reconstruction {

/// What the smoke lets through.
struct Visibility {
  /// Mean along the beams to the walls [1/m]; NaN where the walls do not tell.
  double extinction = std::numeric_limits<double>::quiet_NaN();
  /// One sigma of the extinction [1/m].
  double sigma = std::numeric_limits<double>::quiet_NaN();

  bool isKnown() const { return !std::isnan(extinction); }
  /// MOR [m]: where 5 % of the light is left; infinite in clear air and where nothing is known.
  double meteorologicalRange() const;
};

/// Returns of walls, structure of arrays.
struct WallLight {
  std::vector<std::int32_t> wall;  ///< index of the wall a return belongs to
  std::vector<double> range;       ///< [m]
  std::vector<double> intensity;   ///< on the sensor's scale
  std::vector<double> cosine;      ///< of the angle of incidence

  std::size_t size() const { return wall.size(); }
  void resize(std::size_t size);
  void push(std::int32_t of_wall, double at_range, double of_intensity, double of_cosine);
};

/// Tells the smoke's extinction from the walls of one scan after another.
///
/// A wall's intensity falls as cos(incidence) exp(-2 alpha R), whatever the scale of the sensor.
/// How bright walls are in clear air is learned from scans in clear air; from then on each wall
/// tells how much of that is left. Before, only the slope of the logarithm against range tells
/// alpha, and patches of smoke tilt it. Thick smoke shows a wall through its thin places only: the
/// mean of what is seen lies above the mean of all by as much as a normal distribution (of the
/// logarithm) cut off at the detection limit. Not in the thesis. Use one per sensor. O(n).
class VisibilityEstimator {
 public:
  Visibility estimate(const WallLight& returns);

  /// ln of a wall's intensity at normal incidence in clear air, as learned; NaN before.
  double clearLevel() const { return clear_level_; }

 private:
  /// Returns of one wall in a slot of range.
  struct Bin {
    double at;      // mean range [m]
    double level;   // ln of the mean of I / cos
    double limit;   // ln of the faintest I / cos that can be seen there
    double spread;  // sigma of I / cos over its mean
    double weight;  // number of returns
  };
  struct Line {
    double extinction, sigma;
  };
  struct Sum {
    double count = 0.0, range = 0.0, bright = 0.0, square = 0.0, cosine = 0.0;
  };
  struct Seen {
    double range, intensity;
  };

  bool fillBins(const WallLight& returns);
  void sumUp(const WallLight& returns);
  double faintest();
  double span() const;
  void learn();
  Line slope() const;
  Line fromLevel() const;
  Visibility solve();
  double hidden(const Bin& bin, double extinction) const;

  double clear_level_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<Bin> bins_;
  std::vector<double> hidden_;  // of each bin
  std::vector<Sum> sums_;       // by wall and slot of range
  std::vector<Seen> seen_;
  std::vector<double> scratch_;
};

}  // namespace smoke_ground_reconstruction
