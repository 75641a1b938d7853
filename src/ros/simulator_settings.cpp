// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/simulator_settings.h"

#include <fmt/format.h>
#include <ros/names.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/parameters.h"
#include "backlash_diagnosis/ros/rig_folder.h"

namespace backlash::ros_bridge {
namespace {

constexpr double kSlowest = 1e-3;  // real time factor
constexpr double kFastest = 1e3;
constexpr double kLongestHold = 1e3;  // s, of a torque_command
constexpr double kLongest = 1e9;      // s, keeps sample numbers and nanoseconds far within 64 bits

/// Reads the parameters that override the rig file and remembers which were given: those below a scope ("" or
/// "JOINT/") of one joint.
class Overrides {
 public:
  Overrides(Parameters& parameters, rig_file::RigFile& file) : parameters_(parameters), file_(file) {}

  void apply(const std::string& scope) {
    scope_ = scope;
    run();
    backlash();
    sensors();
    excitation("excitation_amplitude", Range::not_negative(), file_.simulation.excitation.amplitude);
    excitation("excitation_frequency", Range::positive(), file_.simulation.excitation.frequency);
  }

  void joint() {
    std::string& joint = file_.rig.joint;
    joint = parameters_.text("joint", joint);
    if (joint.empty()) throw InvalidParameter("~joint", "''", "must not be empty");
    if (parameters_.has("joint")) given_.push_back("joint = " + printable(joint));
  }

  /// The n-th joint of a list; noise of several joints must not be the same.
  void joint(const std::string& name, int n) {
    if (file_.channels.declared && file_.rig.joint != name)
      throw InvalidParameter("~joints", name,
                             "shares a rig file whose channels are of joint " + file_.rig.joint);
    file_.rig.joint = name;
    given_.push_back("joint = " + printable(name));
    if (parameters_.has(name + "/seed") || n == 0) return;
    file_.simulation.sensors.seed += n;
    given_.push_back(fmt::format("seed = {}", file_.simulation.sensors.seed));
  }

  std::string description() const {
    std::string source = "# source: " + printable(file_.source, 1000);
    if (!given_.empty()) source += "; changed by parameters: " + joined(given_);
    return source + "\n" + file_.text;
  }

 private:
  bool given(const std::string& name) {
    if (!parameters_.has(scope_ + name)) parameters_.allow(scope_ + name);
    return parameters_.has(scope_ + name);
  }

  void number(const std::string& name, const Range& range, double& value) {
    if (!given(name)) return;
    value = parameters_.number(scope_ + name, value, range);
    given_.push_back(name + " = " + to_text(value));
  }

  void run() {
    if (!given("run")) return;
    const std::string name = parameters_.text(scope_ + "run", "");
    try {
      rig_file::apply_test_run(rig_file::find_test_run(file_.test_runs, name), file_);
    } catch (const InvalidParameter& e) {
      throw InvalidParameter("~" + scope_ + "run", e.value(), e.limit());
    }
    given_.push_back("run = " + name);
  }

  void backlash() {
    const bool half = given("half_gap");
    if (given("backlash") && half)
      throw InvalidParameter("~" + scope_ + "half_gap", "given",
                             "cannot be given together with ~" + scope_ + "backlash");
    double& backlash = file_.rig.mesh.backlash;
    double half_gap = backlash / 2;
    number("backlash", Range::not_negative(), backlash);
    number("half_gap", Range::not_negative(), half_gap);
    if (half) backlash = 2 * half_gap;
  }

  void sensors() {
    simulation::SensorsSettings& sensors = file_.simulation.sensors;
    const Range rates = Range::between(1e-3, 1e6);
    if (scope_.empty())
      number("sampling_rate", rates, sensors.sampling_rate);  // one message holds all joints
    if (!rates.contains(sensors.sampling_rate))
      throw InvalidParameter("sensors.sampling_rate", sensors.sampling_rate, rates.text());
    if (!given("seed")) return;
    sensors.seed = parameters_.integer(scope_ + "seed", 0, 0, std::numeric_limits<int>::max());
    given_.push_back(fmt::format("seed = {}", sensors.seed));
  }

  void excitation(const std::string& name, const Range& range, double& value) {
    const std::string& type = file_.simulation.excitation.type;
    const bool applies = type == "square" || type == "sine";
    if (given(name) && !applies)
      throw InvalidParameter("~" + scope_ + name, "given",
                             "is for square and sine excitation, not for " + type);
    number(name, range, value);
  }

