// SPDX-License-Identifier: BSD-3-Clause
// The torque constant of a single joint from known weights on its lever. It is an arm of one joint: its own
// body and what it carries are fitted in the unit of the channel, u. The moment m l of a weight that is
// known, over the one that is fitted, is the constant k [N m per u]; several weights give a mean by their
// errors.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/findings/identification_report.h"
#include "backlash_diagnosis/identification/fitted_rig.h"
#include "backlash_diagnosis/model/term_text.h"
#include "backlash_diagnosis/model/weight_term.h"
#include "backlash_diagnosis/rig_file/rig_document.h"
#include "backlash_diagnosis/signal/measured_text.h"
#include "backlash_diagnosis/signal/weighted_mean.h"
#include "tools/arm/arm_commands.h"
#include "tools/common/exit_codes.h"
#include "tools/common/record_file.h"
#include "tools/common/weights.h"

namespace backlash::tools {
namespace {

constexpr double kTorqueCutoff = 0.1, kMotionCutoff = 0.2;  // of the sampling rate, and
constexpr double kMostTorqueCutoff = 5,
                 kMostMotionCutoff = 10;               // Hz; choices: those of an arm, where the rate allows
constexpr double kSlow = 0.02, kFrictionSpeed = 0.01;  // of the rms speed; choices: as of an arm
constexpr double kChance = 0.01;                       // of weights that differ by as much; choice

void require_one_inertia(const rig_file::RigFile& file) {
  const model::Rig& rig = file.rig;
  if (!rig.mesh.rigid || rig.link_locked || rig.linear || rig.motor_side)
    throw BadData(
        file.source,
        "--payload: of a single joint the rig file must be one of one inertia (mesh: rigid), rotary and at "
        "the load side; of an arm one with urdf");
}

double rms_speed(const record::Record& record) {
  const std::vector<double>& q = record.column(record::Channel::motor_position);
  double sum = 0;
  for (std::size_t k = 1; k < q.size(); ++k) {
    const double v = (q[k] - q[k - 1]) / (record.time[k] - record.time[k - 1]);
    sum += std::isfinite(v) ? v * v : 0;
  }
  return std::sqrt(sum / double(q.size()));
}

/// A joint about a horizontal axis (y) with a body of the declared inertia.
arm::ArmRig rig_of(const rig_file::RigFile& file, const std::vector<record::Record>& records) {
  arm::ArmRig rig;
  rig.name = file.rig.name;
  rig.channel = record::Channel::motor_torque;
  rig.terms = {arm::DriveTerm::coulomb, arm::DriveTerm::viscous, arm::DriveTerm::offset};
  rig.joints.resize(1);
  rig.joints[0].name = file.rig.joint;
  rig.chain.joints = {{file.rig.joint, "body", Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(),
                       Eigen::Vector3d::UnitY()}};
  arm::Body body;
  body.mass = 1;
  body.inertia = std::max(file.rig.motor.inertia, 1e-6) * Eigen::Matrix3d::Identity();
  rig.chain.links = {arm::parameters_of(body)};
  double rate = std::numeric_limits<double>::infinity(), speed = 0;
  for (const record::Record& record : records) {
    rate = std::min(rate, 1 / record.sampling_interval());
    speed = std::max(speed, rms_speed(record));
  }
  rig.identification = {std::min(kMostMotionCutoff, kMotionCutoff * rate),
                        std::min(kMostTorqueCutoff, kTorqueCutoff * rate), kSlow * speed,
                        kFrictionSpeed * speed};
  return rig;
}

/// Of m c across the axis.
signal::Measured moment_of(const arm::FittedState& state) {
  const Eigen::Vector3d moment(state.payload[1], 0, state.payload[3]);
  const double size = moment.norm();
  const Eigen::Vector3d along = moment / size;
  return {size, std::sqrt(along.dot(state.moment_covariance * along))};
}

/// N m per unit of the channel, by each known weight.
std::vector<signal::Measured> constants_of(const arm::ArmFit& fit,
                                           const std::vector<std::optional<Weight>>& weights) {
  std::vector<signal::Measured> all;
  std::size_t state = 0;
  for (const std::optional<Weight>& weight : weights) {
    if (!weight) continue;
    const signal::Measured moment = moment_of(fit.states[state++]);
    if (!weight->mass) continue;
    const double k = weight->mass->value * *weight->lever / moment.value;
    all.push_back({k, k * std::hypot(moment.standard_error / moment.value,
                                     weight->mass->standard_error / weight->mass->value)});
  }
  return all;
}

/// Their mean, with an error that holds weights which differ by more than theirs.
signal::Measured mean_of(const std::vector<signal::Measured>& constants, std::vector<std::string>& warnings) {
  const signal::WeightedMean mean = signal::weighted_mean(constants);
  if (mean.chance < kChance) {
    std::string each;
    for (const signal::Measured& k : constants) each += (each.empty() ? "" : ", ") + signal::with_error(k);
    warnings.push_back("the weights give torque constants that differ: " + each +
                       " N m per unit; look whether masses and levers are right. The error holds them");
  }
  return mean;
}

signal::Measured times(double factor, const signal::Measured& m) {
  return {factor * m.value, std::fabs(factor) * m.standard_error};
}

/// In the unit of the channel.
identification::Identification found_by(const arm::ArmFit& fit, const rig_file::RigFile& file) {
  identification::Identification found;
  found.rig = file.rig;
  const auto at = [](arm::DriveTerm t) { return std::size_t(t); };
  const Eigen::Index inertia_yy = 7;
  const double error = std::sqrt(std::max(0.0, fit.covariance(inertia_yy, inertia_yy)));
  found.parameters = {{"inertia", {fit.rig.chain.links[0][inertia_yy], error}},
                      {"coulomb", fit.drives[0][at(arm::DriveTerm::coulomb)]},
                      {"viscous", fit.drives[0][at(arm::DriveTerm::viscous)]},
                      {"offset", fit.drives[0][at(arm::DriveTerm::offset)]}};
  found.units = {{"inertia", "kg m^2"}, {"coulomb", "N m"}, {"viscous", "N m s/rad"}, {"offset", "N m"}};
  found.channels["torque"] = {fit.train[0], fit.floor[0]};
  found.rig.motor.inertia = found.parameters["inertia"].value;
  found.rig.motor.viscous_damping = std::max(0.0, found.parameters["viscous"].value);
  found.rig.motor.coulomb_friction = found.parameters["coulomb"].value;
  found.rig.motor.coulomb_asymmetry = found.rig.motor.viscous_asymmetry = 0;
  found.warnings = fit.warnings;
  return found;
}

/// A sin(q + p) of the joint's own body.
std::pair<double, double> gravity_of(const arm::Chain& chain) {
  const arm::Joints rest = arm::Joints::Zero(1);
  const double at_zero = arm::inverse_dynamics(chain, rest, rest, rest)[0],
               at_quarter = arm::inverse_dynamics(chain, arm::Joints::Constant(1, M_PI / 2), rest, rest)[0];
  return {std::hypot(at_zero, at_quarter), std::atan2(at_zero, at_quarter)};
}

std::string fitted_text(const rig_file::RigFile& file, const identification::Identification& found,
                        const signal::Measured& constant, std::pair<double, double> gravity) {
  rig_file::RigDocument document(identification::fitted_rig_text(file, found), file.source);
  document.set(
      "gear_train.motor.torque_constant", constant.value,
      fmt::format("N m per unit of motor_torque, +- {:.2g}, by a known weight: all else here is per unit",
                  constant.standard_error));
  const bool declared = std::any_of(file.rig.terms.begin(), file.rig.terms.end(),
                                    [](const auto& t) { return t->id == model::weight_term(); });
  const auto term =
      model::make_term(model::weight_term(), {{"amplitude", gravity.first}, {"phase", gravity.second}});
  if (declared)
    document.replace_terms([](const std::string& id) { return id == model::weight_term(); },
                           {model::term_text(*term)});
  else
    document.append_terms({model::term_text(*term)}, "identified");
  document.read();
  return document.text();
}

}  // namespace

int weigh_joint(const Arguments& arguments, RecordDoor& door) {
  const rig_file::RigFile file = rig_file::load_rig_file(arguments.text("rig"));
  require_one_inertia(file);
  const std::vector<std::optional<Weight>> weights = weights_of(arguments);
  bool known = false;
  std::vector<std::optional<arm::Carried>> carried;
  for (const std::optional<Weight>& weight : weights) {
    known = known || (weight && weight->mass);
    if (weight && weight->mass && !weight->lever)
      throw UsageError("--payload: of a single joint a weight needs its lever: \"1 kg at 0.15 m\"");
    carried.push_back(weight ? std::make_optional(arm::Carried{{0, std::numeric_limits<double>::quiet_NaN()}})
                             : std::nullopt);
  }
  if (!known) throw UsageError("--payload: one weight at least must be known");
  std::vector<record::Record> records;
  for (const std::string& path : arguments.positionals())
    records.push_back(door.admit(read_record(path, place_of(file)), {}, path));
  const arm::ArmRig rig = rig_of(file, records);
  std::vector<arm::RecordMotions> motions;
  std::vector<std::string> warnings;
  for (std::size_t r = 0; r < records.size(); ++r)
    motions.push_back(arm::motions_of(
        arm::arm_record({{rig.joints[0].name, records[r]}}, rig, arguments.positionals()[r]), rig, warnings));
  const arm::ArmFit fit = arm::fit_records(rig, motions, {}, nullptr, carried);
  const signal::Measured constant = mean_of(constants_of(fit, weights), warnings);
  identification::Identification found = found_by(fit, file);
  found.warnings.insert(found.warnings.end(), warnings.begin(), warnings.end());
  const std::pair<double, double> gravity = gravity_of(fit.rig.chain);
  const std::string text = fitted_text(file, found, constant, gravity);
  for (auto& [name, value] : found.parameters) {
    const double relative =
        std::hypot(value.standard_error / value.value, constant.standard_error / constant.value);
    value = {constant.value * value.value, std::fabs(constant.value * value.value) * relative};
  }
  found.parameters["torque_constant"] = constant;
  found.units["torque_constant"] = "N m per unit of motor_torque";
  found.parameters["gravity_amplitude"] = times(gravity.first, constant);
  found.units["gravity_amplitude"] = "N m";
  identification::ProcedureReport report{"known_weight", arguments.positionals(),
                                         "torque constant " + signal::with_error(constant) + " N m per unit"};
  found.procedures.push_back(report);
  write_text(arguments.text("out"), text);
  write_text(json_beside_out(arguments), door.with_findings(findings::identification_json(
                                             found, arguments.text("rig"), arguments.positionals())));
  findings::print_summary(found, std::cout);
  return fit.contradictions.empty() ? kHealthy : kInconclusive;
}

}  // namespace backlash::tools
