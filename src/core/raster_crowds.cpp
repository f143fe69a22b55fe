#include "smoke_ground_reconstruction/raster_crowds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "azimuth.hpp"
#include "lanes.hpp"
#include "multiversion.hpp"
#include "neighbor_screen.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kWidth = ScanRaster::kWidth;
constexpr std::size_t kHalo = 8;                   // columns looked at to either side
constexpr std::size_t kSpan = kWidth + 2 * kHalo;  // a stripe with the columns around it
constexpr std::size_t kFewestColumns = 8 * kWidth;
constexpr std::size_t kLargestCrowd = 32;
constexpr std::size_t kMostCandidates = 128;  // of a row's points, in the mean
constexpr double kAngleMargin = 2e-5;
constexpr double kUpright = M_PI / 2.0;

/// Signed squares of the sines of elevations in a row, lane by lane.
struct Sines {
  std::array<float, kLanes> lowest, highest;
};

/// Takes the points of a stripe in. Returns the least squared range.
SMOKE_GROUND_MULTIVERSION
float takeSines(const float* x, const float* y, const float* z, std::size_t rows, Sines* of_rows) {
  Floats nearest = Floats{} + INFINITY;
  for (std::size_t row = 0; row < rows; ++row) {
    Floats lowest = loadLanes(of_rows[row].lowest.data());
    Floats highest = loadLanes(of_rows[row].highest.data());
    for (std::size_t at = row * kWidth; at < (row + 1) * kWidth; at += kLanes) {
      const Floats here_z = loadLanes(z + at);
      const Floats square = squaredRangeOf(loadLanes(x + at), loadLanes(y + at), here_z);
      const Floats sine = here_z * magnitudeOf(here_z) / square;
      lowest = sine < lowest ? sine : lowest;  // no number is not less
      highest = sine > highest ? sine : highest;
      nearest = square < nearest ? square : nearest;
    }
    std::memcpy(of_rows[row].lowest.data(), &lowest, sizeof(lowest));
    std::memcpy(of_rows[row].highest.data(), &highest, sizeof(highest));
  }
  float least = INFINITY;
  for (std::size_t lane = 0; lane < kLanes; ++lane) least = std::min(least, nearest[lane]);
  return least;
}

double elevationOf(float signed_square, double margin) {
  const double square = signed_square;
  const double sine = std::copysign(std::sqrt(std::fabs(square)), square) + margin;
  return std::asin(std::clamp(sine, -1.0, 1.0));
}

/// Lowest and highest elevation in a row [rad]; the other way round in one without points.
struct Span {
  double lowest = INFINITY, highest = -INFINITY;

  bool isEmpty() const { return lowest > highest; }
  double steepest() const { return std::max(-lowest, highest); }
  double distanceTo(const Span& other) const {
    return std::max(other.lowest - highest, lowest - other.highest);
  }
};

/// A row of any layer where neighbours can lie, so many columns to either side.
struct NearRow {
  std::uint32_t row;
  std::uint32_t columns;
};

/// Where neighbours of a row's points can lie: the places [begin, end) of a list. Those of a row
/// without points: nowhere.
struct Reach {
  std::uint32_t begin = 0, end = 0;
};

/// Greatest difference of azimuth [rad] of two points that far apart, of rows that far apart.
double azimuthBetween(const Span& a, const Span& b, double angle) {
  const double apart = std::sin(std::max(0.0, a.distanceTo(b)) / 2.0);
  const double whole = std::sin(angle / 2.0);
  const double cosines = std::cos(a.steepest()) * std::cos(b.steepest());
  return 2.0 *
         std::asin(std::sqrt(std::clamp((whole * whole - apart * apart) / cosines, 0.0, 1.0)));
}

/// Factors of squared ranges: balls a hair smaller and a hair larger than the one asked about.
struct Factors {
  float surely, possibly;

  explicit Factors(double radius_per_range) {
    const double squared = radius_per_range * radius_per_range;
    surely = static_cast<float>(squared * (1.0 - 4.0 * kScreenMargin));
    possibly = static_cast<float>(squared * (1.0 + 4.0 * kScreenMargin));
  }
};

/// Points and the balls around them, lane by lane.
struct Balls {
  Floats x, y, z;
  Floats surely_below, possibly_below;  // squared distances
};