  Parameters& parameters_;
  rig_file::RigFile& file_;
  std::string scope_;
  std::vector<std::string> given_;
};

rig_file::RigFile read_rig_parameter(Parameters& parameters, const std::string& name,
                                     const rig_file::RigFile& absent) {
  if (!parameters.has(name)) {
    parameters.allow(name);
    return absent;
  }
  const std::string path = parameters.text(name, "");
  try {
    return rig_file::load_rig_file(path);
  } catch (const MissingInput& e) {
    throw MissingInput("~" + name + ": " + e.what());
  } catch (const Error& e) {
    throw BadData("~" + name, e.what());
  }
}

JointSettings read_joint(Parameters& parameters, const rig_file::RigFile& common) {
  JointSettings joint{common, {}};
  Overrides overrides(parameters, joint.file);
  overrides.apply("");
  overrides.joint();
  joint.description = overrides.description();
  return joint;
}

void require_topic_name(const std::string& joint) {
  std::string why;
  if (joint.empty() || joint.find('/') != std::string::npos || !ros::names::validate(joint, why))
    throw InvalidParameter("~joints", printable(joint), "must be names of topics, without '/'");
}

using RigFiles = std::map<std::string, rig_file::RigFile>;

const rig_file::RigFile& rig_of(const std::string& joint, const RigFiles& by_joint,
                                const rig_file::RigFile& common) {
  if (by_joint.empty()) return common;
  const auto found = by_joint.find(joint);
  if (found == by_joint.end()) throw InvalidParameter("~joints", joint, "has no rig file in ~rig_folder");
  return found->second;
}

/// `by_joint`: of ~rig_folder; else empty.
std::vector<JointSettings> read_joints(Parameters& parameters, const RigFiles& by_joint,
                                       const rig_file::RigFile& common) {
  if (parameters.has("joint"))
    throw InvalidParameter("~joint", "given", "cannot be given together with ~joints or ~rig_folder");
  std::vector<std::string> wanted;
  for (const auto& [joint, file] : by_joint) wanted.push_back(joint);
  std::vector<JointSettings> joints;
  std::set<std::string> names;
  for (const std::string& name : parameters.texts("joints", wanted)) {
    require_topic_name(name);
    if (!names.insert(name).second) throw InvalidParameter("~joints", name, "is named twice");
    JointSettings joint{read_rig_parameter(parameters, name + "/rig", rig_of(name, by_joint, common)), {}};
    Overrides overrides(parameters, joint.file);
    overrides.apply("");
    overrides.joint(name, int(joints.size()));
    overrides.apply(name + "/");
    parameters.allow(name + "/live");
    joint.description = overrides.description();
    const double rate = joint.file.simulation.sensors.sampling_rate;
    if (!joints.empty() && rate != joints.front().file.simulation.sensors.sampling_rate)
      throw InvalidParameter("~" + name + "/rig", to_text(rate) + " Hz",
                             "must have the sampling rate of the other joints; ~sampling_rate is for all");
    joints.push_back(std::move(joint));
  }
  return joints;
}

double read_real_time_factor(Parameters& parameters) {
  const double factor = parameters.number("real_time_factor", 1, Range::between(0, kFastest));
  if (factor > 0 && factor < kSlowest)
    throw InvalidParameter("~real_time_factor", factor, "must be 0 or at least " + to_text(kSlowest));
  return factor;
}

long read_samples(Parameters& parameters, double sampling_rate) {
  const double duration = parameters.number("duration", 0, Range::between(0, kLongest));
  const long samples = std::lround(duration * sampling_rate);
  if (duration > 0 && samples == 0)
    throw InvalidParameter("~duration", duration, "is shorter than half a sampling interval");
  return samples;
}

}  // namespace

SimulatorSettings read_simulator_settings(const ros::NodeHandle& private_handle) {
  Parameters parameters(private_handle);
  parameters.allow("live");
  SimulatorSettings settings;
  const rig_file::RigFile common = read_rig_parameter(parameters, "rig", rig_file::default_rig_file());
  const std::string folder = parameters.text("rig_folder", "");
  if (!folder.empty() && parameters.has("rig"))
    throw InvalidParameter("~rig_folder", folder, "cannot be given beside ~rig");
  const RigFiles by_joint = folder.empty() ? RigFiles() : load_rig_folder(folder);
  parameters.allow("joints");
  settings.named_joints = parameters.has("joints") || !folder.empty();
  if (settings.named_joints)
    settings.joints = read_joints(parameters, by_joint, common);
  else
    settings.joints = {read_joint(parameters, common)};
  const double timeout = parameters.number("torque_timeout", 0, Range::between(0, kLongestHold));
  for (JointSettings& joint : settings.joints) joint.torque_timeout = timeout;
  settings.real_time_factor = read_real_time_factor(parameters);
  settings.samples = read_samples(parameters, settings.joints.front().file.simulation.sensors.sampling_rate);
  settings.publish_clock = parameters.boolean("publish_clock", settings.real_time_factor != 1);
  settings.wait_for_subscriber = parameters.boolean("wait_for_subscriber", false);
  settings.diagnostic_period = parameters.number("diagnostic_period", 1, Range::positive());
  parameters.finish();
  return settings;
}

}  // namespace backlash::ros_bridge
