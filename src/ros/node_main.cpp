#include "backlash_diagnosis/ros/node_main.h"

#include <ros/console.h>
#include <ros/init.h>

#include <iostream>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

// As in sysexits.h, like the offline commands.
constexpr int kUsage = 64, kBadData = 65, kMissingInput = 66, kInternal = 70;

int fatal(const std::exception& e, int code) {
  ROS_FATAL_STREAM(e.what());
  return code;
}

}  // namespace

int node_main(int argc, char** argv, const std::string& name, const char* help,
              const std::function<int()>& run) {
  for (int i = 1; i < argc; ++i)
    if (argv[i] == std::string("--help") || argv[i] == std::string("-h")) {
      std::cout << help;
      return 0;
    }
  try {
    ros::init(argc, argv, name);
    if (argc > 1) throw InvalidParameter("argument", argv[1], "is not understood; see --help");
    return run();
  } catch (const InvalidParameter& e) {
    return fatal(e, kUsage);
  } catch (const BadData& e) {
    return fatal(e, kBadData);
  } catch (const MissingInput& e) {
    return fatal(e, kMissingInput);
  } catch (const std::exception& e) {
    return fatal(e, kInternal);
  }
}

}  // namespace backlash