SMOKE_GROUND_PART Balls ballsAround(const Floats& x, const Floats& y, const Floats& z,
                                    const Factors& factors) {
  const Floats square = squaredRangeOf(x, y, z);
  return {x, y, z, square * factors.surely, square * factors.possibly};
}

/// How many points were found in balls.
struct Found {
  Ints surely = {}, possibly = {};

  SMOKE_GROUND_PART void look(const Balls& balls, const Floats& x, const Floats& y,
                              const Floats& z) {
    const Floats dx = x - balls.x, dy = y - balls.y, dz = z - balls.z;
    const Floats d2 = (dx * dx + dy * dy) + dz * dz;
    surely -= d2 < balls.surely_below;  // true is -1; nothing is less than no number
    possibly -= d2 < balls.possibly_below;
  }
};

/// The rows of a stripe, layer by layer, with the columns around it.
struct Around {
  Recycled<float> x, y, z;                  // rows of kSpan
  Recycled<std::int32_t> surely, possibly;  // found so far, rows of kWidth

  explicit Around(std::size_t rows)
      : x(rows * kSpan), y(x.size()), z(x.size()), surely(rows * kWidth), possibly(surely.size()) {}
};

/// The rows of a stripe with the columns around it. \param from  the stripe's first place, between
/// those of others.
SMOKE_GROUND_MULTIVERSION
void takeRows(const float* from, std::size_t rows, float* to) {
  const std::size_t size = rows * kWidth;
  for (const float* row = from; row < from + size; row += kWidth, to += kSpan) {
    std::memcpy(to, row - size + kWidth - kHalo, kHalo * sizeof(float));
    std::memcpy(to + kHalo, row, kWidth * sizeof(float));
    std::memcpy(to + kHalo + kWidth, row + size, kHalo * sizeof(float));
  }
}

SMOKE_GROUND_PART void lookAt(const Around& around, std::size_t at, const Balls& balls,
                              Found* found) {
  found->look(balls, loadLanes(&around.x[at]), loadLanes(&around.y[at]), loadLanes(&around.z[at]));
}

constexpr std::uint64_t kOneEach = 0x0101010101010101;

/// Eight small numbers, a byte each.
SMOKE_GROUND_PART std::uint64_t eightBytesOf(const Ints& lanes) {
  const Bytes bytes = bytesOf(lanes);
  std::uint64_t which;
  std::memcpy(&which, &bytes, sizeof(which));
  return which;
}

/// The sum of eight bytes, if it is a byte.
SMOKE_GROUND_PART std::uint64_t sumOfBytes(std::uint64_t bytes) { return bytes * kOneEach >> 56; }

/// Are so few of eight left that one after the other is looked at?
SMOKE_GROUND_PART bool areFew(std::uint64_t which) {
  constexpr std::uint64_t kFew = 3;
  return sumOfBytes(which) <= kFew;
}

SMOKE_GROUND_PART std::int32_t sumOf(const Ints& lanes) {
  std::int32_t sum = 0;
  for (std::uint32_t k = 0; k < kLanes; ++k) sum += lanes[k];
  return sum;
}

constexpr std::size_t kFirstSteps = 2;  // after which points of even surfaces have found enough

/// Looks along a row for eight points, from the middle to both sides, until all have found enough.
SMOKE_GROUND_PART void lookForAll(const Around& around, std::size_t at, std::uint32_t columns,
                                  const Balls& balls, const Ints& enough, Found* found) {
  lookAt(around, at, balls, found);
  for (std::size_t step = 1; step <= columns; ++step) {
    lookAt(around, at - step, balls, found);
    lookAt(around, at + step, balls, found);
    if (step == kFirstSteps && isNone(found->surely < enough)) return;
  }
}

