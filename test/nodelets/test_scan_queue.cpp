#include <gtest/gtest.h>
#include <ros/callback_queue_interface.h>

#include <atomic>
#include <boost/make_shared.hpp>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "smoke_ground_reconstruction/ros/scan_queue.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr std::chrono::seconds kPatience(20);  // for what must come, not for what must not

// In the tests the queues stand last: they wait for calls that use what stands before them.

class Call : public ros::CallbackInterface {
 public:
  explicit Call(std::function<void()> work) : work_(std::move(work)) {}
  CallResult call() override {
    work_();
    return Success;
  }

 private:
  std::function<void()> work_;
};

void add(ScanQueue& queue, std::function<void()> work) {
  queue.addCallback(boost::make_shared<Call>(std::move(work)), 1);
}

bool comes(std::promise<void>& event) {
  return event.get_future().wait_for(kPatience) == std::future_status::ready;
}

// Time enough for a thread that was woken.
void letOthersRun() {
  for (int i = 0; i < 10000; ++i) std::this_thread::yield();
}

TEST(ScanQueue, CallsOneAtATimeAndInTheirOrder) {
  std::atomic<int> at_work{0};
  std::vector<int> order;
  std::promise<void> is_done;
  ScanQueue first;
  ScanQueue second;  // its thread may work for the first
  for (int i = 0; i < 1000; ++i) {
    add(first, [&, i] {
      EXPECT_EQ(++at_work, 1);
      order.push_back(i);
      --at_work;
      if (i == 999) is_done.set_value();
    });
    add(second, [] {});
  }
  ASSERT_TRUE(comes(is_done));
  first.end();
  ASSERT_EQ(order.size(), 1000U);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
}

struct Passed {
  std::thread::id from, to;
  std::vector<std::string> order;
};

/// Returns when the threads of both have begun.
void meet(ScanQueue& first, ScanQueue& second) {
  std::promise<void> first_came;
  std::promise<void> second_came;
  std::promise<void> met;
  add(first, [&] {
    first_came.set_value();
    EXPECT_TRUE(comes(second_came));
    met.set_value();
  });
  add(second, [&] {
    EXPECT_TRUE(comes(first_came));
    second_came.set_value();
  });
  EXPECT_TRUE(comes(met));
}

Passed passOn() {
  Passed passed;
  std::promise<void> is_done;
  ScanQueue first;
  ScanQueue second;
  meet(first, second);
  add(first, [&] {
    passed.from = std::this_thread::get_id();
    add(second, [&] {
      passed.to = std::this_thread::get_id();
      passed.order.emplace_back("second");
      second.afterwards([&] { passed.order.emplace_back("after the second"); });
      is_done.set_value();
    });
    first.afterwards([&] { passed.order.emplace_back("after the first"); });
    letOthersRun();
    passed.order.emplace_back("first");
  });
  EXPECT_TRUE(comes(is_done));
  first.end();
  second.end();
  return passed;
}

TEST(ScanQueue, TheSameThreadTakesUpWhatItPassedOn) {
  Passed passed = passOn();
  // A thread that has just ended other work may be there first.
  for (int i = 0; i < 20 && passed.from != passed.to; ++i) passed = passOn();
  EXPECT_EQ(passed.from, passed.to);
  EXPECT_EQ(passed.order,
            (std::vector<std::string>{"first", "second", "after the first", "after the second"}));
}

TEST(ScanQueue, WorksOnTheNextWhileWhatWasPassedOnIsAtWork) {
  std::promise<void> next_begun;
  std::promise<void> is_done;
  bool came = false;
  ScanQueue first;
  ScanQueue second;
  add(first, [&] {
    add(second, [&] {
      came = comes(next_begun);
      is_done.set_value();
    });
    add(first, [&] { next_begun.set_value(); });
  });
  ASSERT_TRUE(comes(is_done));
  EXPECT_TRUE(came);
}

TEST(ScanQueue, IsNotHeldUpByAnother) {
  std::promise<void> release;
  std::promise<void> is_done;
  bool came = false;
  ScanQueue first;
  ScanQueue second;
  add(first, [&] {
    came = comes(release);
    is_done.set_value();
  });
  add(second, [&] { release.set_value(); });
  ASSERT_TRUE(comes(is_done));
  EXPECT_TRUE(came);
}

TEST(ScanQueue, DoesAtOnceWhatHasNothingToWaitFor) {
  std::promise<void> has_ended;
  bool was_done = false;
  ScanQueue queue;
  add(queue, [&] {
    queue.afterwards([&] { was_done = true; });
    EXPECT_TRUE(was_done);
    has_ended.set_value();
  });
  ASSERT_TRUE(comes(has_ended));
}

TEST(ScanQueue, EndWaitsForTheCallAtWorkAndLetsNoOtherBegin) {
  std::promise<void> has_begun;
  std::promise<void> end_begins;
  std::promise<void> release;
  std::promise<void> others_go_on;
  bool is_done = false;
  std::atomic<bool> was_called{false};
  ScanQueue queue;
  ScanQueue other;
  add(queue, [&] {
    has_begun.set_value();
    EXPECT_TRUE(comes(release));
    is_done = true;
  });
  ASSERT_TRUE(comes(has_begun));
  std::thread ending([&] {
    end_begins.set_value();
    queue.end();
    EXPECT_TRUE(is_done);
  });
  ASSERT_TRUE(comes(end_begins));
  letOthersRun();
  release.set_value();
  ending.join();
  add(queue, [&] { was_called = true; });
  add(other, [&] { others_go_on.set_value(); });
  EXPECT_TRUE(comes(others_go_on));
  EXPECT_FALSE(was_called);
}

TEST(ScanQueue, EndWaitsForWhatWasPutOff) {
  std::promise<void> has_begun;
  std::promise<void> end_begins;
  bool is_done = false;
  ScanQueue first;
  ScanQueue second;
  add(first, [&] {
    add(second, [&] {
      has_begun.set_value();
      EXPECT_TRUE(comes(end_begins));
      letOthersRun();
    });
    first.afterwards([&] { is_done = true; });
  });
  ASSERT_TRUE(comes(has_begun));
  end_begins.set_value();
  first.end();
  EXPECT_TRUE(is_done);
}

TEST(ScanQueue, ComesAndGoesWhileOthersWork) {
  std::atomic<int> called{0};
  ScanQueue steady;
  for (int i = 0; i < 100; ++i) {
    const auto is_done = std::make_shared<std::promise<void>>();
    ScanQueue passing;
    add(passing, [&, is_done] {
      add(steady, [&called, is_done] {
        ++called;
        is_done->set_value();
      });
    });
    ASSERT_TRUE(comes(*is_done)) << i;
  }
  EXPECT_EQ(called, 100);
}

}  // namespace
}  // namespace smoke_ground_reconstruction
