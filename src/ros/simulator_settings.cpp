#include "backlash_diagnosis/ros/simulator_settings.h"

#include <cmath>
#include <limits>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/parameters.h"

namespace backlash {
namespace {

constexpr double kSlowest = 1e-3;  // real time factor
constexpr double kFastest = 1e3;
constexpr double kLongest = 1e9;  // s, keeps sample numbers and nanoseconds far within 64 bits

/// Reads the parameters that override the rig file and remembers which were given.
class Overrides {
 public:
  Overrides(Parameters& parameters, RigFile& file) : parameters_(parameters), file_(file) {}

  void apply() {
    run();
    joint();
    backlash();
    sensors();
    excitation("excitation_amplitude", Range::not_negative(), file_.simulation.excitation.amplitude);
    excitation("excitation_frequency", Range::positive(), file_.simulation.excitation.frequency);
  }

  std::string description() const {
    std::string source = "# source: " + printable(file_.source, 1000);
    if (!given_.empty()) source += "; changed by parameters: " + joined(given_);
    return source + "\n" + file_.text;
  }

 private:
  void number(const std::string& name, const Range& range, double& value) {
    if (!parameters_.has(name)) return parameters_.allow(name);
    value = parameters_.number(name, value, range);
    given_.push_back(name + " = " + to_text(value));
  }

  void joint() {
    std::string& joint = file_.rig.joint;
    joint = parameters_.text("joint", joint);
    if (joint.empty()) throw InvalidParameter("~joint", "''", "must not be empty");
    if (parameters_.has("joint")) given_.push_back("joint = " + printable(joint));
  }

  void run() {
    if (!parameters_.has("run")) return parameters_.allow("run");
    const std::string name = parameters_.text("run", "");
    try {
      apply_test_run(find_test_run(file_.test_runs, name), file_);
    } catch (const InvalidParameter& e) {
      throw InvalidParameter("~run", e.value(), e.limit());
    }
    given_.push_back("run = " + name);
  }

  void backlash() {
    if (parameters_.has("backlash") && parameters_.has("half_gap"))
      throw InvalidParameter("~half_gap", "given", "cannot be given together with ~backlash");
    double& backlash = file_.rig.mesh.backlash;
    double half_gap = backlash / 2;
    number("backlash", Range::not_negative(), backlash);
    number("half_gap", Range::not_negative(), half_gap);
    if (parameters_.has("half_gap")) backlash = 2 * half_gap;
  }

  void sensors() {
    SensorsSettings& sensors = file_.simulation.sensors;
    const Range rates = Range::between(1e-3, 1e6);
    number("sampling_rate", rates, sensors.sampling_rate);
    if (!rates.contains(sensors.sampling_rate))
      throw InvalidParameter("sensors.sampling_rate", sensors.sampling_rate, rates.text());
    if (!parameters_.has("seed")) return parameters_.allow("seed");
    sensors.seed = parameters_.integer("seed", 0, 0, std::numeric_limits<int>::max());
    given_.push_back("seed = " + std::to_string(sensors.seed));
  }

  void excitation(const std::string& name, const Range& range, double& value) {
    const std::string& type = file_.simulation.excitation.type;
    const bool applies = type == "square" || type == "sine";
    if (parameters_.has(name) && !applies)
      throw InvalidParameter("~" + name, "given", "is for square and sine excitation, not for " + type);
    number(name, range, value);
  }

  Parameters& parameters_;
  RigFile& file_;
  std::vector<std::string> given_;
};

RigFile read_rig_parameter(Parameters& parameters) {
  if (!parameters.has("rig")) {
    parameters.allow("rig");
    return default_rig_file();
  }
  const std::string path = parameters.text("rig", "");
  try {
    return load_rig_file(path);
  } catch (const MissingInput& e) {
    throw MissingInput(std::string("~rig: ") + e.what());
  } catch (const Error& e) {
    throw BadData("~rig", e.what());
  }
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
  SimulatorSettings settings;
  settings.file = read_rig_parameter(parameters);
  Overrides overrides(parameters, settings.file);
  overrides.apply();
  settings.description = overrides.description();
  settings.real_time_factor = read_real_time_factor(parameters);
  settings.samples = read_samples(parameters, settings.file.simulation.sensors.sampling_rate);
  settings.publish_clock = parameters.boolean("publish_clock", settings.real_time_factor != 1);
  settings.wait_for_subscriber = parameters.boolean("wait_for_subscriber", false);
  settings.diagnostic_period = parameters.number("diagnostic_period", 1, Range::positive());
  parameters.finish();
  return settings;
}

}  // namespace backlash
