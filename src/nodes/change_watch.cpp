// SPDX-License-Identifier: BSD-3-Clause
// The change_watch node; `--help` lists its parameters and topics.
#include "backlash_diagnosis/ros/node_main.h"

int main(int argc, char** argv) {
  return backlash::ros_bridge::change_watch_main(argc, argv);
}
