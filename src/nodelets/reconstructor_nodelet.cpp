#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <sensor_msgs/PointCloud2.h>

#include <map>
#include <memory>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>

#include "smoke_ground_reconstruction/occupancy.hpp"
#include "smoke_ground_reconstruction/polar_segments.hpp"
#include "smoke_ground_reconstruction/room_boundary.hpp"
#include "smoke_ground_reconstruction/ros/cloud_conversions.hpp"
#include "smoke_ground_reconstruction/ros/cut_cloud.hpp"
#include "smoke_ground_reconstruction/ros/floor_markers.hpp"
#include "smoke_ground_reconstruction/ros/lazy_nodelet.hpp"
#include "smoke_ground_reconstruction/ros/message_pool.hpp"
#include "smoke_ground_reconstruction/ros/mounting_source.hpp"
#include "smoke_ground_reconstruction/ros/room_findings.hpp"
#include "smoke_ground_reconstruction/ros/scan_layout.hpp"
#include "smoke_ground_reconstruction/ros/sensor_models.hpp"
#include "smoke_ground_reconstruction/ros/surface_conversions.hpp"
#include "smoke_ground_reconstruction/ros/tunable_params.hpp"

namespace smoke_ground_reconstruction {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointCloud2ConstPtr;

void checkFrame(const PointCloud2& scan, const CutCloud& part, const char* topic) {
  const std::string& frame = part.message.header.frame_id;
  if (frame == scan.header.frame_id) return;
  throw std::invalid_argument(std::string(topic) + " is in frame '" + frame + "', ~input in '" +
                              scan.header.frame_id + "'");
}

}  // namespace

/// Makes the floor: ~ground_surface, ~occupancy, ~boundary, ~boundary_polygon and ~markers.
///
/// polar_segments takes ~input (the raw scan), ~ground and ~walls of one stamp. room_boundary
/// denoises and segments by itself: it takes ~input alone and lets the stages before sleep.
class ReconstructorNodelet : public LazyNodelet {
 public:
  ~ReconstructorNodelet() override { endCallbacks(); }

 private:
  void setUp() override {
    sensors_ = std::make_unique<SensorModels>(getPrivateNodeHandle());
    mounting_ = std::make_unique<MountingSource>(getPrivateNodeHandle());
    params_ = std::make_unique<TunableParams<ReconstructorConfig>>(upkeepHandle(),
                                                                   [this] { onParams(); });
    raw_sub_.registerCallback(
        [this](const ros::MessageEvent<const PointCloud2>&) { health().inputArrived(); });
  }

  void advertiseOutputs() override {
    surface_pub_ = advertiseOutput<PointCloud2>("ground_surface");
    occupancy_pub_ = advertiseOutput<nav_msgs::OccupancyGrid>("occupancy");
    boundary_pub_ = advertiseOutput<FloorBoundary>("boundary");
    polygon_pub_ = advertiseOutput<geometry_msgs::PolygonStamped>("boundary_polygon");
    markers_pub_ = advertiseOutput<visualization_msgs::MarkerArray>("markers");
  }

  /// The inputs hang on the method. Changed on the queue on which listeners come and go.
  void onParams() {
    switch_timer_ = listenerHandle().createWallTimer(
        ros::WallDuration(0.0),
        [this](const ros::WallTimerEvent&) {
          if (params_->get()->method != listened_for_) listenAnew();
        },
        true);
  }

  void startListening() override {
    ros::NodeHandle inputs = inputHandle();
    const auto hints = ros::TransportHints().tcpNoDelay();
    listened_for_ = params_->get()->method;
    if (listened_for_ == ReconstructionMethod::kRoomBoundary) {
      raw_alone_sub_ =
          inputs.subscribe("input", queueSize(), &ReconstructorNodelet::onRaw, this, hints);
      return;
    }
    sync_ =
        std::make_unique<Synchronizer>(Policy(kSyncQueueSize), raw_sub_, ground_sub_, walls_sub_);
    sync_->registerCallback(&ReconstructorNodelet::onParts, this);
    raw_sub_.subscribe(inputs, "input", kSyncQueueSize, hints);
    ground_sub_.subscribe(inputs, "ground", kSyncQueueSize, hints);
    walls_sub_.subscribe(inputs, "walls", kSyncQueueSize, hints);
  }

  void stopListening() override {
    raw_alone_sub_.shutdown();
    raw_sub_.unsubscribe();
    ground_sub_.unsubscribe();
    walls_sub_.unsubscribe();
    sync_.reset();  // with what waits in it
  }

  // The inputs tell the method, not the parameters: those may change while a scan is under way.

  void onRaw(const PointCloud2ConstPtr& raw) {
    health().inputArrived();
    handleScan(raw->header, [&](StageTiming& timing) { return findRoom(*raw, timing); });
  }

  void onParts(const PointCloud2ConstPtr& raw, const CutCloudConstPtr& ground,
               const CutCloudConstPtr& walls) {
    handleScan(raw->header,
               [&](StageTiming& timing) { return fillSegments(raw, *ground, *walls, timing); });
  }

