// SPDX-License-Identifier: BSD-3-Clause
// The simulator node; `--help` lists its parameters, topics and services.
#include "backlash_diagnosis/ros/node_main.h"
#include "backlash_diagnosis/ros/simulator_node.h"

int main(int argc, char** argv) {
  using namespace backlash;
  return node_main(argc, argv, "simulator", simulator_help(),
                   [] { return SimulatorNode(ros::NodeHandle(), ros::NodeHandle("~")).run(); });
}
