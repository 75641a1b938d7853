// SPDX-License-Identifier: BSD-3-Clause
// The diagnoser node; `--help` lists its parameters, topics and services.
#include "backlash_diagnosis/ros/diagnoser_node.h"
#include "backlash_diagnosis/ros/node_main.h"

int main(int argc, char** argv) {
  using namespace backlash;
  return ros_bridge::node_main(argc, argv, "diagnoser", ros_bridge::diagnoser_help(), [] {
    const ros::NodeHandle handle, private_handle("~");
    ros_bridge::DiagnoserNode(handle, private_handle, ros_bridge::load_diagnoser_settings(private_handle))
        .run();
    return 0;
  });
}
