#include "smoke_ground_reconstruction/confidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "multiversion.hpp"

namespace smoke_ground_reconstruction {
namespace {

/// In the order of config/confidence.yaml; what they mean stands in the reference.
enum Feature : std::size_t {
  kConstant,
  kDrawn,
  kPost,
  kInferred,
  kLimit,
  kRim20,
  kRim100,
  kRim500,
  kRim2000,
  kRim100Inferred,
  kRim500Inferred,
  kRim300Limit,
  kBridge,
  kBridgeRim500,
  kNoPost,
  kNoPostRim100,
  kPostsOffWall,
  kPostsOffBridge,
  kPastPostWall,
  kPastPostBridge,
  kPastPostRim100,
  kBeyond,
  kDrop,
  kNearDrop,
  kNearDropDrawn,
  kNearDropBeyond,
  kDropRim100,
  kUnknown,
  kUnknownInferred,
  kFar,
  kFarRim100,
  kFeatures
};

constexpr double kWeights[] = {
#include "confidence_weights.inc"
};
static_assert(std::size(kWeights) == kFeatures, "config/confidence.yaml has other features");

constexpr double kLongBridge = 100.0;  // columns
constexpr int kNearDropColumns = 25;
constexpr double kFarthestPlanar = 8.0;  // [m]
constexpr double kFarthestBeyond = 2.0;  // beyond the farthest measured floor of the column [m]
constexpr double kPostHalf = 0.03;       // posts tell where a wall is to about so much [m]
constexpr double kPostsOff = 0.2;        // [m]
constexpr std::size_t kPostColumns = 2;  // to either side whose posts count
constexpr std::uint32_t kPostReturns = 6;
constexpr double kNoPostThere = std::numeric_limits<double>::quiet_NaN();

double notNegative(double value) { return value > 0.0 ? value : 0.0; }
double atMost(double value, double most) { return value < most ? value : most; }

/// 1 at the end and past it, falling to 0 at `reach` [m] before it.
double hinge(double margin, double reach) {
  return notNegative(1.0 - notNegative(margin) * (1.0 / reach));
}

/// 1 / (1 + exp(-logit)) to 2e-7: loops vectorize. The exponent is split off in powers of two; of
/// what is left Taylor's series is exact enough.
float logistic(float logit) {
  const float inside = logit > 80.0F ? 80.0F : (logit > -80.0F ? logit : -80.0F);
  const float powers = -inside * 1.44269504F;
  const auto whole = static_cast<std::int32_t>(powers + (powers < 0.0F ? -0.5F : 0.5F));
  const float rest = (powers - static_cast<float>(whole)) * 0.693147181F;
  const float series =
      1.0F +
      rest *
          (1.0F +
           rest * (0.5F + rest * (1.0F / 6 +
                                  rest * (1.0F / 24 + rest * (1.0F / 120 + rest * (1.0F / 720))))));
  const std::int32_t bits = (whole + 127) << 23;
  float power = 0.0F;
  std::memcpy(&power, &bits, sizeof(power));
  return 1.0F / (1.0F + series * power);
}

}  // namespace

void FloorConfidence::look(const Room& room, const std::vector<double>& limit,
                           const std::vector<std::uint32_t>& measured) {
  const auto& kinds = room.profile().kind;
  findSeen(room, measured);
  findPosts(room);
  findBridges(room.profile());
  findDrops(room.drops());
  const auto seen = std::count(kinds.begin(), kinds.end(), BoundaryKind::kWallSeen);
  const double unknown = 1.0 - static_cast<double>(seen) / static_cast<double>(kinds.size());
  measured_.resize(kinds.size());
  drawn_.resize(kinds.size());
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    const Column column = describe(room, limit[c], c, unknown);
    measured_.set(c, column);
    drawn_.set(c, ofDrawn(column, c));
  }
}

