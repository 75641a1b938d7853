// SPDX-License-Identifier: BSD-3-Clause
// The exciter node; `--help` lists its parameters, topics and its action.
#include "backlash_diagnosis/ros/node_main.h"

int main(int argc, char** argv) {
  return backlash::ros_bridge::exciter_main(argc, argv);
}
