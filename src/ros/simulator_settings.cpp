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
#include "backlash_diagnosis/base/loaded_function.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/parameters.h"
#include "backlash_diagnosis/ros/rig_folder.h"
#include "given_parameters.h"

namespace backlash::ros_bridge {
namespace {

constexpr double kSlowest = 1e-3;  // real time factor
constexpr double kFastest = 1e3;
constexpr double kLongestHold = 1e3;  // s, of a torque_command
constexpr double kLongest = 1e9;      // s, keeps sample numbers and nanoseconds far within 64 bits

/// Reads the parameters that override the rig file of one joint.
class Overrides {
 public:
  Overrides(Parameters& parameters, rig_file::RigFile& file)
      : parameters_(parameters), file_(file), given_(parameters) {}

  void apply(const std::string& scope) {
    given_.set_scope(scope);
    run();
    backlash();
    given_.sensors(file_.simulation.sensors);
    excitation("excitation_amplitude", Range::not_negative(), file_.simulation.excitation.amplitude);
    excitation("excitation_frequency", Range::positive(), file_.simulation.excitation.frequency);
  }

  void joint() {
    std::string& joint = file_.rig.joint;
    joint = parameters_.text("joint", joint);
    if (joint.empty()) throw InvalidParameter("~joint", "''", "must not be empty");
    if (parameters_.has("joint")) given_.add("joint = " + printable(joint));
  }

  /// The n-th joint of a list; noise of several joints must not be the same.
  void joint(const std::string& name, int n) {
    if (file_.channels.declared && file_.rig.joint != name)
      throw InvalidParameter("~joints", name,
                             "shares a rig file whose channels are of joint " + file_.rig.joint);
    file_.rig.joint = name;
    given_.add("joint = " + printable(name));
    if (parameters_.has(name + "/seed") || n == 0) return;
    file_.simulation.sensors.seed += n;
    given_.add(fmt::format("seed = {}", file_.simulation.sensors.seed));
  }

  std::string description() const { return given_.description(file_.source, file_.text); }

 private:
  void run() {
    if (!given_.has("run")) return;
    const std::string name = parameters_.text(given_.scope() + "run", "");
    try {
      rig_file::apply_test_run(rig_file::find_test_run(file_.test_runs, name), file_);
    } catch (const InvalidParameter& e) {
      throw InvalidParameter("~" + given_.scope() + "run", e.value(), e.limit());
    }
    given_.add("run = " + name);
  }

  void backlash() {
    const bool half = given_.has("half_gap");
    if (given_.has("backlash") && half)
      throw InvalidParameter("~" + given_.scope() + "half_gap", "given",
                             "cannot be given together with ~" + given_.scope() + "backlash");
    double& backlash = file_.rig.mesh.backlash;
    double half_gap = backlash / 2;
    given_.number("backlash", Range::between(0, file_.rig.mesh.most_backlash()), backlash);
    given_.number("half_gap", Range::not_negative(), half_gap);
    if (half) backlash = 2 * half_gap;
  }

  void excitation(const std::string& name, const Range& range, double& value) {
    const std::string& type = file_.simulation.excitation.type;
    const bool applies = type == "square" || type == "sine";
    if (given_.has(name) && !applies)
      throw InvalidParameter("~" + given_.scope() + name, "given",
                             "is for square and sine excitation, not for " + type);
    given_.number(name, range, value);
  }

  Parameters& parameters_;
  rig_file::RigFile& file_;
  GivenParameters given_;
};

rig_file::RigFile read_rig_parameter(Parameters& parameters, const std::string& name,
                                     const rig_file::RigFile& absent) {
  if (!parameters.has(name)) {
    parameters.allow(name);
    return absent;
  }
  const std::string path = parameters.text(name, "");
  return of_parameter(name, [&path] { return rig_file::load_rig_file(path); });
}

JointSettings read_joint(Parameters& parameters, const rig_file::RigFile& common) {
  JointSettings joint{common, {}};
  Overrides overrides(parameters, joint.file);
  overrides.apply("");
  overrides.joint();
  joint.description = overrides.description();
  return joint;
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
    if (!is_topic_name(name))
      throw InvalidParameter("~joints", printable(name), "must be names of topics, without '/'");
    if (!names.insert(name).second) throw InvalidParameter("~joints", name, "is named twice");
    JointSettings joint{read_rig_parameter(parameters, name + "/rig", rig_of(name, by_joint, common)), {}};
    Overrides overrides(parameters, joint.file);
    overrides.apply("");
    overrides.joint(name, int(joints.size()));
    overrides.apply(name + "/");
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

void read_rigs_of_joints(Parameters& parameters, SimulatorSettings& settings) {
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
  settings.rig = settings.joints.front().file.rig.name;
  settings.sampling_rate = settings.joints.front().file.simulation.sensors.sampling_rate;
}

bool is_arm(Parameters& parameters) {
  if (!parameters.has("rig")) return false;
  const std::string path = parameters.text("rig", "");
  return of_parameter("rig", [&path] { return rig_file::is_arm_rig(path); });
}

}  // namespace

bool is_topic_name(const std::string& joint) {
  std::string why;
  return !joint.empty() && joint.find('/') == std::string::npos && ros::names::validate(joint, why);
}

SimulatorSettings read_simulator_settings(const ros::NodeHandle& private_handle) {
  Parameters parameters(private_handle);
  parameters.allow("live");
  SimulatorSettings settings;
  const double timeout = parameters.number("torque_timeout", 0, Range::between(0, kLongestHold));
  if (is_arm(parameters)) {
    loaded_function<decltype(backlash_read_arm)>("backlash_diagnosis_ros_arm", "backlash_read_arm")(
        parameters, timeout, settings.arm.emplace());
    settings.rig = settings.arm->rig;
    settings.sampling_rate = settings.arm->sampling_rate;
  } else {
    read_rigs_of_joints(parameters, settings);
    for (JointSettings& joint : settings.joints) joint.torque_timeout = timeout;
  }
  settings.real_time_factor = read_real_time_factor(parameters);
  settings.samples = read_samples(parameters, settings.sampling_rate);
  settings.publish_clock = parameters.boolean("publish_clock", settings.real_time_factor != 1);
  settings.wait_for_subscriber = parameters.boolean("wait_for_subscriber", false);
  settings.diagnostic_period = parameters.number("diagnostic_period", 1, Range::positive());
  parameters.finish();
  return settings;
}

}  // namespace backlash::ros_bridge
