#pragma once

#include <utility>
#include <vector>

namespace smoke_ground_reconstruction {

/// An empty vector of working memory that an earlier one of this thread has left behind: one scan
/// after another needs the same memory, and fetching it anew from the system costs as much as
/// filling it. Each thread keeps as many as it ever needed at once.
template <typename T>
class Recycled : public std::vector<T> {
 public:
  Recycled() : std::vector<T>(taken()) { this->clear(); }
  ~Recycled() { left().push_back(std::move(*this)); }
  Recycled(const Recycled&) = delete;
  Recycled& operator=(const Recycled&) = delete;

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
