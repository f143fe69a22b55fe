#include "smoke_ground_reconstruction/confidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "lanes.hpp"
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
constexpr std::size_t kSeenColumns = 2;  // to either side whose floor counts
constexpr std::size_t kPostColumns = 2;  // to either side whose posts count
constexpr std::uint32_t kPostReturns = 6;
constexpr double kNoPostThere = std::numeric_limits<double>::quiet_NaN();

double notNegative(double value) { return value > 0.0 ? value : 0.0; }
double atMost(double value, double most) { return value < most ? value : most; }

/// 1 at the end and past it, falling to 0 at `reach` [m] before it.
double hinge(double margin, double reach) {
  return notNegative(1.0 - notNegative(margin) * (1.0 / reach));
}

/// Into values in ascending order.
void insert(double value, double* values, std::size_t count) {
  std::size_t at = count;
  for (; at > 0 && values[at - 1] > value; --at) values[at] = values[at - 1];
  values[at] = value;
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

/// Points worked on together.
struct FloorConfidence::Block {
  static constexpr std::size_t kMost = 256;

  std::array<float, kMost> logit;
  // Of those near to what ends their column.
  std::array<std::uint32_t, kMost> rim, column;
  std::array<float, kMost> planar, whole;
};

void FloorConfidence::look(const Room& room, const std::vector<double>& limit) {
  const auto& kinds = room.profile().kind;
  greatestBeside(room.ownFloor(), kSeenColumns, &seen_);
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

void FloorConfidence::measured(const std::uint16_t* column, const float* planar, std::size_t size,
                               float* confidence) const {
  tell(measured_, column, planar, size, confidence);
}

void FloorConfidence::drawn(const std::uint16_t* column, const float* planar, std::size_t size,
                            float* confidence) const {
  tell(drawn_, column, planar, size, confidence);
}

void FloorConfidence::Columns::resize(std::size_t count) {
  all.resize(count);
  plain.resize(count);
  beyond.resize(count);
  any_beyond = false;
}

void FloorConfidence::Columns::set(std::size_t c, const Column& column) {
  constexpr double kRim = 0.11, kLimitRim = 0.31, kPost = kPostHalf + 1e-3;  // hinges end before
  all[c] = column;
  const double before_end = column.end - (column.limit_rim == 0.0 ? kRim : kLimitRim);
  const double before = std::min({before_end, column.posts - kPost, column.drop_begin - kRim});
  plain[c] = {static_cast<float>(column.constant), static_cast<float>(column.end),
              static_cast<float>(column.rim_500), static_cast<float>(before)};
  beyond[c] = {static_cast<float>(column.seen), static_cast<float>(column.beyond)};
  any_beyond = any_beyond || column.beyond != 0.0;
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

/// What is left of the model far from all that ends a column, of one point or of four.
template <typename Numbers>
SMOKE_GROUND_PART Numbers FloorConfidence::plainLogit(const Numbers& constant, const Numbers& end,
                                                      const Numbers& rim_500,
                                                      const Numbers& range) {
  constexpr auto kFar8 = static_cast<float>(kWeights[kFar] / kFarthestPlanar);
  constexpr auto kRim = static_cast<float>(kWeights[kRim2000]);
  constexpr auto kFarthest = static_cast<float>(kFarthestPlanar);
  constexpr Numbers kZero = {};
  const Numbers margin = end - range;  // > 0
  const Numbers rest_500 = 1.0F - margin * 2.0F, rest_2000 = 1.0F - margin * 0.5F;
  const Numbers rims = rim_500 * (rest_500 > 0.0F ? rest_500 : kZero) +
                       kRim * (rest_2000 > 0.0F ? rest_2000 : kZero);
  return (constant + rims) + kFar8 * (range < kFarthest ? range : kZero + kFarthest);
}

/// The model of points far from all that ends their columns. Are all of them?
SMOKE_GROUND_PART bool FloorConfidence::tellPlain(const Plain* plain, const std::uint16_t* column,
                                                  const float* planar, std::size_t count,
                                                  float* logit) {
  FourInts is_near = {};
  std::size_t i = 0;
  for (; i + kFour <= count; i += kFour) {
    std::array<FourFloats, kFour> rows;
    for (std::size_t k = 0; k < kFour; ++k) {
      std::memcpy(&rows[k], &plain[column[i + k]], sizeof(rows[k]));
    }
    FourFloats range;
    std::memcpy(&range, planar + i, sizeof(range));
    const auto [constant, end, rim_500, before] = transposed(rows[0], rows[1], rows[2], rows[3]);
    const FourFloats four = plainLogit(constant, end, rim_500, range);
    std::memcpy(logit + i, &four, sizeof(four));
    is_near |= ~(range < before);
  }
  int is_any_near = isNone(is_near) ? 0 : 1;
  for (; i < count; ++i) {
    const Plain& of = plain[column[i]];
    logit[i] = plainLogit(of.constant, of.end, of.rim_500, planar[i]);
    is_any_near |= planar[i] < of.before ? 0 : 1;
  }
  return is_any_near == 0;
}

SMOKE_GROUND_MULTIVERSION
void FloorConfidence::tell(const Columns& columns, const std::uint16_t* column, const float* planar,
                           std::size_t size, float* confidence) {
  constexpr auto kFarthest = static_cast<float>(kFarthestBeyond);
  constexpr std::size_t kAtOnce = 16;
  const Plain* const plain = columns.plain.data();
  const Beyond* const beyond = columns.beyond.data();
  Block block;
  for (std::size_t begin = 0; begin < size; begin += Block::kMost) {
    const std::size_t count = std::min(Block::kMost, size - begin);
    const std::uint16_t* const of = column + begin;
    const float* const range = planar + begin;
    std::size_t rims = 0;
    for (std::size_t i = 0; i < count; i += kAtOnce) {
      const std::size_t end = std::min(count, i + kAtOnce);
      if (tellPlain(plain, of + i, range + i, end - i, &block.logit[i])) continue;
      for (std::size_t k = i; k < end; ++k) {
        block.rim[rims] = static_cast<std::uint32_t>(k);
        rims += range[k] < plain[of[k]].before ? 0U : 1U;
      }
    }
    for (std::size_t i = 0; i < count && columns.any_beyond; ++i) {
      const Beyond past = beyond[of[i]];
      const float away = range[i] - past.seen;
      const float least = away > 0.0F ? away : 0.0F;
      block.logit[i] += past.weight * (least < kFarthest ? least : kFarthest);
    }
    tellRims(columns, of, range, rims, &block);
    for (std::size_t i = 0; i < count; ++i) confidence[begin + i] = logistic(block.logit[i]);
  }
}

/// The whole model where points lie near to what ends their column.
SMOKE_GROUND_PART void FloorConfidence::tellRims(const Columns& columns,
                                                 const std::uint16_t* column, const float* planar,
                                                 std::size_t rims, Block* of) {
  const Column* const all = columns.all.data();
  Block& block = *of;
  for (std::size_t k = 0; k < rims; ++k) {
    const std::uint32_t i = block.rim[k];
    block.column[k] = column[i];
    block.planar[k] = planar[i];
  }
  for (std::size_t k = 0; k < rims; ++k) {
    block.whole[k] = static_cast<float>(all[block.column[k]].logit(block.planar[k]));
  }
  for (std::size_t k = 0; k < rims; ++k) block.logit[block.rim[k]] = block.whole[k];
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
      if (own > 0.0) insert(own, near.data(), count++);
    }
    if (count > 0) post_[c] = near[(count - 1) / 2];
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
