#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace smoke_ground_reconstruction {

/// Some of the entries of a list, evenly spread over it, for what a few thousand returns tell as
/// well as all: one of each `stride` in a row, which of them a hash of the row's number says. Rows
/// and rings thus never keep step, and the same list has the same sample in both engines. A list
/// of less than twice as many is taken whole. As in reference/sample.py.
class Sample {
 public:
  static constexpr std::size_t kFewest = 4000;  ///< entries, where the list has so many

  explicit Sample(std::size_t size, std::size_t fewest = kFewest)
      : stride_(std::max<std::size_t>(1, size / std::max<std::size_t>(1, fewest))),
        size_(size / stride_) {}

  std::size_t size() const { return size_; }
  /// Place in the list of an entry of the sample; ascending.
  std::size_t operator[](std::size_t k) const {
    if (stride_ == 1) return k;
    auto hash = static_cast<std::uint32_t>(k) * 0x9E3779B1U;
    hash = (hash ^ (hash >> 15)) * 0x85EBCA77U;
    hash ^= hash >> 13;
    return k * stride_ + static_cast<std::size_t>((std::uint64_t{hash} * stride_) >> 32);
  }

 private:
  std::size_t stride_, size_;
};

}  // namespace smoke_ground_reconstruction
