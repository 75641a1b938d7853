// SPDX-License-Identifier: BSD-3-Clause
// The simulator node; `--help` lists its parameters, topics and services.
#include "backlash_diagnosis/ros/node_main.h"

int main(int argc, char** argv) {
  return backlash::ros_bridge::simulator_main(argc, argv);
}
