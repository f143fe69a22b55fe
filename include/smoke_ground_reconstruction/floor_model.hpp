#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/room_boundary_params.hpp"

namespace smoke_ground_reconstruction {

/// Points in one frame [m], structure of arrays.
struct Points {
  std::vector<float> x, y, z;

  std::size_t size() const { return x.size(); }
  void clear();
  void push(float px, float py, float pz);
};

/// Where a floor plane comes from.
enum class FloorSource : std::uint8_t { kMeasured = 0, kMeasuredBefore = 1, kMounting = 2 };

/// The plane z = a x + b y + c in the level frame.
struct FloorModel {
  std::array<double, 3> plane = {0, 0, 0};  ///< a, b [1] and c [m]
  std::array<double, 9> covariance = {};    ///< of the plane, row by row
  double weight = 0.0;                      ///< returns it was fitted to, by their Tukey weights
  double noise = 0.0;                       ///< one sigma of a return's range [m]
  double uneven = 0.0;                      ///< one sigma of the floor about the plane [m]
  FloorSource source = FloorSource::kMounting;
  double height_error = 0.0;  ///< measured less given height of the sensor over the floor [m]

  /// One sigma of the floor's height at (x, y): the plane's and the unevenness about it [m].
  double sigma(double x, double y) const { return std::sqrt(variance(x, y)); }
  double variance(double x, double y) const {
    const auto& c = covariance;
    const double of_plane = x * (c[0] * x + c[1] * y + c[2]) + y * (c[3] * x + c[4] * y + c[5]) +
                            (c[6] * x + c[7] * y + c[8]);
    return of_plane + uneven * uneven;
  }
  /// Variance of a return's height as that of the floor, its range's noise apart [m2]: what of the
  /// unevenness may be errors that neighbouring returns have in common; one scan cannot tell which.
  double commonVariance() const;
};

/// Fits the floor of one scan after another; keeps its buffers, not its answers.
///
/// A search over tilts finds the height that most floor cells agree on; iteratively reweighted
/// least squares (Tukey) with a weak prior at the mounting height refines it, on 2500 returns or
/// more that stand for all. Heights more than
/// `max_height_deviation` off the mounting height beneath the sensor are never looked at. O(n).
class FloorFitter {
 public:
  /// \param returns  in the level frame, finite.
  /// \param sensor_height  [m].
  /// \param before  the last good floor, taken where this scan shows too little; may be null.
  FloorModel fit(const Points& returns, double sensor_height, const FloorModel* before,
                 const RoomBoundaryParams& params = RoomBoundaryParams());

 private:
  struct Plane {
    double a, b, c;

    /// The farthest that one of its numbers lies from another's, of slopes over 5 m [m].
    double awayFrom(const Plane& other) const {
      const double tilt = std::max(std::fabs(a - other.a), std::fabs(b - other.b));
      return std::max(kNear * tilt, std::fabs(c - other.c));
    }
    static constexpr double kNear = 5.0;
  };
  struct Tilts {
    int first, last, step;  // [deg]

    std::size_t count() const { return static_cast<std::size_t>((last - first) / step + 1); }
    int operator[](std::size_t k) const { return first + static_cast<int>(k) * step; }
  };
  struct Tilt {
    int x, y;  // [deg]
    int slot;  // of height
  };
  /// Returns that vote for the floor's tilt and height; structure of arrays.
  struct Votes {
    std::vector<float> x, y, over_lowest;  // [m]
    std::vector<int> weight;

    std::size_t size() const { return weight.size(); }
    void resize(std::size_t size);
    void take(std::size_t place, const Votes& from, std::size_t k);
  };
  struct Step {
    Plane plane;
    std::array<double, 9> covariance;
  };

  static constexpr std::size_t kMostTilts = 32;   // along one axis, and some more to fill vectors
  static constexpr std::size_t kMostSlots = 100;  // of heights that are voted for

  void collectLow(const Points& returns, double sensor_height);
  void takeSome(const Points& returns, std::size_t fewest);
  void countTogether();
  Plane coarse(double sensor_height);
  void castVotes(double sensor_height);
  Tilt strongestTilt(const Votes& votes, const Tilts& along_x, const Tilts& along_y);
  void countVotes(const Votes& votes, float slope_x, const Tilts& along_y);
  int mostVotes(std::size_t tilt, int* slot) const;
  std::size_t slots() const;
  bool refineSome(const Points& returns, const Plane& plane, double sensor_height,
                  FloorModel* found);
  bool refine(Plane plane, double sensor_height, FloorModel* found);
  void keepNear(const Plane& plane);
  void fitNearer(const Points& returns, double sensor_height, FloorModel* found);
  void residuals(const Plane& plane);
  Step reweighted(double sensor_height);
  void findSteps();
  void tellNoise(double* noise, double* uneven);
  double width(double total) const;
  double totalWeight() const;

  RoomBoundaryParams params_;
  std::vector<std::uint8_t> is_low_;           // per return
  std::vector<std::uint32_t> low_;             // returns
  Points some_;                                // of these, that stand for all
  std::vector<std::uint32_t> cell_, in_cell_;  // and of each the cell, and how many share it
  std::vector<double> x_, y_, z_, sine_;       // of those that are fitted
  std::vector<double> residual_, scale_, variance_, weight_;
  std::vector<std::int32_t> sine_step_, length_step_;  // of histograms
  std::vector<double> together_;                       // returns that share each one's cell
  std::size_t count_ = 0;                              // the rest is padding
  Votes votes_, first_votes_;
  std::vector<double> squares_;                                       // of planar ranges
  std::array<std::array<int, kMostSlots + 3>, kMostTilts> counts_{};  // by tilt along y and slot
  std::vector<std::uint32_t> cell_count_;
};

}  // namespace smoke_ground_reconstruction
