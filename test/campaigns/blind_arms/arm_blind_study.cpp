// SPDX-License-Identifier: BSD-3-Clause
// How often the answers of this package are right, unknown or wrong on arms that its own simulator has not
// made: MuJoCo moves the chain; drives, teeth, friction and sensors are written anew (world.h, record.h),
// with bristles in motor and link, teeth of three laws, encoders out of centre, coloured noise. Draws arms,
// writes URDF, rig file, records and truth, asks, and counts. Deterministic for its arguments.
#include <boost/program_options.hpp>
#include <iostream>

#include "backlash_diagnosis/base/scratch_folder.h"
#include "blind_arm.h"
#include "flaws.h"
#include "questions.h"

namespace blind_arms {
namespace {

namespace po = boost::program_options;

std::string listed(const std::vector<Kind>& all) {
  std::string text;
  for (const Kind& kind : all) text += "  " + kind.name + ": " + kind.help + "\n";
  return text;
}

/// False: help was asked for and given.
bool read_options(int argc, char** argv, Options& o) {
  po::options_description options("arm_blind_study: what is reported of arms that MuJoCo moves");
  auto add = options.add_options();
  add("help", "this text");
  add("ask", po::value(&o.ask)->default_value(o.ask),
      "encoders: plays by two encoders; motors: plays by the motors' encoders alone; changes, "
      "effects: trace_residual");
  add("kind", po::value(&o.kind)->default_value(o.kind),
      "what the rig file does not know; all: plays take each in turn, changes and effects all of an arm");
  add("seed", po::value(&o.seed)->default_value(o.seed), "of the first arm; the others follow");
  add("arms", po::value(&o.arms)->default_value(o.arms), "how many");
  add("duration", po::value(&o.duration)->default_value(o.duration), "of each record [s]");
  add("out", po::value(&o.out), "folder to keep the files in: records that are there are not made again");
  add("json", po::value(&o.json), "file that each answer is appended to, a line each");
  po::variables_map given;
  po::store(po::parse_command_line(argc, argv, options), given);
  po::notify(given);
  if (given.count("help") == 0) return true;
  std::cout << options << "\nkinds, of plays:\n"
            << listed(kinds()) << "of changes:\n"
            << listed(changes()) << "of effects:\n"
            << listed(flaws());
  return false;
}

int run(Options options) {
  const backlash::ScratchFolder scratch;
  if (options.out.empty()) options.out = scratch.path("arms");
  if (options.ask == "changes" || options.ask == "effects") return ask_changes(options);
  if (options.ask == "encoders" || options.ask == "motors") return ask_plays(options);
  throw std::invalid_argument("--ask " + options.ask + ": not known");
}

}  // namespace
}  // namespace blind_arms

/// 0: nothing was wrong, 2: something was.
int main(int argc, char** argv) {
  try {
    blind_arms::Options options;
    return blind_arms::read_options(argc, argv, options) && blind_arms::run(options) > 0 ? 2 : 0;
  } catch (const std::exception& error) {
    std::cerr << "arm_blind_study: " << error.what() << '\n';
    return 64;
  }
}