  Kept findRoom(const PointCloud2& raw, StageTiming& timing) {
    timing.received(addressOf(raw));
    const CloudView cloud(raw);
    if (!cloud.hasRing()) warnOfDerivedRings(raw);
    const auto params = params_->get();
    const Mounting mounting = mounting_->at(raw.header, params->sensor_height);
    const SensorModel& sensor = sensors_->observe(raw.header.frame_id, cloud.scan());
    timing.finish("organise", cloud.size(), cloud.size());

    RoomBoundary& method = rooms_[raw.header.frame_id];
    method.setParams(params->room_boundary);
    method.reconstruct(cloud.scan(), sensor, mounting, &room_);
    timing.finish("reconstruct", cloud.size(), room_.surface.size());
    timing.told(room_.visibility);

    const auto grid = [&] {
      OccupancyGrid drawn;
      rasterize(room_.surface, cloud.scan(), room_.labels, mounting, params->occupancy_resolution,
                kOccupancyRange, &drawn);
      return drawn;
    };
    publishFloor(raw.header, room_.surface, mounting, grid, timing);
    tellOfRoom({mounting.sensor_height, mounting_->heightIsFrom()});
    return {cloud.size(), room_.surface.size()};
  }

  void tellOfRoom(const GivenHeight& given) {
    const std::string warning = heightWarning(room_.floor, given);
    health().tell(findingsOf(room_.floor, room_.visibility, given), warning);
    if (!warning.empty()) warn(warning);
  }

  Kept fillSegments(const PointCloud2ConstPtr& raw, const CutCloud& ground, const CutCloud& walls,
                    StageTiming& timing) {
    for (const auto address : {addressOf(*raw), addressOf(ground), addressOf(walls)}) {
      timing.received(address);
    }
    health().tell({}, "");
    checkFrame(*raw, ground, "~ground");
    checkFrame(*raw, walls, "~walls");
    const auto params = params_->get();
    const CloudView scan(*raw);
    const Mounting mounting = mounting_->at(raw->header, params->sensor_height);
    const SensorModel& sensor = observe(raw, scan.scan(), ground.layout);
    timing.finish("organise", scan.size(), scan.size());

    const CutView ground_view(ground);
    const CutView walls_view(walls);
    const FloorSurface surface =
        PolarSegments(params->polar_segments)
            .reconstruct(ground_view.scan(), walls_view.scan(), sensor, mounting);
    timing.finish("reconstruct", ground_view.scan().size + walls_view.scan().size, surface.size());

    const auto grid = [&] {
      return rasterize(surface, walls_view.scan(), mounting, params->occupancy_resolution);
    };
    publishFloor(raw->header, surface, mounting, grid, timing);
    return {scan.size(), surface.size()};
  }

  /// \param layout  came with what was cut from a scan, which may be another one.
  const SensorModel& observe(const PointCloud2ConstPtr& raw, const ScanView& scan,
                             const ScanLayoutConstPtr& layout) {
    const std::string& frame = raw->header.frame_id;
    if (!layout || layout->message != raw) return sensors_->observe(frame, scan);
    return sensors_->observe(frame, scan, layout->points_by_ring);
  }

  /// \param make_grid  makes the occupancy grid, called where somebody listens for it.
  template <typename MakeGrid>
  void publishFloor(const std_msgs::Header& header, const FloorSurface& surface,
                    const Mounting& mounting, const MakeGrid& make_grid, StageTiming& timing) {
    publishIfHeard(surface_pub_, timing,
                   [&] { return toSurfaceMsg(header, surface, surface_pool_.take()); });
    publishIfHeard(boundary_pub_, [&] { return toBoundaryMsg(header, surface.boundary); });
    publishIfHeard(polygon_pub_, [&] { return toPolygonMsg(header, surface.boundary); });
    publishIfHeard(markers_pub_, [&] { return toMarkers(header, surface.boundary, mounting); });
    publishIfHeard(occupancy_pub_, [&] { return toOccupancyMsg(header, make_grid(), mounting); });
    timing.finish("publish", surface.size(), surface.size());
  }

  using Policy = message_filters::sync_policies::ExactTime<PointCloud2, CutCloud, CutCloud>;
  using Synchronizer = message_filters::Synchronizer<Policy>;
  // Raw scans wait here for the stages before. Each of the two holds one scan in work and one in
  // its queue: at 10 Hz this lets a stage take a second, and on a match what is older is let go.
  static constexpr int kSyncQueueSize = 40;

  std::unique_ptr<SensorModels> sensors_;
  std::unique_ptr<MountingSource> mounting_;
  std::unique_ptr<TunableParams<ReconstructorConfig>> params_;
  ros::Publisher surface_pub_, occupancy_pub_, boundary_pub_, polygon_pub_, markers_pub_;
  MessagePool<PointCloud2> surface_pool_;
  message_filters::Subscriber<PointCloud2> raw_sub_;
  message_filters::Subscriber<CutCloud> ground_sub_, walls_sub_;
  std::unique_ptr<Synchronizer> sync_;
  ros::Subscriber raw_alone_sub_;
  ros::WallTimer switch_timer_;
  ReconstructionMethod listened_for_ = ReconstructionMethod::kPolarSegments;
  std::map<std::string, RoomBoundary> rooms_;  // by frame_id
  RoomBoundaryResult room_;
};

}  // namespace smoke_ground_reconstruction

PLUGINLIB_EXPORT_CLASS(smoke_ground_reconstruction::ReconstructorNodelet, nodelet::Nodelet)