FloorConfidence::Column FloorConfidence::describe(const Room& room, double limit, std::size_t c,
                                                  double unknown) const {
  const Profile& profile = room.profile();
  const double inferred = profile.kind[c] == BoundaryKind::kWallInferred ? 1.0 : 0.0;
  const double open = profile.kind[c] == BoundaryKind::kLimitOfKnowledge ? 1.0 : 0.0;
  const double wall = 1.0 - inferred - open;
  const double post = profile.line[c] < 0 ? wall : 0.0;
  const bool has_post = !std::isnan(post_[c]);
  const double no_post = has_post ? 0.0 : wall;
  const double off =
      has_post ? std::clamp((profile.distance[c] - post_[c]) / kPostsOff, 0.0, 1.0) : 0.0;
  const auto& w = kWeights;
  Column column;
  column.constant = w[kConstant] + w[kPost] * post + w[kInferred] * inferred + w[kLimit] * open +
                    w[kBridge] * bridge_[c] + w[kNoPost] * no_post + w[kPostsOffWall] * off * wall +
                    w[kPostsOffBridge] * off * inferred + w[kDrop] * (has_drop_ ? 1.0 : 0.0) +
                    w[kNearDrop] * near_drop_[c] + w[kUnknown] * unknown +
                    w[kUnknownInferred] * unknown * inferred;
  column.drop_begin = room.drops().begin[c];
  column.end = std::min(limit, column.drop_begin);
  column.seen = seen_[c];
  column.posts = has_post ? post_[c] : std::numeric_limits<double>::infinity();
  column.rim_100 = w[kRim100] + w[kRim100Inferred] * inferred + w[kNoPostRim100] * no_post;
  column.rim_500 = w[kRim500] + w[kRim500Inferred] * inferred + w[kBridgeRim500] * bridge_[c];
  column.limit_rim = w[kRim300Limit] * open;
  column.past_post = w[kPastPostWall] * wall + w[kPastPostBridge] * inferred;
  column.beyond = w[kNearDropBeyond] * near_drop_[c];
  return column;
}

FloorConfidence::Column FloorConfidence::ofDrawn(const Column& measured, std::size_t c) const {
  Column column = measured;
  column.constant += kWeights[kDrawn] + kWeights[kNearDropDrawn] * near_drop_[c];
  column.beyond += kWeights[kBeyond];
  return column;
}

void FloorConfidence::measured(const std::uint16_t* column, const double* planar, std::size_t size,
                               float* confidence) const {
  tell(measured_, column, planar, size, confidence);
}

void FloorConfidence::drawn(const std::uint16_t* column, const double* planar, std::size_t size,
                            float* confidence) const {
  tell(drawn_, column, planar, size, confidence);
}

void FloorConfidence::Columns::resize(std::size_t count) {
  all.resize(count);
  for (auto* values : {&constant, &end, &plain}) values->resize(count);
}

void FloorConfidence::Columns::set(std::size_t c, const Column& column) {
  constexpr double kRim = 0.51, kPost = kPostHalf + 1e-3, kDropRim = 0.11;  // no hinge goes farther
  all[c] = column;
  constant[c] = column.constant;
  end[c] = column.end;
  plain[c] = std::min(
      {column.end - kRim, column.seen, column.posts - kPost, column.drop_begin - kDropRim});
}

SMOKE_GROUND_PART double FloorConfidence::Column::logit(double range) const {
  const double margin = end - range;
  const double near_end = hinge(margin, 0.1);
  const double past_seen = atMost(notNegative(range - seen), kFarthestBeyond);
  const double far = atMost(range, kFarthestPlanar) / kFarthestPlanar;
  const double past_share = (range - posts + kPostHalf) / (2.0 * kPostHalf);
  const double past = atMost(notNegative(past_share), 1.0);
  const double rims = (kWeights[kRim20] * hinge(margin, 0.02) + rim_100 * near_end) +
                      (rim_500 * hinge(margin, 0.5) + kWeights[kRim2000] * hinge(margin, 2.0)) +
                      limit_rim * hinge(margin, 0.3);
  return constant + rims + beyond * past_seen +
         kWeights[kDropRim100] * hinge(drop_begin - range, 0.1) +
         far * (kWeights[kFar] + kWeights[kFarRim100] * near_end) +
         past * (past_post + kWeights[kPastPostRim100] * near_end);
}

