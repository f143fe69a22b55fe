#include "cell_numbers.hpp"

#include <algorithm>
#include <cmath>

#include "multiversion.hpp"
#include "ordered.hpp"

namespace smoke_ground_reconstruction {

namespace {

constexpr std::size_t kBlock = 64;
constexpr float kFarthest = 1e6F;        // cells
constexpr float kQuotientError = 2e-7F;  // relative, of the guess; 1.2e-7 by its two roundings

/// Single precision tells the numbers of places clear of the cells' edges. Are all of them?
SMOKE_GROUND_MULTIVERSION
bool guessNumbers(const float* values, std::size_t count, float per_unit, std::int32_t* numbers) {
  int are_sure = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const float quotient = values[i] * per_unit;
    const float size = std::fabs(quotient);
    const float inside = size < kFarthest ? quotient : 0.0F;  // doubtful; also of no number
    const auto whole = static_cast<std::int32_t>(inside);
    const std::int32_t number = whole - (inside < static_cast<float>(whole) ? 1 : 0);
    const float part = inside - static_cast<float>(number);
    const float margin = kQuotientError * (std::fabs(inside) + 1.0F);
    are_sure &= (part > margin ? 1 : 0) & (part < 1.0F - margin ? 1 : 0);
    numbers[i] = number;
  }
  return are_sure != 0;
}

SMOKE_GROUND_MULTIVERSION
void tellNumbers(const float* values, std::size_t count, double size, std::int32_t* numbers) {
  constexpr double kMost = kFarthest;
  for (std::size_t i = 0; i < count; ++i) {
    const double quotient = static_cast<double>(values[i]) / size;
    const double above = quotient > -kMost ? quotient : -kMost;
    numbers[i] = floorToInt(quotient < kMost ? above : kMost);
  }
}

}  // namespace

void cellNumbers(const float* values, std::size_t count, double size, std::int32_t* numbers) {
  const auto per_unit = static_cast<float>(1.0 / size);
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(count, begin + kBlock);
    if (guessNumbers(values + begin, end - begin, per_unit, numbers + begin)) continue;
    tellNumbers(values + begin, end - begin, size, numbers + begin);
  }
}

}  // namespace smoke_ground_reconstruction
