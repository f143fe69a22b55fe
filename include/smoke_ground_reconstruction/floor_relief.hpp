#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "smoke_ground_reconstruction/nearest_cells.hpp"
#include "smoke_ground_reconstruction/posts.hpp"
#include "smoke_ground_reconstruction/room_boundary_params.hpp"

namespace smoke_ground_reconstruction {

/// Height over the floor's plane: a x + b y + c [m].
struct ReliefFacet {
  double a = 0.0, b = 0.0, c = 0.0;

  double at(double x, double y) const { return (a * x + b * y) + c; }
  bool isLevel() const { return a == 0.0 && b == 0.0; }
};

/// Where a facet `of` goes over into a facet `to`: beyond nx x + ny y = rho [m].
struct ReliefCrease {
  int of = 0, to = 0;
  double nx = 0.0, ny = 0.0, rho = 0.0;

  double side(double x, double y) const { return (nx * x + ny * y) - rho; }
};

/// A riser: its line, the normal away from the sensor, and the platform behind it [m].
struct ReliefStep {
  double nx = 0.0, ny = 0.0, rho = 0.0;
  double height = 0.0;  ///< of the platform over the plane
  int facet = 0;        ///< number of the platform's facet

  double side(double x, double y) const { return (nx * x + ny * y) - rho; }
  /// Is a return part of the riser?
  bool holds(double x, double y, double height_over_plane) const;
};

/// A slope from the floor's plane up, along a wall, and how high it is seen [m].
struct WallRamp {
  ReliefFacet facet;
  double top = 0.0;
};

/// A return's place, and its height over the plane [m].
struct ReliefPlace {
  double x, y, height;
};

/// Low returns by cells of a square grid with the sensor in its middle.
class ReliefGrid {
 public:
  static constexpr double kCell = 0.2;  ///< [m]
  static constexpr int kSide = NearestCells::kSide;
  static constexpr double kReach = 0.5 * kSide * kCell;
  static constexpr std::size_t kCells = static_cast<std::size_t>(kSide) * kSide;
  static constexpr double kLowest = -0.09, kHighest = 0.8;  ///< heights that are looked at [m]

  struct Return {
    float x, y, height;
    std::uint32_t cell;  ///< kCells where it is not looked at
  };
  /// Of the returns of a cell that has any [m].
  struct Cell {
    bool is_even;       ///< do they agree on one height?
    float median;       ///< of an even cell; 0 where all lie on the plane
    float bottom, top;  ///< not where all lie on the plane
  };
  /// Of the places and heights of a cell's returns [m].
  struct Mean {
    double x = 0.0, y = 0.0, height = 0.0;
  };

  std::vector<std::uint32_t> used;   ///< cells that have returns, in order
  std::vector<std::uint32_t> count;  ///< by cell: returns
  std::vector<Cell> cells;           ///< those that have returns are filled
  std::vector<std::uint32_t> off;    ///< returns in cells of which some lie off the plane, in order
  std::vector<Mean> means;           ///< by cell, once findMeans() was called

  /// \param which  returns to take. Both must stay as they are as long as the grid is asked.
  void fill(const UprightReturns& returns, const std::vector<std::uint32_t>& which);
  void findMeans();

  /// Number of the returns, and one of them.
  std::size_t size() const { return which_->size(); }
  Return at(std::size_t i) const {
    const std::uint32_t k = (*which_)[i];
    return {returns_->points->x[k], returns_->points->y[k], returns_->height[k], cell_of_[i]};
  }

 private:
  void take();
  void rank();
  static void rank(float* first, std::uint32_t count, Cell* cell);

  const UprightReturns* returns_ = nullptr;
  const std::vector<std::uint32_t>* which_ = nullptr;
  std::vector<std::uint16_t> cell_of_;    // by return, kCells where it is not looked at
  std::vector<std::uint8_t> marks_;       // by cell: which of those below it is
  std::vector<std::uint32_t> begin_;      // by cell
  std::vector<std::uint32_t> off_cells_;  // with returns off the plane
  std::vector<float> heights_;            // by cell, of those that are to be ranked
};

/// What of the floor is not on its plane: ramps, platforms and steps, and how they go on where
/// nothing was measured. Keeps its buffers. Not in the thesis.
///
/// Cells in which all low returns agree on one height are floor where a slope that a robot climbs
/// leads there from the plane, or where they make a platform, low and wide. Planes through them,
/// and the lines at which these planes meet or a riser stands, tell how the floor goes on.
class FloorRelief {
 public:
  /// A floor without relief strays so far from its plane per metre [m].
  static constexpr double kFlatness = 0.004;

  static constexpr double kOnPlane = 0.03;  ///< a cell so near to the plane lies on it [m]

  /// May a slope be a ramp's?
  static bool isClimbable(double slope, double max_slope);

