#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "smoke_ground_reconstruction/agdor_filter.hpp"
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/lazy_nodelet.hpp"
#include "smoke_ground_reconstruction/ros/message_pool.hpp"
#include "smoke_ground_reconstruction/ros/scan_layout.hpp"
#include "smoke_ground_reconstruction/ros/tunable_params.hpp"

namespace smoke_ground_reconstruction {

/// Takes smoke out of a cloud: ~input -> ~denoised and ~noise.
class DenoiserNodelet : public LazyNodelet {
 private:
  void setUp() override {
    params_ = std::make_unique<TunableParams<DenoiserConfig>>(getMTPrivateNodeHandle());
  }

  void advertiseOutputs() override {
    denoised_pub_ = advertiseOutput<sensor_msgs::PointCloud2>("denoised");
    noise_pub_ = advertiseOutput<sensor_msgs::PointCloud2>("noise");
  }

  void startListening() override {
    input_sub_ = getPrivateNodeHandle().subscribe("input", queueSize(), &DenoiserNodelet::onCloud,
                                                  this, ros::TransportHints().tcpNoDelay());
  }

  void stopListening() override { input_sub_.shutdown(); }

  void onCloud(const sensor_msgs::PointCloud2ConstPtr& msg) {
    health().inputArrived();
    handleScan(msg->header, [&](StageTiming& timing) { return denoise(msg, timing); });
  }

  Kept denoise(const sensor_msgs::PointCloud2ConstPtr& msg, StageTiming& timing) {
    timing.received(*msg);
    const CloudView cloud(*msg);
    if (!cloud.hasRing()) warnOfDerivedRings(*msg);
    const auto layout = layouts_.take(msg, cloud);
    const Scan own(layout ? ScanView() : cloud.scan());
    const Scan& scan = layout ? layout->scan : own;
    timing.finish("organise", cloud.size(), cloud.size());

    const auto labels = AgdorFilter(*params_->get(), makeKdTreeCounter).classify(scan);
    const auto kept =
        static_cast<std::size_t>(std::count(labels.begin(), labels.end(), Label::kKept));
    timing.finish("denoise", cloud.size(), kept);

    if (layout) layout->labels = labels;
    const auto rings = missingRing(cloud);
    publishIfHeard(denoised_pub_, timing, [&] {
      return selectPoints(cloud, labels, Label::kKept, rings, denoised_pool_.take(layout));
    });
    publishIfHeard(noise_pub_, timing, [&] {
      return selectPoints(cloud, labels, Label::kNoise, rings, noise_pool_.take());
    });
    timing.finish("publish", kept, kept);
    return {cloud.size(), kept};
  }

  std::unique_ptr<TunableParams<DenoiserConfig>> params_;
  ros::Publisher denoised_pub_;
  ros::Publisher noise_pub_;
  LayoutPool layouts_;
  CarrierPool denoised_pool_;
  MessagePool<sensor_msgs::PointCloud2> noise_pool_;
  ros::Subscriber input_sub_;
};

}  // namespace smoke_ground_reconstruction

PLUGINLIB_EXPORT_CLASS(smoke_ground_reconstruction::DenoiserNodelet, nodelet::Nodelet)
