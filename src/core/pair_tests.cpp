#include "pair_tests.hpp"

namespace smoke_ground_reconstruction {

namespace {

double leastRangeStep(RangeStepRule rule, double min_range_step) {
  if (rule == RangeStepRule::kMinimum) return min_range_step;
  return rule == RangeStepRule::kAny ? -kUnlimited : std::numeric_limits<double>::denorm_min();
}

PairTest groundTest(const ChannelSegmentationParams& p) {
  return {AngleWindow::fromDegrees(p.min_ground_angle_deg, p.max_ground_angle_deg),
          p.max_ground_step_height == 0.0 ? kUnlimited : p.max_ground_step_height,
          leastRangeStep(p.ground_range_step, p.min_range_step),
          p.ground_relative_margin ? p.relative_distance_margin : kUnlimited};
}

PairTest wallTest(const ChannelSegmentationParams& p) {
  return {AngleWindow::fromDegrees(p.min_wall_angle_deg, p.max_wall_angle_deg),
          p.max_wall_step_height == 0.0 ? kUnlimited : p.max_wall_step_height,
          leastRangeStep(p.wall_range_step, p.min_range_step),
          p.wall_relative_margin ? p.relative_distance_margin : kUnlimited};
}

}  // namespace

PairTests::PairTests(const ChannelSegmentationParams& params)
    : ground(groundTest(params)), wall(wallTest(params)) {}

}  // namespace smoke_ground_reconstruction