SMOKE_GROUND_MULTIVERSION
void FloorConfidence::tell(const Columns& columns, const std::uint16_t* column,
                           const double* planar, std::size_t size, float* confidence) {
  constexpr std::size_t kAtOnce = 32;  // points
  constexpr int kFew = 8;
  const double* const constant = columns.constant.data();
  const double* const end = columns.end.data();
  const double* const plain = columns.plain.data();
  const Column* const all = columns.all.data();
  for (std::size_t begin = 0; begin < size; begin += kAtOnce) {
    const std::size_t last = std::min(size, begin + kAtOnce);
    int others = 0;
    for (std::size_t i = begin; i < last; ++i) others += planar[i] < plain[column[i]] ? 0 : 1;
    if (others > kFew) {  // vectors of them are faster
      for (std::size_t i = begin; i < last; ++i) {
        confidence[i] = static_cast<float>(all[column[i]].logit(planar[i]));
      }
      continue;
    }
    // Far from all that ends a column only this much of the model is left.
    for (std::size_t i = begin; i < last; ++i) {
      const std::size_t c = column[i];
      const double far = atMost(planar[i], kFarthestPlanar) / kFarthestPlanar;
      const double rim = kWeights[kRim2000] * hinge(end[c] - planar[i], 2.0);
      confidence[i] = static_cast<float>((constant[c] + rim) + far * kWeights[kFar]);
    }
    for (std::size_t i = begin; others > 0 && i < last; ++i) {
      if (planar[i] < plain[column[i]]) continue;
      confidence[i] = static_cast<float>(all[column[i]].logit(planar[i]));
    }
  }
  for (std::size_t i = 0; i < size; ++i) confidence[i] = logistic(confidence[i]);
}

void FloorConfidence::findSeen(const Room& room, const std::vector<std::uint32_t>& measured) {
  farthest_.clear(room.profile().columns());
  farthest_.addAll(measured, room.returns(), [](std::uint32_t) { return true; });
  farthest_.find(2, &seen_);
}

/// Planar range of the outermost post of each column and those beside it, the lower median of the
/// columns that have one; NaN where none has.
void FloorConfidence::findPosts(const Room& room) {
  const std::size_t columns = room.profile().columns();
  const Posts& posts = room.posts();
  own_post_.assign(columns, 0.0);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    double& own = own_post_[posts.column[i]];
    if (posts.count[i] >= kPostReturns) own = std::max(own, posts.distance[i]);
  }
  post_.assign(columns, kNoPostThere);
  for (std::size_t c = 0; c < columns; ++c) {
    std::array<double, 2 * kPostColumns + 1> near;
    std::size_t count = 0;
    for (std::size_t k = 0; k <= 2 * kPostColumns; ++k) {
      const double own = own_post_[wrapped(c + columns + k - kPostColumns, columns)];
      if (own > 0.0) near[count++] = own;
    }
    if (count == 0) continue;
    const auto middle = near.begin() + (count - 1) / 2;
    std::nth_element(near.begin(), middle, near.begin() + count);
    post_[c] = *middle;
  }
}

/// Length of the bridge that each column lies in, of kLongBridge; 0 where it lies in none.
void FloorConfidence::findBridges(const Profile& profile) {
  const std::size_t columns = profile.columns();
  const auto is_bridge = [&profile, columns](std::size_t c) {
    return profile.kind[c % columns] == BoundaryKind::kWallInferred;
  };
  bridge_.assign(columns, 0.0);
  std::size_t first = 0;
  while (first < columns && is_bridge(first)) ++first;
  if (first == columns) {
    bridge_.assign(columns, std::min(static_cast<double>(columns), kLongBridge) / kLongBridge);
    return;
  }
  for (std::size_t begin = first; begin < first + columns;) {
    std::size_t end = begin;
    while (end < first + columns && is_bridge(end)) ++end;
    const double length = std::min(static_cast<double>(end - begin), kLongBridge) / kLongBridge;
    for (std::size_t c = begin; c < end; ++c) bridge_[c % columns] = length;
    begin = end + 1;
  }
}

/// 1 in the columns of a drop, 0 from kNearDropColumns beside them.
void FloorConfidence::findDrops(const DropOffs& drops) {
  const int columns = static_cast<int>(drops.begin.size());
  near_drop_.assign(drops.begin.size(), 0.0);
  has_drop_ = false;
  for (int c = 0; c < columns; ++c) {
    if (!std::isfinite(drops.begin[static_cast<std::size_t>(c)])) continue;
    has_drop_ = true;
    for (int k = -kNearDropColumns; k <= kNearDropColumns; ++k) {
      double& near = near_drop_[static_cast<std::size_t>((c + k + columns) % columns)];
      near = std::max(near, 1.0 - std::abs(k) / static_cast<double>(kNearDropColumns));
    }
  }
}

}  // namespace smoke_ground_reconstruction
