#include "smoke_ground_reconstruction/confidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

/// 1 at the end and past it, falling to 0 at `reach` [m] before it.
double hinge(double margin, double reach) {
  return std::max(0.0, 1.0 - std::max(0.0, margin) / reach);
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
  columns_.clear();
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    columns_.push_back(describe(room, limit[c], c, unknown));
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
  column.drawn = w[kDrawn] + w[kNearDropDrawn] * near_drop_[c];
  column.drop_begin = room.drops().begin[c];
  column.end = std::min(limit, column.drop_begin);
  column.seen = seen_[c];
  column.posts = post_[c];
  column.rim_100 = w[kRim100] + w[kRim100Inferred] * inferred + w[kNoPostRim100] * no_post;
  column.rim_500 = w[kRim500] + w[kRim500Inferred] * inferred + w[kBridgeRim500] * bridge_[c];
  column.limit_rim = w[kRim300Limit] * open;
  column.past_post = w[kPastPostWall] * wall + w[kPastPostBridge] * inferred;
  column.beyond = w[kNearDropBeyond] * near_drop_[c];
  column.beyond_drawn = w[kBeyond];
  return column;
}

float FloorConfidence::of(std::size_t column, double planar, bool is_drawn) const {
  const Column& at = columns_[column];
  const auto& w = kWeights;
  const double margin = at.end - planar, rim_100 = hinge(margin, 0.1);
  const double beyond = std::min(std::max(0.0, planar - at.seen), kFarthestBeyond);
  const double far = std::min(planar, kFarthestPlanar) / kFarthestPlanar;
  double logit = at.constant + w[kRim20] * hinge(margin, 0.02) + at.rim_100 * rim_100 +
                 at.rim_500 * hinge(margin, 0.5) + w[kRim2000] * hinge(margin, 2.0) +
                 at.limit_rim * hinge(margin, 0.3) + at.beyond * beyond +
                 w[kDropRim100] * hinge(at.drop_begin - planar, 0.1) + w[kFar] * far +
                 w[kFarRim100] * far * rim_100;
  if (!std::isnan(at.posts)) {
    const double past = std::clamp((planar - at.posts + kPostHalf) / (2.0 * kPostHalf), 0.0, 1.0);
    logit += past * (at.past_post + w[kPastPostRim100] * rim_100);
  }
  if (is_drawn) {
    logit += at.drawn + at.beyond_drawn * beyond;
  }
  return static_cast<float>(1.0 / (1.0 + std::exp(-logit)));
}

void FloorConfidence::findSeen(const Room& room, const std::vector<std::uint32_t>& measured) {
  farthest_.clear(room.profile().columns());
  for (const std::uint32_t i : measured) farthest_.add(room.column(i), room.planar(i));
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
      const double own = own_post_[(c + columns + k - kPostColumns) % columns];
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
