#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace smoke_ground_reconstruction {

/// A vector in memory that an earlier one of this thread has left behind: one scan after another
/// needs the same memory, and fetching it anew from the system costs as much as filling it. Each
/// thread keeps as many as it ever needed at once.
template <typename T>
class Recycled : public std::vector<T> {
 public:
  Recycled() : std::vector<T>(taken()) { this->clear(); }
  /// Elements of whatever value, to be overwritten.
  explicit Recycled(std::size_t size) : std::vector<T>(taken()) { this->resize(size); }
  Recycled(const Recycled& other) : Recycled() { this->assign(other.begin(), other.end()); }
  Recycled(Recycled&& other) noexcept = default;
  Recycled& operator=(const Recycled& other) = default;
  Recycled& operator=(Recycled&& other) noexcept = default;
  ~Recycled() {
    if (this->capacity() > 0) left().push_back(std::move(*this));
  }

 private:
  static std::vector<std::vector<T>>& left() {
    static thread_local std::vector<std::vector<T>> vectors;
    return vectors;
  }
  static std::vector<T> taken() {
    if (left().empty()) return {};
    std::vector<T> last = std::move(left().back());
    left().pop_back();
    return last;
  }
};

}  // namespace smoke_ground_reconstruction
