#pragma once

#include <atomic>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>
#include <cstddef>
#include <vector>

namespace smoke_ground_reconstruction {

/// Messages to publish, in the memory of those that nobody holds any more: fetching a cloud's
/// memory anew and clearing it costs as much as filling it. Not for several threads at once; the
/// messages may be let go on any thread.
template <typename Message>
class MessagePool {
 public:
  using Pointer = boost::shared_ptr<Message>;

  /// A message that the caller alone holds, of whatever content. As long as anybody keeps it, it
  /// is not handed out again.
  Pointer take() {
    for (const auto& message : messages_) {
      if (isIdle(message)) return message;
    }
    const auto fresh = boost::make_shared<Message>();
    if (messages_.size() < kMost) messages_.push_back(fresh);
    return fresh;
  }

 private:
  static bool isIdle(const Pointer& message) {
    if (message.use_count() != 1) return false;
    std::atomic_thread_fence(std::memory_order_acquire);  // after the last look of another thread
    return true;
  }

  // More in flight than this come from who keeps scans, or falls behind, and go with him.
  static constexpr std::size_t kMost = 8;

  std::vector<Pointer> messages_;
};

}  // namespace smoke_ground_reconstruction
