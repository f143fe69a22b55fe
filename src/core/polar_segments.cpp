#include "smoke_ground_reconstruction/polar_segments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "smoke_ground_reconstruction/predicates.hpp"
#include "smoke_ground_reconstruction/recycled.hpp"
#include "validation.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr double kDegree = M_PI / 180.0;
// Measured floor that ends this near to the wall ends at the wall [m].
constexpr double kWallContact = 0.2;

/// n values from `first` to `last`, both included; one value is `first` (numpy.linspace).
double linspaced(double first, double last, std::size_t index, std::size_t count) {
  if (count < 2) return first;
  return first + (last - first) * static_cast<double>(index) / static_cast<double>(count - 1);
}

/// Cosine and sine of an azimuth.
struct Heading {
  double cosine, sine;

  explicit Heading(double azimuth_deg)
      : cosine(std::cos(azimuth_deg * kDegree)), sine(std::sin(azimuth_deg * kDegree)) {}
};

/// Azimuths of a segment in steps of the horizontal resolution, both ends included.
void listHeadings(double begin_deg, double width_deg, double step_deg,
                  std::vector<Heading>* headings) {
  headings->clear();
  const auto whole_steps = static_cast<int>(std::floor(width_deg / step_deg + 1e-9));
  for (int i = 0; i <= whole_steps; ++i) headings->emplace_back(begin_deg + i * step_deg);
  if (width_deg - whole_steps * step_deg > 1e-9) headings->emplace_back(begin_deg + width_deg);
}

using Bins = Recycled<std::uint32_t>;

/// Of points, all at once; of points that are no returns any.
Bins binsOf(const Scan& scan, const AzimuthBins& bins) {
  Bins of(scan.size());
  bins.indices(scan.x.data(), scan.y.data(), scan.size(), of.data());
  return of;
}

/// Step 1: minima over the wall points of each segment, each on its own. Points whose ring has no
/// rank are left out.
void addWalls(const Scan& walls, const SensorModel& sensor, const AzimuthBins& bins,
              WallDistance distance, std::vector<PolarSegment>* segments) {
  const Bins bin = binsOf(walls, bins);
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const std::size_t rank = sensor.rank(walls.ring[i]);
    if (walls.valid[i] == 0 || rank == SensorModel::kNoRank) continue;
    PolarSegment& segment = (*segments)[bin[i]];
    const double d = distance == WallDistance::kRange ? range(walls.x[i], walls.y[i], walls.z[i])
                                                      : planarRange(walls.x[i], walls.y[i]);
    const bool is_first = segment.wall_points++ == 0;
    segment.lowest_z = is_first ? walls.z[i] : std::min(segment.lowest_z, walls.z[i]);
    segment.min_distance = is_first ? d : std::min(segment.min_distance, d);
    segment.rings_below_wall = is_first ? rank : std::min(segment.rings_below_wall, rank);
  }
}

void addGround(const Scan& ground, const Bins& bin, std::vector<PolarSegment>* segments) {
  for (std::size_t i = 0; i < ground.size(); ++i) {
    if (ground.valid[i] != 0) ++(*segments)[bin[i]].ground_points;
  }
}

/// Step 3 for one segment: first the lower neighbour, then the sensor's floor height.
double adjustedZ(const PolarSegmentsParams& params, const PolarSegment& segment,
                 const PolarSegment& before, const PolarSegment& after, double origin_z) {
  double z = segment.lowest_z;
  double lower = std::numeric_limits<double>::infinity();
  for (const PolarSegment* neighbor : {&before, &after}) {
    if (neighbor->has_wall) lower = std::min(lower, static_cast<double>(neighbor->lowest_z));
  }
  if (z - lower > params.height_difference_threshold) z = lower;
  const Direction limit = Direction::fromDegrees(params.max_elevation_angle_deg);
  const bool too_steep = limit.cosine * std::fabs(z - origin_z) > limit.sine * segment.min_distance;
  return too_steep ? origin_z : z;
}

/// Share of a segment's azimuth steps in which a wall point was seen, per segment.
std::vector<float> wallSupport(const Scan& walls, std::size_t segment_count, double steps) {
  const auto steps_per_segment = static_cast<std::size_t>(std::max(1.0, std::floor(steps + 1e-9)));
  const AzimuthBins bins(360.0 / static_cast<double>(segment_count * steps_per_segment));
  const Bins bin = binsOf(walls, bins);
  std::vector<char> seen(bins.count(), 0);
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (walls.valid[i] != 0) seen[bin[i]] = 1;
  }
  std::vector<float> support(segment_count);
  for (std::size_t s = 0; s < segment_count; ++s) {
    const auto begin = seen.begin() + static_cast<std::ptrdiff_t>(s * steps_per_segment);
    const auto count = std::count(begin, begin + static_cast<std::ptrdiff_t>(steps_per_segment), 1);
    support[s] =
        static_cast<float>(static_cast<double>(count) / static_cast<double>(steps_per_segment));
  }
  return support;
}