  FloorRelief();
  /// \param which  returns to look at: smoke left out.
  void find(const UprightReturns& returns, const std::vector<std::uint32_t>& which,
            const RoomBoundaryParams& params = RoomBoundaryParams());

  /// Adds a ramp to a flat floor; false where floor measured on the plane or returns beneath the
  /// ramp deny it.
  bool addRamp(const WallRamp& ramp);

  /// Does the floor slope in one way only?
  bool hasOneSlope() const;
  /// Fits the only slope to all that lies on it, if that is enough.
  /// \param floor, feet  low returns off the walls, and the lowest ones of walls.
  /// \param normals  of the walls: a slope nearly along one, or across it, is taken to be so.
  void fitRamp(const std::vector<ReliefPlace>& floor, const std::vector<ReliefPlace>& feet,
               const std::vector<std::array<double, 2>>& normals);

  /// Is the floor its plane and nothing else?
  bool isFlat() const { return facets_.size() == 1 && !has_heights_; }
  /// Height of the floor over the plane at a place [m]: the facet of the nearest measured cell
  /// tells, or another one that begins on the way.
  double at(double x, double y);
  /// One sigma of `at` [m]: grows with the way to the next measured cell, along which the floor may
  /// bend, the more so where slopes are seen: by `flatness` a metre where none are.
  double sigma(double x, double y, double flatness = kFlatness);
  /// The same of `size` places.
  void sigmas(const float* x, const float* y, std::size_t size, double flatness, float* sigma);
  /// Does a return lie on floor off the plane, near to where it was measured?
  bool carries(double x, double y, double height);
  bool hasStep() const { return has_step_; }
  /// Is a return part of the step's riser? There is floor at its foot.
  bool isRiser(double x, double y, double height) const {
    return has_step_ && step_.holds(x, y, height);
  }

  const std::vector<ReliefFacet>& facets() const { return facets_; }
  const std::vector<ReliefCrease>& creases() const { return creases_; }

 private:
  using Indices = std::vector<std::uint32_t>;
  struct Line {
    double nx, ny, rho;
  };

  /// A slope that rises along x, y between two heights.
  struct RampFit {
    ReliefFacet facet;
    double slope, x, y, lowest, highest;
  };
  /// What lies on it: place along the slope, height, weight.
  struct OnRamp {
    double place, height, weight;
  };

  void setFlat();
  bool findStep();
  void collectRisers();
  Line straightestRiser();
  void collectRiserCells();
  bool refineRiser(Line* line) const;
  bool placeStep(const Line& line);
  bool isBehind(const ReliefGrid::Return& one, double from, double to, double far) const;
  double platformHeight(double from, double to) const;
  bool stands(double from, double to);
  bool stepCarries(const Indices& group) const;

  void findFloor();
  void reach(Indices* queue, bool climbs);
  void reachRow(std::uint32_t from, int row, bool climbs, Indices* queue);
  void addPlatforms();

  void findFacets();
  ReliefFacet strongest(const Indices& left);
  ReliefFacet fitted(const Indices& cells) const;
  std::size_t countOn(const Indices& cells, const ReliefFacet& facet) const;
  bool isOn(std::uint32_t cell, const ReliefFacet& facet) const;
  void joinStep();
  void findCreases();
  bool crossing(int first, int second, Line* line) const;
  void lowerSlopes();
  void endLevel(int facet, double level);
  double beneath(int facet, double highest, std::size_t* count) const;
  double highestOf(int facet) const;

  int slope() const;
  void findEnds(int number, RampFit* fit) const;
  void addOnRamp(const RampFit& fit, const std::vector<ReliefPlace>& places, double below,
                 double over);
  void refit(double rise, RampFit* fit) const;
  void moveCreases(int number, const RampFit& fit);

  double heightAt(std::int32_t cell, double x, double y) const;
  NearestCells::Found nearest(double x, double y);
  double sigmaPerMetre(double flatness) const;

  RoomBoundaryParams params_;
  ReliefGrid grid_;
  std::vector<std::uint8_t> is_floor_;  // by cell
  std::vector<std::uint8_t> may_join_;  // by cell: even, and not yet joined to any
  std::vector<std::int8_t> facet_;      // by cell; -1: none
  std::vector<double> height_;          // by cell, where that is floor on no facet
  NearestCells nearest_;                // of measured floor
  bool has_heights_ = false, has_step_ = false;
  double highest_ = 0.0;
  ReliefStep step_;
  std::vector<ReliefFacet> facets_;
  std::vector<ReliefCrease> creases_;
  Indices queue_, group_, left_, near_, on_, riser_, riser_cells_, riser_counts_;
  std::vector<std::array<double, 2>> sums_;         // of places, by cell
  std::vector<double> riser_x_, riser_y_, sorted_;  // the former by cell of a riser
  std::vector<int> slots_, votes_;
  std::vector<OnRamp> on_ramp_;
};

}  // namespace smoke_ground_reconstruction