/// Looks along rows for one point, at eight places at once, until it has found enough.
/// \param at  its place in row 0.
SMOKE_GROUND_PART void lookForOne(const Around& around, std::size_t at, const NearRow* near_row,
                                  const NearRow* end, const Balls& ball, std::int32_t enough,
                                  std::int32_t* surely, std::int32_t* possibly) {
  Found found;
  for (; near_row < end; ++near_row) {
    const std::size_t there = at + near_row->row * kSpan;
    lookAt(around, there - kLanes, ball, &found);
    lookAt(around, there, ball, &found);
    if (near_row->columns == kLanes) lookAt(around, there + kLanes, ball, &found);
    const std::uint64_t sum = sumOfBytes(eightBytesOf(found.surely));  // of few rows: no more come
    if (*surely + static_cast<std::int32_t>(sum) >= enough) break;
  }
  *surely += sumOf(found.surely);
  *possibly += sumOf(found.possibly);
}

/// Neighbours of eight points, until each has found enough, itself included.
/// \param at  the first one's place in its row.
SMOKE_GROUND_PART void findNeighbors(const Around& around, std::size_t at, std::uint32_t row,
                                     const Reach& reach, const NearRow* near_rows,
                                     const Factors& factors, std::int32_t enough,
                                     std::int32_t* surely, std::int32_t* possibly) {
  const std::size_t in_row_0 = at - row * kSpan;
  const Floats x = loadLanes(&around.x[at]), y = loadLanes(&around.y[at]),
               z = loadLanes(&around.z[at]);
  const Balls balls = ballsAround(x, y, z, factors);
  const Ints is_taken = x == x;
  const Ints enough_each = is_taken & (Ints{} + enough);
  std::uint64_t seeking = eightBytesOf(is_taken) & kOneEach;
  const NearRow* next = near_rows + reach.begin;
  const NearRow* const end = near_rows + reach.end;
  Found found;
  while (!areFew(seeking) && next < end) {
    lookForAll(around, in_row_0 + next->row * kSpan, next->columns, balls, enough_each, &found);
    ++next;
    seeking = eightBytesOf(found.surely < enough_each) & kOneEach;
  }
  std::memcpy(surely, &found.surely, sizeof(found.surely));
  std::memcpy(possibly, &found.possibly, sizeof(found.possibly));
  for (; seeking != 0 && next < end; seeking &= seeking - 1) {
    const auto lane = static_cast<std::uint32_t>(__builtin_ctzll(seeking)) / 8;
    const Floats none = {};
    const Balls ball = ballsAround(none + around.x[at + lane], none + around.y[at + lane],
                                   none + around.z[at + lane], factors);
    lookForOne(around, in_row_0 + lane, next, end, ball, enough, surely + lane, possibly + lane);
  }
}

/// The same of all points of a stripe.
SMOKE_GROUND_MULTIVERSION
void findAllNeighbors(const std::vector<Reach>& reaches, std::size_t layers,
                      const NearRow* near_rows, const Factors& by, std::int32_t enough,
                      Around* around) {
  const Factors factors = by;
  const std::size_t rows = reaches.size();
  for (std::uint32_t row = 0; row < layers * rows; ++row) {
    const Reach reach = reaches[row % rows];
    for (std::size_t column = 0; reach.begin < reach.end && column < kWidth; column += kLanes) {
      const std::size_t at = row * kWidth + column;
      findNeighbors(*around, row * kSpan + kHalo + column, row, reach, near_rows, factors, enough,
                    &around->surely[at], &around->possibly[at]);
    }
  }
}

/// Which points of a stripe's rows found too few. Returns whether some are in doubt.
SMOKE_GROUND_MULTIVERSION
bool findLonely(const Around& around, std::size_t begin, std::size_t end, std::int32_t enough,
                std::int8_t* is_lonely) {
  Ints all = {};
  for (std::size_t at = begin; at < end; at += kLanes) {
    Ints surely, possibly;
    std::memcpy(&surely, &around.surely[at], sizeof(surely));
    std::memcpy(&possibly, &around.possibly[at], sizeof(possibly));
    const Bytes lonely = bytesOf(surely < enough);
    std::memcpy(is_lonely + at - begin, &lonely, sizeof(lonely));
    all |= (surely < enough) & (possibly >= enough);
  }
  return !isNone(all);
}

/// An extra of the raster in or beside a stripe.
struct Aside {
  std::array<float, 3> at;
  std::uint32_t point;
  std::uint32_t row;
  std::size_t column;  // of kSpan

  bool isInStripe() const { return column >= kHalo && column < kHalo + kWidth; }
};