void appendMeasured(const ScanView& ground, std::size_t i, FloorSurface* surface) {
  surface->x.push_back(ground.x[i]);
  surface->y.push_back(ground.y[i]);
  surface->z.push_back(ground.z[i]);
  surface->intensity.push_back(ground.intensity[i]);
  surface->ring.push_back(ground.ring[i]);
  surface->provenance.push_back(Provenance::kMeasured);
  surface->confidence.push_back(1.0F);
}

/// A point of Algorithm 3 at a distance from the axis, an azimuth and a height (level frame).
void appendReconstructed(double r, const Heading& heading, double z, std::uint16_t ring,
                         float confidence, const Mounting& mounting, FloorSurface* surface) {
  const auto x = static_cast<float>(r * heading.cosine);
  const auto y = static_cast<float>(r * heading.sine);
  const auto point = mounting.toSensor(x, y, static_cast<float>(z));
  surface->x.push_back(point[0]);
  surface->y.push_back(point[1]);
  surface->z.push_back(point[2]);
  surface->intensity.push_back(0.0F);
  surface->ring.push_back(ring);
  surface->provenance.push_back(Provenance::kReconstructed);
  surface->confidence.push_back(confidence);
}

/// Algorithm 3 for one segment. Radius 0 is one point, not one per azimuth.
void reconstructSegment(const PolarSegment& segment, const std::vector<Heading>& headings,
                        const SensorModel& sensor, float confidence, const Mounting& mounting,
                        FloorSurface* surface) {
  const std::size_t n = segment.rings_below_wall;
  const double origin_z = -mounting.sensor_height;
  for (std::size_t j = 0; j < n; ++j) {
    const double r = linspaced(0.0, segment.min_distance, j, n);
    const double z = linspaced(origin_z, segment.adjusted_z, j, n);
    const std::uint16_t ring = sensor.ringsByElevation()[j];
    const std::size_t azimuths = j == 0 ? 1 : headings.size();
    for (std::size_t k = 0; k < azimuths; ++k) {
      appendReconstructed(r, headings[k], z, ring, confidence, mounting, surface);
    }
  }
}

/// How far a segment's claimed floor reaches along the ground, and what ends it.
struct Reach {
  double radius = 0.0;
  double z = 0.0;
  BoundaryKind kind = BoundaryKind::kLimitOfKnowledge;
};

std::vector<Reach> reachOf(const std::vector<PolarSegment>& segments, const Scan& ground,
                           const Bins& bin, double origin_z) {
  std::vector<Reach> reach(segments.size());
  for (std::size_t i = 0; i < ground.size(); ++i) {
    if (ground.valid[i] == 0) continue;
    Reach& r = reach[bin[i]];
    r.radius = std::max(r.radius, planarRange(ground.x[i], ground.y[i]));
  }
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const PolarSegment& segment = segments[s];
    reach[s].z = origin_z;
    if (segment.keeps_measured) {
      const bool at_wall = segment.has_wall && reach[s].radius > 0.0 &&
                           reach[s].radius >= segment.min_distance - kWallContact;
      if (at_wall) reach[s].kind = BoundaryKind::kWallSeen;
      continue;
    }
    const bool has_extent = segment.rings_below_wall >= 2;
    reach[s] = {has_extent ? segment.min_distance : 0.0, has_extent ? segment.adjusted_z : origin_z,
                has_extent ? BoundaryKind::kWallSeen : BoundaryKind::kLimitOfKnowledge};
  }
  return reach;
}

/// Is the outline torn between two segments: walls of both seen, but at different distances?
bool isTorn(const Reach& before, const Reach& after) {
  return before.kind == BoundaryKind::kWallSeen && after.kind == BoundaryKind::kWallSeen &&
         std::fabs(before.radius - after.radius) > kWallContact;
}

/// Two vertices a segment, at its ends; the sensor's foot once where segments in a row claim
/// nothing. Where the outline is torn the first end stands twice, the second time as a limit of
/// knowledge: the edge along the line of sight that follows is no wall that anybody saw.
FloorOutline outline(const std::vector<Reach>& reach, double width_deg, const Mounting& mounting) {
  FloorOutline boundary;
  const bool claims_floor =
      std::any_of(reach.begin(), reach.end(), [](const Reach& r) { return r.radius > 0.0; });
  if (!claims_floor) return boundary;
  const auto append = [&](const Reach& r, double azimuth_deg, BoundaryKind kind) {
    const double azimuth = azimuth_deg * kDegree;
    boundary.vertices.push_back(mounting.toSensor(static_cast<float>(r.radius * std::cos(azimuth)),
                                                  static_cast<float>(r.radius * std::sin(azimuth)),
                                                  static_cast<float>(r.z)));
    boundary.kinds.push_back(kind);
  };
  for (std::size_t s = 0; s < reach.size(); ++s) {
    const Reach& here = reach[s];
    const double begin_deg = static_cast<double>(s) * width_deg;
    const double end_deg = begin_deg + width_deg;
    const bool foot_stands = s > 0 && reach[s - 1].radius == 0.0;
    if (here.radius > 0.0 || !foot_stands) append(here, begin_deg, here.kind);
    if (here.radius > 0.0) append(here, end_deg, here.kind);
    if (isTorn(here, reach[(s + 1) % reach.size()])) {
      append(here, end_deg, BoundaryKind::kLimitOfKnowledge);
    }
  }
  return boundary;
}

