#include "smoke_ground_reconstruction/raster_crowds.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "azimuth.hpp"
#include "near_rows.hpp"
#include "smoke_ground_reconstruction/predicates.hpp"
#include "stripe_neighbors.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kWidth = ScanRaster::kWidth;
constexpr std::size_t kFewestColumns = 8 * kWidth;
constexpr std::size_t kLargestCrowd = 32;

class RasterCrowds {
 public:
  RasterCrowds(const Scan& scan, const ScanRaster& raster, const NearRows& near_rows,
               const Crowd& crowd)
      : scan_(scan),
        raster_(raster),
        near_rows_(near_rows),
        crowd_(crowd),
        factors_(crowd.radius_per_range),
        layers_(raster.has_second ? 2 : 1),
        is_lonely_(raster.x.size()) {}

  void findOutsiders(std::vector<std::uint8_t>* is_outside) {
    Around around(layers_ * raster_.rows);
    Recycled<std::uint32_t> outside_aside;
    is_lonely_[raster_.nowhere()] = 0;
    for (std::size_t stripe = 0; stripe < raster_.stripes; ++stripe) {
      takeStripe(stripe, &around);
      takeAsides(stripe);
      findAllNeighbors(near_rows_.reaches(), layers_, near_rows_.rows(), factors_, enough(),
                       &around);
      for (const Aside& aside : asides_) countForOthers(aside, &around);
      answer(stripe, around);
      for (const Aside& aside : asides_) {
        if (aside.isInStripe() && isOutside(aside.at, aside.row, around)) {
          outside_aside.push_back(aside.point);
        }
      }
    }
    flag(outside_aside, is_outside);
  }

 private:
  void flag(const std::vector<std::uint32_t>& outside_aside,
            std::vector<std::uint8_t>* is_outside) const {
    is_outside->resize(scan_.size());
    const std::uint32_t* const place = raster_.place.data();
    const std::int8_t* const is_lonely = is_lonely_.data();
    std::uint8_t* const flags = is_outside->data();
    for (std::size_t i = 0, size = scan_.size(); i < size; ++i) {
      flags[i] = static_cast<std::uint8_t>(is_lonely[place[i]] & 1);  // no branches
    }
    for (const std::uint32_t point : outside_aside) flags[point] = 1;
  }

  /// Of neighbours, and the point itself.
  std::int32_t enough() const { return static_cast<std::int32_t>(crowd_.more_than) + 2; }

  /// Where a row of all layers begins in the raster.
  std::size_t placeOf(std::size_t stripe, std::size_t row) const {
    const std::size_t size = raster_.rows * kWidth;
    const bool is_first = row < raster_.rows;
    return stripe * size + (is_first ? row * kWidth : raster_.secondOf(row * kWidth - size));
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
    const RowReach& reach = near_rows_.reaches()[aside.row];
    for (std::uint32_t k = reach.begin; k < reach.end; ++k) {
      countAside(aside, near_rows_.rows()[k].row, factors_, around);
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
    for (std::uint32_t k = near_rows_.reaches()[row].begin; k < near_rows_.reaches()[row].end;
         ++k) {
      const std::size_t first = near_rows_.rows()[k].row * kSpan;
      for (std::size_t at = first; at < first + kSpan; ++at) {
        count(around.x[at], around.y[at], around.z[at]);
      }
    }
    for (const Aside& aside : asides_) count(aside.at[0], aside.at[1], aside.at[2]);
    return found < crowd_.more_than + 2;  // a point finds itself, too
  }

  const Scan& scan_;
  const ScanRaster& raster_;
  const NearRows& near_rows_;
  const Crowd crowd_;
  const ScreenFactors factors_;
  const std::size_t layers_;
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
  NearRows near_rows;
  if (!near_rows.find(scan, raster, crowd.radius_per_range)) return false;
  RasterCrowds(scan, raster, near_rows, crowd).findOutsiders(is_outside);
  return true;
}

}  // namespace smoke_ground_reconstruction