SMOKE_GROUND_PART Balls ballAround(const Aside& aside, const Factors& factors) {
  const Floats none = {};
  return ballsAround(none + aside.at[0], none + aside.at[1], none + aside.at[2], factors);
}

/// Counts an extra for the points of the stripe in one of its rows.
SMOKE_GROUND_MULTIVERSION
void countAside(const Aside& aside, std::size_t row, const Factors& factors, Around* around) {
  const Floats none = {};
  for (std::size_t column = 0; column < kWidth; column += kLanes) {
    const std::size_t at = row * kSpan + kHalo + column;
    Found found;
    std::memcpy(&found.surely, &around->surely[row * kWidth + column], sizeof(found.surely));
    std::memcpy(&found.possibly, &around->possibly[row * kWidth + column], sizeof(found.surely));
    found.look(ballsAround(loadLanes(&around->x[at]), loadLanes(&around->y[at]),
                           loadLanes(&around->z[at]), factors),
               none + aside.at[0], none + aside.at[1], none + aside.at[2]);
    std::memcpy(&around->surely[row * kWidth + column], &found.surely, sizeof(found.surely));
    std::memcpy(&around->possibly[row * kWidth + column], &found.possibly, sizeof(found.surely));
  }
}

class RasterCrowds {
 public:
  RasterCrowds(const Scan& scan, const ScanRaster& raster, const Crowd& crowd)
      : scan_(scan),
        raster_(raster),
        crowd_(crowd),
        factors_(crowd.radius_per_range),
        layers_(raster.has_second ? 2 : 1),
        is_lonely_(raster.x.size()) {}

  /// \return false where points are too near for single precision, or reaches too wide.
  bool findReaches() {
    Recycled<Span> spans;
    if (!measureRows(&spans)) return false;
    const double angle = std::asin(crowd_.radius_per_range) + kAngleMargin;
    reaches_.assign(raster_.rows, Reach());
    for (std::size_t row = 0; row < raster_.rows; ++row) {
      if (!spans[row].isEmpty() && !findReach(row, angle, spans)) return false;
    }
    return near_rows_.size() <= kMostCandidates / 8 * raster_.rows;
  }

  void findOutsiders(std::vector<std::uint8_t>* is_outside) {
    Around around(layers_ * raster_.rows);
    Recycled<std::uint32_t> outside_aside;
    is_lonely_[raster_.nowhere()] = 0;
    for (std::size_t stripe = 0; stripe < raster_.stripes; ++stripe) {
      takeStripe(stripe, &around);
      takeAsides(stripe);
      findAllNeighbors(reaches_, layers_, near_rows_.data(), factors_, enough(), &around);
      for (const Aside& aside : asides_) countForOthers(aside, &around);
      answer(stripe, around);
      for (const Aside& aside : asides_) {
        if (aside.isInStripe() && isOutside(aside.at, aside.row, around)) {
          outside_aside.push_back(aside.point);
        }
      }
    }
    is_outside->resize(scan_.size());
    const std::uint32_t* const place = raster_.place.data();
    const std::int8_t* const is_lonely = is_lonely_.data();
    std::uint8_t* const flag = is_outside->data();
    for (std::size_t i = 0, size = scan_.size(); i < size; ++i) {
      flag[i] = static_cast<std::uint8_t>(is_lonely[place[i]] & 1);  // no branches
    }
    for (const std::uint32_t point : outside_aside) flag[point] = 1;
  }

 private:
  /// Of neighbours, and the point itself.
  std::int32_t enough() const { return static_cast<std::int32_t>(crowd_.more_than) + 2; }

  /// Where a row of all layers begins in the raster.
  std::size_t placeOf(std::size_t stripe, std::size_t row) const {
    const std::size_t size = raster_.rows * kWidth;
    const bool is_first = row < raster_.rows;
    return stripe * size + (is_first ? row * kWidth : raster_.secondOf(row * kWidth - size));
  }

