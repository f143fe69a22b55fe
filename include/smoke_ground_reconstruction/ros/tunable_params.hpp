#pragma once

#include <dynamic_reconfigure/server.h>
#include <ros/console.h>
#include <ros/node_handle.h>

#include <atomic>
#include <boost/thread/recursive_mutex.hpp>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "smoke_ground_reconstruction/ros/param_conversions.hpp"
#include "smoke_ground_reconstruction/ros/strange_params.hpp"

namespace smoke_ground_reconstruction {

/// The parameters of a stage, tunable while it runs. A scan takes one set with get() and computes
/// without a lock; a change shows in the next scan.
template <typename Config>
class TunableParams {
 public:
  using Params = std::decay_t<decltype(toParams(Config()))>;

  /// \param nh  private handle whose queue serves the changes; one on which no scan is worked on,
  ///            so that a change never waits for one.
  /// \param on_change  called after each change, on that queue.
  explicit TunableParams(
      const ros::NodeHandle& nh, std::function<void()> on_change = [] {})
      : name_(nh.getNamespace()), on_change_(std::move(on_change)), server_(mutex_, nh) {
    server_.setCallback([this](Config& config, std::uint32_t) { onConfig(config); });
    is_ready_ = true;
    for (const std::string& name : strangeParams(nh, names())) {
      ROS_WARN("%s: there is no parameter '%s'; it is ignored", name_.c_str(), name.c_str());
    }
  }

  std::shared_ptr<const Params> get() const { return std::atomic_load(&params_); }

 private:
  static std::vector<std::string> names() {
    std::vector<std::string> names;
    for (const auto& param : Config::__getParamDescriptions__()) names.push_back(param->name);
    return names;
  }

  // The server swallows a throw and publishes what is left in `config`, so leave a good set there.
  void onConfig(Config& config) {
    repair(config);
    try {
      store(config);
    } catch (const std::invalid_argument& error) {
      ROS_WARN("%s: kept the parameters as they were: %s", name_.c_str(), error.what());
      config = accepted_;
      store(config);
    }
    accepted_ = config;
    if (is_ready_) on_change_();
  }

  void store(const Config& config) {
    std::atomic_store(&params_, std::make_shared<const Params>(toParams(config)));
  }

  std::string name_;  // of the nodelet
  std::function<void()> on_change_;
  std::atomic<bool> is_ready_{false};  // not while the owner makes this
  Config accepted_ = Config::__getDefault__();
  std::shared_ptr<const Params> params_;
  boost::recursive_mutex mutex_;
  dynamic_reconfigure::Server<Config> server_;  // last: its callback uses all of the above
};

}  // namespace smoke_ground_reconstruction
