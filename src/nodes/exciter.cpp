// SPDX-License-Identifier: BSD-3-Clause
// The exciter node; `--help` lists its parameters, topics and its action.
#include "backlash_diagnosis/ros/exciter_node.h"
#include "backlash_diagnosis/ros/node_main.h"

int main(int argc, char** argv) {
  using namespace backlash;
  return ros_bridge::node_main(argc, argv, "exciter", ros_bridge::exciter_help(), [] {
    const ros::NodeHandle handle, private_handle("~");
    return ros_bridge::ExciterNode(handle, ros_bridge::read_exciter_settings(private_handle)).run();
  });
}
