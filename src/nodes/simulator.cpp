// SPDX-License-Identifier: BSD-3-Clause
// The simulator node; `--help` lists its parameters, topics and services.
#include "backlash_diagnosis/ros/node_main.h"
#include "backlash_diagnosis/ros/simulator_node.h"

int main(int argc, char** argv) {
  using namespace backlash;
  return ros_bridge::node_main(argc, argv, "simulator", ros_bridge::simulator_help(), [] {
    return ros_bridge::SimulatorNode(ros::NodeHandle(), ros::NodeHandle("~")).run();
  });
}
