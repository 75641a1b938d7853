// SPDX-License-Identifier: BSD-3-Clause
// The change_watch node; `--help` lists its parameters and topics.
#include "backlash_diagnosis/ros/node_main.h"
#include "backlash_diagnosis/ros_arm/change_watch_node.h"

int main(int argc, char** argv) {
  using namespace backlash;
  return ros_bridge::node_main(argc, argv, "change_watch", ros_bridge::change_watch_help(), [] {
    const ros::NodeHandle handle, private_handle("~");
    ros_bridge::ChangeWatchNode(handle, private_handle,
                                ros_bridge::load_change_watch_settings(private_handle))
        .run();
    return 0;
  });
}
