#include "smoke_ground_reconstruction/ros/scan_queue.hpp"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

namespace smoke_ground_reconstruction {

/// What the queues of a process share.
struct ScanQueue::Crew {
  std::mutex mutex;
  std::deque<ScanQueue*> waiting;  // for a thread; each once
  std::vector<ScanQueue*> idle;    // whose thread has no work; who worked last is called first

  void callSomebody() {
    if (idle.empty()) return;
    idle.back()->is_called_ = true;
    idle.back()->call_.notify_one();
    idle.pop_back();
  }

  void forget(const ScanQueue* queue) {
    waiting.erase(std::remove(waiting.begin(), waiting.end(), queue), waiting.end());
    idle.erase(std::remove(idle.begin(), idle.end(), queue), idle.end());
  }
};

/// What a thread remembers while it works for the queues.
struct ScanQueue::Shift {
  struct Task {
    ScanQueue* queue;
    std::function<void()> work;
  };

  bool is_on = false;
  bool has_passed_on = false;  // something from the callback at work to other queues
  std::vector<Task> later;     // put off until that is done

  static Shift& ours() {
    static thread_local Shift shift;
    return shift;
  }

  void catchUp() {
    for (const Task& task : later) {
      task.work();
      const std::lock_guard<std::mutex> lock(crew().mutex);
      --task.queue->put_off_;
      task.queue->has_worked_.notify_all();
    }
    later.clear();
  }
};

ScanQueue::Crew& ScanQueue::crew() {
  static Crew crew;
  return crew;
}

ScanQueue::ScanQueue() : thread_([this] { work(); }) {}

ScanQueue::~ScanQueue() { end(); }

void ScanQueue::addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) {
  ros::CallbackQueue::addCallback(callback, owner);
  const std::lock_guard<std::mutex> lock(crew().mutex);
  if (has_ended_ || state_ != State::kIdle) return;  // who works for it looks again
  state_ = State::kWaiting;
  if (Shift::ours().is_on) {
    Shift::ours().has_passed_on = true;
    crew().waiting.push_front(this);  // for this very thread, in a moment
  } else {
    crew().waiting.push_back(this);
    crew().callSomebody();
  }
}

void ScanQueue::afterwards(std::function<void()> task) {
  {
    const std::lock_guard<std::mutex> lock(crew().mutex);
    ++put_off_;
  }
  Shift& shift = Shift::ours();
  shift.later.push_back({this, std::move(task)});
  if (!shift.has_passed_on) shift.catchUp();
}

void ScanQueue::end() {
  {
    std::unique_lock<std::mutex> lock(crew().mutex);
    has_ended_ = true;
    crew().forget(this);
    call_.notify_one();
    has_worked_.wait(lock, [this] { return state_ != State::kWorking && put_off_ == 0; });
  }
  if (thread_.joinable()) thread_.join();
}

void ScanQueue::work() {
  Shift& shift = Shift::ours();
  shift.is_on = true;
  auto& [mutex, waiting, idle] = crew();
  std::unique_lock<std::mutex> lock(mutex);
  while (!has_ended_) {
    if (!waiting.empty()) {
      workForNext(lock);
    } else if (!shift.later.empty()) {
      lock.unlock();
      shift.catchUp();
      lock.lock();
    } else {
      is_called_ = false;
      idle.push_back(this);
      call_.wait(lock, [this] { return is_called_ || has_ended_; });
    }
  }
  if (!waiting.empty()) crew().callSomebody();  // what we were called for
  lock.unlock();
  shift.catchUp();
}

void ScanQueue::workForNext(std::unique_lock<std::mutex>& lock) {
  auto& waiting = crew().waiting;
  ScanQueue& queue = *waiting.front();
  waiting.pop_front();
  if (!waiting.empty()) crew().callSomebody();
  queue.state_ = State::kWorking;
  Shift::ours().has_passed_on = false;
  lock.unlock();
  queue.callOne();
  lock.lock();
  const bool has_more = !queue.has_ended_ && !queue.isEmpty();
  queue.state_ = has_more ? State::kWaiting : State::kIdle;
  if (has_more) waiting.push_back(&queue);
  queue.has_worked_.notify_all();
}

}  // namespace smoke_ground_reconstruction
