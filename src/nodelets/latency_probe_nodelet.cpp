#include <nodelet/nodelet.h>
#include <ros/serialization.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <mutex>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "smoke_ground_reconstruction/pcl/engines.hpp"
#include "smoke_ground_reconstruction/pipeline.hpp"
#include "smoke_ground_reconstruction/ros/callback_thread.hpp"
#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/latency_log.hpp"
#include "smoke_ground_reconstruction/ros/message_pool.hpp"
#include "smoke_ground_reconstruction/ros/param_conversions.hpp"
#include "smoke_ground_reconstruction/ros/stage_timing.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointCloud2ConstPtr;
using sensor_msgs::PointCloud2Ptr;
using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook(5);  // between two looks at a condition
constexpr std::chrono::milliseconds kAnswer(
    500);                                     // for a first answer, before a scan is sent again
constexpr std::chrono::seconds kStart(60);    // for the chain to listen, and to answer at all
constexpr std::chrono::seconds kSilence(10);  // without floors, after which none is expected

struct Plan {
  int warm_up, compared, played;
  double rate;  // [Hz]
};

Plan planFrom(const ros::NodeHandle& nh) {
  const Plan plan{nh.param("warm_up", 20), nh.param("compare", 0), nh.param("count", 0),
                  nh.param("rate", 10.0)};
  if (!(plan.rate > 0.0)) throw std::invalid_argument("~rate must be above 0");
  return plan;
}

/// One scan as a driver's message, any number of times.
class PreparedScan {
 public:
  /// \throws std::runtime_error where the file does not hold a serialized PointCloud2.
  explicit PreparedScan(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    if (!file) throw std::runtime_error("cannot read " + path);
    ros::serialization::IStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                       static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, scan_);
    const PointCloud2Ptr fetched[] = {with(0), with(0)};  // as many may wait; not while time runs
  }

  PointCloud2Ptr with(std::uint32_t seq) {
    const PointCloud2Ptr message = pool_.take();
    if (message->data.empty()) *message = scan_;
    message->header.seq = seq;
    message->header.stamp = ros::Time::now();
    return message;
  }

  const PointCloud2& message() const { return scan_; }

 private:
  PointCloud2 scan_;
  MessagePool<PointCloud2> pool_;
};

template <typename Config>
Config configOf(const std::string& node) {
  Config config = Config::__getDefault__();
  config.__fromServer__(ros::NodeHandle(node));
  return config;
}

PipelineParams paramsOf(const std::string& chain) {
  PipelineParams params;
  params.denoiser = toParams(configOf<DenoiserConfig>(chain + "/denoiser"));
  params.segmenter = toParams(configOf<SegmenterConfig>(chain + "/segmenter"));
  params.reconstructor = toParams(configOf<ReconstructorConfig>(chain + "/reconstructor"));
  return params;
}

/// Past all that a probe before this one can have sent, at less than a scan a millisecond: scans of
/// its own may still be under way.
std::uint32_t firstSeq() {
  return static_cast<std::uint32_t>(nanosecondsOf(steady_clock::now()) / 1000000);
}

/// Time up to the floor: without the occupancy grid, for which nobody listens here.
double millisecondsToFloor(const PipelineResult& result) {
  double sum = 0.0;
  for (const StageTime& time : result.times) {
    if (time.stage != std::string("rasterize")) sum += time.milliseconds;
  }
  return sum;
}

}  // namespace

/// Plays prepared scans into the chain from within its manager, as a driver there does, and tells
/// when what of them came to where: ~cloud, and the log as JSON once on ~result.
///
/// Private parameters, read once: ~scans (files of one serialized PointCloud2 each, played in
/// turn), ~chain (namespace of the three nodelets), ~warm_up scans, ~compare scans that are each
/// waited for and then given to a Pipeline as well, ~count scans at ~rate [Hz].
class LatencyProbeNodelet : public nodelet::Nodelet {
 public:
  ~LatencyProbeNodelet() override {
    is_over_ = true;
    has_arrived_.notify_all();
    if (thread_.joinable()) thread_.join();
    arrivals_.end();
  }

 private:
  void onInit() override {
    ros::NodeHandle pnh = arrivals_.handle(getPrivateNodeHandle());
    plan_ = planFrom(pnh);
    chain_ = pnh.param<std::string>("chain", "ground_reconstruction");
    for (const auto& path : pnh.param("scans", std::vector<std::string>())) {
      scans_.push_back(std::make_unique<PreparedScan>(path));
    }
    if (scans_.empty()) throw std::invalid_argument("~scans names no file");
    listen();
    result_pub_ = pnh.advertise<std_msgs::String>("result", 1, true);
    cloud_pub_ = pnh.advertise<PointCloud2>("cloud", 1);
    arrivals_.start();
    thread_ = std::thread([this] { run(); });
  }

