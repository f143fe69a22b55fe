#include <sensor_msgs/PointCloud2.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "smoke_ground_reconstruction/agdor_filter.hpp"
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/cut_cloud.hpp"
#include "smoke_ground_reconstruction/ros/lazy_nodelet.hpp"
#include "smoke_ground_reconstruction/ros/scan_layout.hpp"
#include "smoke_ground_reconstruction/ros/tunable_params.hpp"

namespace smoke_ground_reconstruction {

/// Takes smoke out of a cloud: ~input -> ~denoised and ~noise.
class DenoiserNodelet : public LazyNodelet {
 public:
  ~DenoiserNodelet() override { endCallbacks(); }

 private:
  void setUp() override {
    params_ = std::make_unique<TunableParams<DenoiserConfig>>(upkeepHandle());
  }

  void advertiseOutputs() override {
    denoised_pub_ = advertiseOutput<CutCloud>("denoised");
    noise_pub_ = advertiseOutput<CutCloud>("noise");
  }

  void startListening() override {
    input_sub_ = inputHandle().subscribe("input", queueSize(), &DenoiserNodelet::onCloud, this,
                                         ros::TransportHints().tcpNoDelay());
  }

  void stopListening() override { input_sub_.shutdown(); }

  void onCloud(const sensor_msgs::PointCloud2ConstPtr& msg) {
    health().inputArrived();
    handleScan(msg->header, [&](StageTiming& timing) { return denoise(msg, timing); });
  }

  Kept denoise(const sensor_msgs::PointCloud2ConstPtr& msg, StageTiming& timing) {
    timing.received(addressOf(*msg));
    const CloudView cloud(*msg);
    if (!cloud.hasRing()) warnOfDerivedRings(*msg);
    const auto layout = layouts_.take(msg, cloud);
    const Scan own(layout ? ScanView() : cloud.scan());
    const Scan& scan = layout ? layout->scan : own;
    timing.finish("organise", cloud.size(), cloud.size());

    const auto findings = std::make_shared<PointFindings>();
    auto& labels = findings->labels;
    labels = AgdorFilter(*params_->get(), makeKdTreeCounter)
                 .classify(scan, layout ? layout->raster.fill() : nullptr);
    const std::size_t kept = countPoints(labels, Label::kKept);
    timing.finish("denoise", cloud.size(), kept);

    const auto rings = missingRing(cloud);
    publishIfHeard(denoised_pub_, timing, [&] {
      return denoised_cutter_.cut(cloud, layout, findings, Label::kKept, rings);
    });
    publishIfHeard(noise_pub_, timing, [&] {
      return noise_cutter_.cut(cloud, layout, findings, Label::kNoise, rings);
    });
    timing.finish("publish", kept, kept);
    return {cloud.size(), kept};
  }

  std::unique_ptr<TunableParams<DenoiserConfig>> params_;
  ros::Publisher denoised_pub_;
  ros::Publisher noise_pub_;
  LayoutPool layouts_;
  CloudCutter denoised_cutter_;
  CloudCutter noise_cutter_;
  ros::Subscriber input_sub_;
};

}  // namespace smoke_ground_reconstruction

PLUGINLIB_EXPORT_CLASS(smoke_ground_reconstruction::DenoiserNodelet, nodelet::Nodelet)