  bool measureRows(std::vector<Span>* spans) const {
    Recycled<Sines> sines(raster_.rows);
    for (Sines& row : sines) {
      row.lowest.fill(INFINITY);
      row.highest.fill(-INFINITY);
    }
    float nearest = INFINITY;
    for (std::size_t stripe = 0; stripe < raster_.stripes; ++stripe) {
      for (std::size_t layer = 0; layer < layers_; ++layer) {
        const std::size_t at = placeOf(stripe, layer * raster_.rows);
        nearest = std::min(nearest, takeSines(&raster_.x[at], &raster_.y[at], &raster_.z[at],
                                              raster_.rows, sines.data()));
      }
    }
    for (const ScanRaster::Extra& extra : raster_.extras) {
      const auto [x, y, z] = scan_.point(extra.point);
      const float square = squaredRangeOf(x, y, z);
      Sines& row = sines[raster_.rowOf(extra.place)];
      row.lowest[0] = std::min(row.lowest[0], z * std::fabs(z) / square);
      row.highest[0] = std::max(row.highest[0], z * std::fabs(z) / square);
      nearest = std::min(nearest, square);
    }
    spans->clear();
    for (const Sines& row : sines) {
      const float lowest = *std::min_element(row.lowest.begin(), row.lowest.end());
      const float highest = *std::max_element(row.highest.begin(), row.highest.end());
      spans->push_back(lowest > highest ? Span()
                                        : Span{elevationOf(lowest, -kSineMargin),
                                               elevationOf(highest, kSineMargin)});
    }
    return nearest * factors_.surely >= static_cast<float>(kLeastScreened);
  }

  /// The rows near one, the nearest first.
  bool findReach(std::size_t row, double angle, const std::vector<Span>& spans) {
    if (spans[row].steepest() + angle >= kUpright - 1e-3) return false;
    using Near = std::pair<double, std::uint32_t>;
    Recycled<Near> near;
    for (std::uint32_t other = 0; other < raster_.rows; ++other) {
      const double distance = spans[row].distanceTo(spans[other]);
      if (distance <= angle) near.push_back({other == row ? -INFINITY : distance, other});
    }
    std::sort(near.begin(), near.end());
    reaches_[row].begin = static_cast<std::uint32_t>(near_rows_.size());
    for (const auto& [distance, other] : near) {
      const double azimuth = azimuthBetween(spans[row], spans[other], angle) + kAngleMargin;
      const double columns = azimuth / kTwoPi * static_cast<double>(raster_.columns) + 1.0;
      if (columns >= kHalo + 1.0) return false;
      for (std::size_t first = 0; first < layers_ * raster_.rows; first += raster_.rows) {
        near_rows_.push_back(
            {other + static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(columns)});
      }
    }
    reaches_[row].end = static_cast<std::uint32_t>(near_rows_.size());
    return true;
  }

