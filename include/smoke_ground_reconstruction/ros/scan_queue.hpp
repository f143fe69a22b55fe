#pragma once

#include <ros/callback_queue.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace smoke_ground_reconstruction {

/// The scans that come to a nodelet, to be worked on one at a time and in their order.
///
/// Each queue brings a thread, and the threads work for all queues of the process: stages work on
/// successive scans at the same time. What a stage adds to another queue, the thread that worked
/// for it takes up next: the scan goes from stage to stage as by a call, without the time that
/// waking a thread takes, and in warm caches. Any thread may call any method but end().
class ScanQueue : public ros::CallbackQueue {
 public:
  ScanQueue();
  ~ScanQueue() override;
  ScanQueue(const ScanQueue&) = delete;
  ScanQueue& operator=(const ScanQueue&) = delete;

  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) override;

  /// For what a callback of this queue does at its end and the scan need not wait for: does it on
  /// this thread, after what the callback added to other queues, and at once where it added none.
  void afterwards(std::function<void()> task);

  /// Waits for a callback that is at work and for all that was put off, and lets no other begin.
  /// Before what they use is destroyed; not from a callback of a ScanQueue.
  void end();

 private:
  enum class State { kIdle, kWaiting, kWorking };
  struct Crew;
  struct Shift;

  static Crew& crew();
  void work();
  static void workForNext(std::unique_lock<std::mutex>& lock);

  State state_ = State::kIdle;  // this and all below but the thread: under Crew::mutex
  std::size_t put_off_ = 0;     // tasks
  bool has_ended_ = false;
  bool is_called_ = false;        // our thread, to work
  std::condition_variable call_;  // for our thread
  std::condition_variable has_worked_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace smoke_ground_reconstruction
