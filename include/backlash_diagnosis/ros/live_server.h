// SPDX-License-Identifier: BSD-3-Clause
// dynamic_reconfigure with refusal: a wrong value changes nothing and the reason is in the answer.
//
// The parameters are below the name "live" and are overwritten with the values in force at each start. So
// what was set while a node ran never becomes its configuration at the next start.
#pragma once

#include <dynamic_reconfigure/server.h>
#include <ros/console.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {

/// Name below which live parameters are served.
constexpr const char* kLive = "live";

/// `Config`: generated from cfg/, with a text `refused`.
template <typename Config>
class LiveServer {
 public:
  /// Throws Error if a value may not be set; then nothing may have changed.
  using Apply = std::function<void(const Config&)>;

  LiveServer(const ros::NodeHandle& parent, const Config& in_force, Apply apply)
      : apply_(std::move(apply)),
        in_force_(with_origin(parent, in_force)),
        handle_(parent, kLive),
        server_(mutex_, handle_) {
    server_.setCallback([this](Config& wanted, std::uint32_t) { take(wanted); });
  }

  /// Publishes values that something else than dynamic_reconfigure has changed.
  void update(const Config& in_force) {
    const boost::recursive_mutex::scoped_lock lock(mutex_);
    in_force_ = in_force;
    in_force_.refused.clear();
    server_.updateConfig(in_force_);
  }

 private:
  static Config with_origin(const ros::NodeHandle& parent, Config in_force) {
    in_force.refused.clear();
    in_force.__toServer__(ros::NodeHandle(parent, kLive));  // the server starts with what it finds there
    return in_force;
  }

  void take(Config& wanted) {
    try {
      apply_(wanted);
      in_force_ = wanted;
      in_force_.refused.clear();
    } catch (const Error& error) {
      ROS_WARN("%s: refused: %s", handle_.getNamespace().c_str(), error.what());
      in_force_.refused = error.what();
    }
    wanted = in_force_;
  }

  Apply apply_;
  Config in_force_;
  ros::NodeHandle handle_;
  boost::recursive_mutex mutex_;
  dynamic_reconfigure::Server<Config> server_;
};

}  // namespace backlash::ros_bridge