  void takeStripe(std::size_t stripe, Around* around) const {
    const bool is_inside = stripe > 0 && stripe * kWidth + kWidth + kHalo <= raster_.columns;
    if (!is_inside) return takeColumns(stripe, around);
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      const std::size_t first_row = layer * raster_.rows;
      const std::size_t from = placeOf(stripe, first_row);
      const std::size_t to = first_row * kSpan;
      takeRows(&raster_.x[from], raster_.rows, &around->x[to]);
      takeRows(&raster_.y[from], raster_.rows, &around->y[to]);
      takeRows(&raster_.z[from], raster_.rows, &around->z[to]);
    }
  }

  /// The same across +x.
  void takeColumns(std::size_t stripe, Around* around) const {
    std::array<std::size_t, kSpan> from;  // in row 0
    for (std::size_t k = 0; k < kSpan; ++k) {
      const std::size_t column = (stripe * kWidth + k + raster_.columns - kHalo) % raster_.columns;
      from[k] = placeOf(column / kWidth, 0) + column % kWidth;
    }
    for (std::size_t row = 0; row < layers_ * raster_.rows; ++row) {
      const std::size_t in_row = placeOf(0, row);
      for (std::size_t k = 0; k < kSpan; ++k) {
        around->x[row * kSpan + k] = raster_.x[in_row + from[k]];
        around->y[row * kSpan + k] = raster_.y[in_row + from[k]];
        around->z[row * kSpan + k] = raster_.z[in_row + from[k]];
      }
    }
  }

  /// The extras in and beside a stripe, which may be those of five.
  void takeAsides(std::size_t stripe) {
    asides_.clear();
    if (raster_.extras.empty()) return;
    const std::size_t size = raster_.rows * kWidth;
    const auto is_before = [](const ScanRaster::Extra& extra, std::size_t place) {
      return extra.place < place;
    };
    for (std::size_t from = stripe + raster_.stripes - 2; from <= stripe + raster_.stripes + 2;
         ++from) {
      const std::size_t begin = from % raster_.stripes * size;
      for (auto extra =
               std::lower_bound(raster_.extras.begin(), raster_.extras.end(), begin, is_before);
           extra != raster_.extras.end() && extra->place < begin + size; ++extra) {
        const std::size_t column = from % raster_.stripes * kWidth + extra->place % kWidth;
        const std::size_t here =
            (column + raster_.columns + kHalo - stripe * kWidth) % raster_.columns;
        if (here >= kSpan) continue;
        asides_.push_back({scan_.point(extra->point), extra->point,
                           static_cast<std::uint32_t>(raster_.rowOf(extra->place)), here});
      }
    }
  }

  void countForOthers(const Aside& aside, Around* around) const {
    const Reach& reach = reaches_[aside.row];
    for (std::uint32_t k = reach.begin; k < reach.end; ++k) {
      countAside(aside, near_rows_[k].row, factors_, around);
    }
  }

  void answer(std::size_t stripe, const Around& around) {
    const std::size_t size = raster_.rows * kWidth;
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      std::int8_t* const is_lonely = &is_lonely_[placeOf(stripe, layer * raster_.rows)];
      const bool is_doubt =
          findLonely(around, layer * size, (layer + 1) * size, enough(), is_lonely);
      for (std::size_t at = 0; is_doubt && at < size; ++at) {
        const std::size_t k = layer * size + at;
        if (around.surely[k] >= enough() || around.possibly[k] < enough()) continue;
        const std::size_t here = k / kWidth * kSpan + kHalo + k % kWidth;
        is_lonely[at] =
            isOutside({around.x[here], around.y[here], around.z[here]}, at / kWidth, around) ? 1
                                                                                             : 0;
      }
    }
  }

  /// Decides by the predicate alone.
  /// \param row  of the ring.
  bool isOutside(const std::array<float, 3>& p, std::size_t row, const Around& around) const {
    const double radius = crowd_.radius_per_range * range(p[0], p[1], p[2]);
    std::size_t found = 0;
    const auto count = [&](float x, float y, float z) {
      found += squaredDistance(x, y, z, p[0], p[1], p[2]) < radius * radius ? 1 : 0;
    };
    for (std::uint32_t k = reaches_[row].begin; k < reaches_[row].end; ++k) {
      const std::size_t first = near_rows_[k].row * kSpan;
      for (std::size_t at = first; at < first + kSpan; ++at) {
        count(around.x[at], around.y[at], around.z[at]);
      }
    }
    for (const Aside& aside : asides_) count(aside.at[0], aside.at[1], aside.at[2]);
    return found < crowd_.more_than + 2;  // a point finds itself, too
  }

  const Scan& scan_;
  const ScanRaster& raster_;
  const Crowd crowd_;
  const Factors factors_;
  const std::size_t layers_;
  Recycled<Reach> reaches_;  // by row
  Recycled<NearRow> near_rows_;
  Recycled<std::int8_t> is_lonely_;  // by place
  Recycled<Aside> asides_;           // in and beside a stripe
};

}  // namespace

bool mayFindOutsiders(const Crowd& crowd, std::size_t columns) {
  if (crowd.more_than > kLargestCrowd || crowd.at_most + 1 != 0) return false;
  if (columns < kFewestColumns || crowd.radius_per_range >= 1.0) return false;
  const double angle = std::asin(crowd.radius_per_range) + 2.0 * kAngleMargin;
  return angle / kTwoPi * static_cast<double>(columns) < static_cast<double>(kHalo);
}

bool findOutsiders(const Scan& scan, const ScanRaster& raster, const Crowd& crowd,
                   std::vector<std::uint8_t>* is_outside) {
  RasterCrowds crowds(scan, raster, crowd);
  if (!crowds.findReaches()) return false;
  crowds.findOutsiders(is_outside);
  return true;
}

}  // namespace smoke_ground_reconstruction