std::array<double, 3> levelPlane(const Mounting& mounting) {
  const auto& r = mounting.rotation;
  return {-r[6] / r[8], -r[7] / r[8], -mounting.sensor_height / r[8]};
}

}  // namespace

void PolarSegmentsParams::validate() const {
  require(dividesCircle(segment_angle_deg), "segment_angle_deg", kCircleDivisor, segment_angle_deg);
  require(horizontal_resolution_deg >= 0.01 && horizontal_resolution_deg <= segment_angle_deg,
          "horizontal_resolution_deg", "at least 0.01 and at most segment_angle_deg",
          horizontal_resolution_deg);
  require(reconstruction_gain >= 0.0, "reconstruction_gain", ">= 0", reconstruction_gain);
  require(min_wall_points >= 1, "min_wall_points", ">= 1", min_wall_points);
  require(height_difference_threshold >= 0.0, "height_difference_threshold", ">= 0",
          height_difference_threshold);
  require(max_elevation_angle_deg >= 0.0 && max_elevation_angle_deg < 90.0,
          "max_elevation_angle_deg", "from 0 to below 90", max_elevation_angle_deg);
}

PolarSegments::PolarSegments(const PolarSegmentsParams& params)
    : params_(validated(params)), bins_(params.segment_angle_deg) {}

std::vector<PolarSegment> PolarSegments::segments(const Scan& ground, const Scan& walls,
                                                  const SensorModel& sensor,
                                                  const Mounting& mounting) const {
  std::vector<PolarSegment> segments(bins_.count());
  addWalls(walls, sensor, bins_, params_.wall_distance, &segments);
  addGround(ground, binsOf(ground, bins_), &segments);
  const double steps = params_.segment_angle_deg / params_.horizontal_resolution_deg;
  for (PolarSegment& segment : segments) {
    segment.has_wall = segment.wall_points >= static_cast<std::size_t>(params_.min_wall_points);
    const double expected_points =  // Eq. 3.1
        static_cast<double>(segment.rings_below_wall) * steps * params_.reconstruction_gain;
    segment.keeps_measured =
        !segment.has_wall || static_cast<double>(segment.ground_points) > expected_points;
  }
  const double origin_z = -mounting.sensor_height;
  const std::size_t n = segments.size();
  for (std::size_t s = 0; s < n; ++s) {
    segments[s].adjusted_z = segments[s].lowest_z;
    if (segments[s].keeps_measured) continue;
    segments[s].adjusted_z =
        adjustedZ(params_, segments[s], segments[(s + n - 1) % n], segments[(s + 1) % n], origin_z);
  }
  return segments;
}

FloorSurface PolarSegments::reconstruct(const ScanView& ground, const ScanView& walls,
                                        const SensorModel& sensor, const Mounting& mounting) const {
  const Scan level_ground(ground, mounting);
  const Scan level_walls(walls, mounting);
  const auto grid = segments(level_ground, level_walls, sensor, mounting);
  const double width_deg = 360.0 / static_cast<double>(grid.size());
  const auto support =
      wallSupport(level_walls, grid.size(), width_deg / params_.horizontal_resolution_deg);

  const Bins bin = binsOf(level_ground, bins_);
  FloorSurface surface;
  for (std::size_t i = 0; i < level_ground.size(); ++i) {
    if (level_ground.valid[i] == 0) continue;
    if (grid[bin[i]].keeps_measured) appendMeasured(ground, i, &surface);
  }
  Recycled<Heading> headings;
  for (std::size_t s = 0; s < grid.size(); ++s) {
    if (grid[s].keeps_measured) continue;
    listHeadings(static_cast<double>(s) * width_deg, width_deg, params_.horizontal_resolution_deg,
                 &headings);
    reconstructSegment(grid[s], headings, sensor, support[s], mounting, &surface);
  }
  surface.boundary =
      outline(reachOf(grid, level_ground, bin, -mounting.sensor_height), width_deg, mounting);
  surface.floor_plane = levelPlane(mounting);
  return surface;
}

}  // namespace smoke_ground_reconstruction