  void listen() {
    ros::NodeHandle nh = arrivals_.handle(getNodeHandle());
    surface_sub_ = nh.subscribe(chain_ + "/reconstructor/ground_surface", kQueueSize,
                                &LatencyProbeNodelet::onSurface, this);
    for (const std::string stage : {"denoiser", "segmenter", "reconstructor"}) {
      const boost::function<void(const TimingConstPtr&)> note = [this, stage](const auto& timing) {
        log_.worked(stage, *timing);
      };
      timing_subs_.push_back(
          nh.subscribe<Timing>(chain_ + "/" + stage + "/timing", kQueueSize, note));
    }
  }

  void onSurface(const PointCloud2ConstPtr& surface) {
    log_.arrived(*surface, nanosecondsOf(steady_clock::now()));
    const std::lock_guard<std::mutex> lock(mutex_);
    last_arrival_ = steady_clock::now();
    has_arrived_.notify_all();
  }

  void run() {
    std::string result;
    try {
      wake();
      for (int i = 0; i < plan_.warm_up; ++i) sendAndWait();
      compare();
      play();
      result = log_.json();
    } catch (const std::exception& error) {
      result = std::string("{\"error\": \"") + error.what() + "\"}";
    }
    std_msgs::String message;
    message.data = result;
    result_pub_.publish(message);
  }

  /// Sends scans until a floor comes: all of the chain is connected then.
  void wake() {
    const auto deadline = steady_clock::now() + kStart;
    while (cloud_pub_.getNumSubscribers() == 0) {
      std::this_thread::sleep_for(kLook);
      checkTime(deadline);
    }
    while (!waitForFloor(send(), kAnswer)) checkTime(deadline);
  }

  void checkTime(steady_clock::time_point deadline) const {
    if (is_over_) throw std::runtime_error("the manager ends");
    if (steady_clock::now() > deadline) throw std::runtime_error("the chain does not answer");
  }

  std::uint32_t send() {
    const std::uint32_t seq = ++last_seq_;
    const PointCloud2Ptr message = scans_[seq % scans_.size()]->with(seq);
    log_.sent(*message, nanosecondsOf(steady_clock::now()));
    cloud_pub_.publish(message);
    return seq;
  }

  bool waitForFloor(std::uint32_t seq, steady_clock::duration patience) {
    std::unique_lock<std::mutex> lock(mutex_);
    return has_arrived_.wait_for(lock, patience, [&] { return is_over_ || log_.hasArrived(seq); });
  }

  std::uint32_t sendAndWait() {
    const std::uint32_t seq = send();
    if (!waitForFloor(seq, kSilence)) throw std::runtime_error("a scan gave no floor");
    if (is_over_) throw std::runtime_error("the manager ends");
    return seq;
  }

  void compare() {
    Pipeline pipeline(paramsOf(chain_), pclEngines());
    for (int i = 0; i < plan_.compared; ++i) {
      const std::uint32_t seq = sendAndWait();
      const CloudView scan(scans_[seq % scans_.size()]->message());
      log_.compared(seq, millisecondsToFloor(pipeline.process(scan.scan())));
    }
  }

  void play() {
    const auto period = std::chrono::duration_cast<steady_clock::duration>(
        std::chrono::duration<double>(1.0 / plan_.rate));
    const int per_look = std::max(1, static_cast<int>(plan_.rate));
    const auto begin = steady_clock::now();
    for (int i = 0; i < plan_.played && !is_over_; ++i) {
      std::this_thread::sleep_until(begin + i * period);
      if (i % per_look == 0) log_.lookAtProcess();
      send();
    }
    waitForSilence();
    log_.lookAtProcess();
  }

  /// Until the last scan has given its floor, or none comes any more.
  void waitForSilence() {
    std::unique_lock<std::mutex> lock(mutex_);
    last_arrival_ = steady_clock::now();
    const auto is_done = [&] { return is_over_ || log_.hasArrived(last_seq_); };
    while (!is_done() && steady_clock::now() < last_arrival_ + kSilence) {
      has_arrived_.wait_for(lock, kAnswer);
    }
  }

  static constexpr std::uint32_t kQueueSize = 1000;  // whatever is held up, nothing is lost here

  Plan plan_{};
  CallbackThread arrivals_;  // told at once, even while others are at work
  std::string chain_;
  std::vector<std::unique_ptr<PreparedScan>> scans_;
  LatencyLog log_;
  std::mutex mutex_;
  std::condition_variable has_arrived_;
  steady_clock::time_point last_arrival_;
  std::uint32_t last_seq_ = firstSeq();
  ros::Publisher cloud_pub_, result_pub_;
  ros::Subscriber surface_sub_;
  std::vector<ros::Subscriber> timing_subs_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace smoke_ground_reconstruction

PLUGINLIB_EXPORT_CLASS(smoke_ground_reconstruction::LatencyProbeNodelet, nodelet::Nodelet)
