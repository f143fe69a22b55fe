#include <memory>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <vector>

#include "smoke_ground_reconstruction/channel_segmentation.hpp"
#include "smoke_ground_reconstruction/pcl/engines.hpp"
#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/cut_cloud.hpp"
#include "smoke_ground_reconstruction/ros/lazy_nodelet.hpp"
#include "smoke_ground_reconstruction/ros/mounting_source.hpp"
#include "smoke_ground_reconstruction/ros/scan_layout.hpp"
#include "smoke_ground_reconstruction/ros/sensor_models.hpp"
#include "smoke_ground_reconstruction/ros/tunable_params.hpp"
#include "smoke_ground_reconstruction/wall_clustering.hpp"

namespace smoke_ground_reconstruction {
namespace {

// What came of the denoiser is all kept; only what is no return is told apart.
std::vector<Label> returnsOf(const Scan& scan) {
  std::vector<Label> labels(scan.size(), Label::kInvalid);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (scan.valid[i] != 0) labels[i] = Label::kKept;
  }
  return labels;
}

// Of a scan that was laid out: kept is what was cut from it.
std::vector<Label> denoisedOf(const CutCloud& cut) {
  std::vector<Label> labels = cut.findings->labels;
  if (cut.label == Label::kKept) return labels;
  for (Label& label : labels) label = label == cut.label ? Label::kKept : Label::kNoise;
  return labels;
}

// A wall point outside every cluster is no wall for those who come after.
void dropUnclustered(const std::vector<std::uint32_t>& clusters, std::vector<Label>& labels) {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == Label::kWall && clusters[i] == kNoCluster) labels[i] = Label::kKept;
  }
}

}  // namespace

/// Finds floor and walls in a denoised cloud: ~input -> ~ground and ~walls.
class SegmenterNodelet : public LazyNodelet {
 public:
  ~SegmenterNodelet() override { endCallbacks(); }

 private:
  void setUp() override {
    sensors_ = std::make_unique<SensorModels>(getPrivateNodeHandle());
    mounting_ = std::make_unique<MountingSource>(getPrivateNodeHandle());
    params_ = std::make_unique<TunableParams<SegmenterConfig>>(upkeepHandle());
  }

  void advertiseOutputs() override {
    ground_pub_ = advertiseOutput<CutCloud>("ground");
    walls_pub_ = advertiseOutput<CutCloud>("walls");
  }

  void startListening() override {
    input_sub_ = inputHandle().subscribe("input", queueSize(), &SegmenterNodelet::onCloud, this,
                                         ros::TransportHints().tcpNoDelay());
  }

  void stopListening() override { input_sub_.shutdown(); }

  void onCloud(const CutCloudConstPtr& cut) {
    health().inputArrived();
    handleScan(cut->message.header, [&](StageTiming& timing) { return segment(*cut, timing); });
  }

  Kept segment(const CutCloud& cut, StageTiming& timing) {
    timing.received(addressOf(cut));
    const std_msgs::Header& header = cut.message.header;
    const Mounting mounting = mounting_->at(header, Mounting().sensor_height);
    if (const auto& layout = cut.layout) {
      const CloudView cloud(*layout->message);
      const SensorModel& sensor =
          sensors_->observe(header.frame_id, cloud.scan(), layout->points_by_ring);
      const Scan turned(mounting.isLevel() ? ScanView() : cloud.scan(), mounting);
      const Scan& scan = mounting.isLevel() ? layout->scan : turned;
      const auto raster = mounting.isLevel() ? layout->raster.take() : nullptr;
      return segment(cloud, scan, denoisedOf(cut), sensor, layout, raster, timing);
    }
    const CloudView cloud(cut.message);
    if (!cloud.hasRing()) warnOfDerivedRings(cut.message);
    const SensorModel& sensor = sensors_->observe(header.frame_id, cloud.scan());
    const Scan scan(cloud.scan(), mounting);
    return segment(cloud, scan, returnsOf(scan), sensor, nullptr, nullptr, timing);
  }

  /// \param cloud  the denoised points, or the scan that they were cut from with their labels.
  /// \param raster  of that scan; null where there is none for us.
  Kept segment(const CloudView& cloud, const Scan& scan, const std::vector<Label>& denoised,
               const SensorModel& sensor, const ScanLayoutConstPtr& layout,
               std::optional<ScanRaster>* raster, StageTiming& timing) {
    const auto params = params_->get();
    const std::size_t size = countPoints(denoised, Label::kKept);
    timing.finish("organise", size, size);

    const auto findings = std::make_shared<PointFindings>();
    auto& [labels, clusters] = *findings;
    labels = ChannelSegmentation(params->segmentation).classify(scan, denoised, sensor, raster);
    const std::size_t walls = countPoints(labels, Label::kWall);
    const std::size_t ground = countPoints(labels, Label::kGround);
    timing.finish("segment", size, ground + walls);

    clusters = WallClustering(params->clustering, findComponentsWithPcl).cluster(scan, labels);
    dropUnclustered(clusters, labels);
    const std::size_t kept = ground + countPoints(labels, Label::kWall);
    timing.finish("cluster", walls, kept - ground);

    publish(cloud, layout, findings, timing);
    timing.finish("publish", kept, kept);
    return {size, kept};
  }

  void publish(const CloudView& cloud, const ScanLayoutConstPtr& layout,
               const PointFindingsConstPtr& findings, StageTiming& timing) {
    auto fields = missingRing(cloud);
    publishIfHeard(ground_pub_, timing, [&] {
      return ground_cutter_.cut(cloud, layout, findings, Label::kGround, fields);
    });
    fields.push_back(AppendedField::of("cluster", findings->clusters));
    publishIfHeard(walls_pub_, timing, [&] {
      return walls_cutter_.cut(cloud, layout, findings, Label::kWall, fields);
    });
  }

  std::unique_ptr<SensorModels> sensors_;
  std::unique_ptr<MountingSource> mounting_;
  std::unique_ptr<TunableParams<SegmenterConfig>> params_;
  ros::Publisher ground_pub_;
  ros::Publisher walls_pub_;
  CloudCutter ground_cutter_;
  CloudCutter walls_cutter_;
  ros::Subscriber input_sub_;
};

}  // namespace smoke_ground_reconstruction

PLUGINLIB_EXPORT_CLASS(smoke_ground_reconstruction::SegmenterNodelet, nodelet::Nodelet)
