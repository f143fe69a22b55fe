#include <gtest/gtest.h>
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>

#include <atomic>
#include <boost/make_shared.hpp>
#include <chrono>
#include <future>
#include <string>
#include <thread>

#include "smoke_ground_reconstruction/ros/lazy_nodelet.hpp"

namespace smoke_ground_reconstruction {
namespace {

constexpr std::chrono::seconds kPatience(20);  // for what must come, not for what must not

/// Where a callback of the nodelet is, and whether it may go on.
struct Watch {
  std::promise<void> has_begun;
  std::promise<void> release;
  std::atomic<bool> has_ended{false};
  std::atomic<bool> is_gone{false};  // the nodelet

  void callback() {
    has_begun.set_value();
    EXPECT_EQ(release.get_future().wait_for(kPatience), std::future_status::ready);
    EXPECT_FALSE(is_gone);
    has_ended = true;
  }
};

class IdleNodelet : public LazyNodelet {
 public:
  explicit IdleNodelet(Watch& watch) : watch_(watch) {}
  ~IdleNodelet() override {
    endCallbacks();
    watch_.is_gone = true;
  }

 protected:
  void setUp() override {}
  void advertiseOutputs() override {
    output_pub_ = advertiseOutput<sensor_msgs::PointCloud2>("output");
  }
  void startListening() override {}
  void stopListening() override {}

  Watch& watch_;

 private:
  ros::Publisher output_pub_;
};

/// Stays in a callback of the kind that parameters and diagnostics have.
class TuningNodelet : public IdleNodelet {
 public:
  using IdleNodelet::IdleNodelet;

 private:
  void setUp() override {
    timer_ = upkeepHandle().createWallTimer(
        ros::WallDuration(0.0), [this](const ros::WallTimerEvent&) { watch_.callback(); }, true);
  }
  ros::WallTimer timer_;
};

/// Stays in the callback that tells it of a listener.
class HeardNodelet : public IdleNodelet {
 public:
  using IdleNodelet::IdleNodelet;

 private:
  void startListening() override { watch_.callback(); }
};

/// Unloads a nodelet while a callback of it is at work: it must wait for that, for what the
/// callback uses and the queues that it hangs on would be gone.
template <typename Nodelet>
void unloadAtWork() {
  Watch watch;
  nodelet::Loader loader([&watch](const std::string&) -> boost::shared_ptr<nodelet::Nodelet> {
    return boost::make_shared<Nodelet>(watch);
  });
  ASSERT_TRUE(loader.load("/stage", "", {}, {}));
  const boost::function<void(const sensor_msgs::PointCloud2ConstPtr&)> listen = [](const auto&) {};
  const auto listener = ros::NodeHandle().subscribe("/stage/output", 1, listen);
  ASSERT_EQ(watch.has_begun.get_future().wait_for(kPatience), std::future_status::ready);
  std::promise<void> unload_begins;
  std::thread unloading([&] {
    unload_begins.set_value();
    EXPECT_TRUE(loader.unload("/stage"));
    EXPECT_TRUE(watch.has_ended) << "it did not wait for the callback";
    EXPECT_TRUE(watch.is_gone) << "it left the nodelet behind";
  });
  unload_begins.get_future().wait();
  for (int i = 0; i < 10000; ++i) std::this_thread::yield();  // time enough to go wrong
  watch.release.set_value();
  unloading.join();
}

TEST(Unload, WaitsForAChangeOfParameters) { unloadAtWork<TuningNodelet>(); }

TEST(Unload, WaitsForWhatAListenerSetsGoing) { unloadAtWork<HeardNodelet>(); }

TEST(Unload, LeavesNothingOfANodeletThatIsIdle) {
  Watch watch;
  nodelet::Loader loader([&watch](const std::string&) -> boost::shared_ptr<nodelet::Nodelet> {
    return boost::make_shared<IdleNodelet>(watch);
  });
  ASSERT_TRUE(loader.load("/stage", "", {}, {}));
  EXPECT_TRUE(loader.unload("/stage"));
  EXPECT_TRUE(watch.is_gone);
}

}  // namespace
}  // namespace smoke_ground_reconstruction

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_unload");
  const ros::NodeHandle keeps_ros_up;
  return RUN_ALL_TESTS();
}
