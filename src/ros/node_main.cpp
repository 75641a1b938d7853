// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/node_main.h"

#include <ros/console.h>
#include <ros/init.h>
#include <ros/node_handle.h>

#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/master_watch.h"

namespace backlash::ros_bridge {
namespace {

// As in sysexits.h, like the offline commands.
constexpr int kUsage = 64, kBadData = 65, kMissingInput = 66, kInternal = 70, kCannotWrite = 73;

int fatal(const std::exception& e, int code) {
  ROS_FATAL_STREAM(e.what());
  return code;
}

int guarded(const std::function<int()>& run) {
  try {
    return run();
  } catch (const InvalidParameter& e) {
    return fatal(e, kUsage);
  } catch (const BadData& e) {
    return fatal(e, kBadData);
  } catch (const IntegrationError& e) {  // of a machine that the rig file states
    return fatal(e, kBadData);
  } catch (const MissingInput& e) {
    return fatal(e, kMissingInput);
  } catch (const CannotWrite& e) {
    return fatal(e, kCannotWrite);
  } catch (const std::exception& e) {
    return fatal(e, kInternal);
  }
}

}  // namespace

int node_main(int argc, char** argv, const std::string& name, const char* help,
              const std::function<int()>& run) {
  for (int i = 1; i < argc; ++i)
    if (argv[i] == std::string("--help") || argv[i] == std::string("-h")) {
      std::cout << help;
      return 0;
    }
  const int refused = guarded([&] {
    ros::init(argc, argv, name);
    if (argc > 1) throw InvalidParameter("argument", argv[1], "is not understood; see --help");
    return 0;
  });
  if (refused) return refused;
  // The log closes with the last handle; the reason for an early end must still get into it.
  const ros::NodeHandle alive;
  const MasterWatch watch;
  return guarded(run);
}

}  // namespace backlash::ros_bridge
