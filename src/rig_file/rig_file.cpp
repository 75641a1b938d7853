// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/rig_file.h"

#include <cmath>
#include <memory>
#include <optional>

#include "backlash_diagnosis/base/digest.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/yaml_problems.h"
#include "backlash_diagnosis/base/yaml_tree.h"
#include "backlash_diagnosis/record/channels.h"
#include "backlash_diagnosis/rig_file/declared_uncertainty.h"
#include "backlash_diagnosis/rig_file/known_values.h"
#include "default_rig.h"

namespace backlash::rig_file {
namespace {

constexpr double kFreeElastic = 0.67;  // theory: of the deflection, of teeth 40 % softer than declared
constexpr double kNormal95 = 1.96;     // standard deviations of 95 %, both ends: theory
constexpr double kLittle = 1e-2;  // of a deflection, and in a second: slopes of its torque, above rounding

/// Where the file does not say how well it knows the elastic deflection that lost_motion subtracts. A mesh of
/// angles is one spring with all that is merged into it, of the stated uncertainty.
double default_uncertainty(const model::Rig& rig, const model::GearTrain& train,
                           const diagnosis::DiagnosisSettings& settings) {
  if (rig.mesh.angular())
    return settings.stiffness_uncertainty > 0 ? 2 * settings.stiffness_uncertainty
                                              : DeclaredUncertainty::kCoupling;
  const double torque = settings.lost_motion->torque, all = train.elastic_deflection(torque);
  const double coupling = rig.input_coupling.rigid ? 0 : torque / rig.input_coupling.stiffness;
  const auto contact = rig.mesh.contact->power_contact();
  return elastic_uncertainty(coupling, std::fmax(0, all - coupling), contact ? contact->exponent : 1);
}

void fill_link(const model::Rig& rig, diagnosis::WaveformSettings& s) {
  using diagnosis::WaveformOutput;
  const model::Coupling& out = rig.output_coupling;
  s.output = out.rigid ? WaveformOutput::link : WaveformOutput::coupled_link;
  s.link_inertia = rig.link.inertia + (out.rigid ? rig.gear.inertia : 0.5 * out.inertia);
  if (rig.link.viscous_damping > 0) s.link_damping = rig.link.viscous_damping;
  s.link_friction = rig.link.coulomb_friction;
}

/// False for a law that the estimator's equations do not have.
bool fill_contact(const model::Mesh& mesh, diagnosis::WaveformSettings& s) {
  const std::optional<model::PowerContact> contact = mesh.contact->power_contact();
  if (!contact || mesh.contact->needs_impact_speed()) return false;
  s.angular = mesh.angular();
  s.base_radius = mesh.lever();
  s.contact_stiffness = contact->stiffness, s.contact_exponent = contact->exponent;
  const ParameterValues& values = mesh.contact_spec().values;
  if (contact->loss > 0) s.contact_loss = values.at("alpha");
  if (contact->damping > 0) s.contact_damping = contact->damping;
  return true;
}

/// For a rig that the estimator's equations describe; nothing for any other.
std::optional<diagnosis::WaveformSettings> waveform_of(const model::Rig& rig) {
  const model::Coupling &in = rig.input_coupling, &out = rig.output_coupling;
  if (in.rigid || (out.rigid && rig.link_locked) || rig.bearing_at_gear || rig.mesh.rigid ||
      rig.mesh.variation || rig.mesh.pairs || rig.motor_axis_ratio() != 1 || rig.linear ||
      !rig.terms.empty() || rig.coupled)
    return std::nullopt;
  if (rig.pinion.viscous_damping != 0 || rig.gear.viscous_damping != 0 || rig.motor.viscous_asymmetry != 0 ||
      rig.motor.coulomb_asymmetry != 0 || rig.link.viscous_asymmetry != 0 || rig.link.coulomb_asymmetry != 0)
    return std::nullopt;
  diagnosis::WaveformSettings s;
  if (!fill_contact(rig.mesh, s)) return std::nullopt;
  s.motor_inertia = rig.motor.inertia + 0.5 * in.inertia;
  s.pinion_inertia = rig.pinion.inertia + 0.5 * in.inertia;
  if (!out.rigid) s.gear_inertia = rig.gear.inertia + 0.5 * out.inertia;
  s.motor_damping = rig.motor.viscous_damping;
  s.dry_friction = rig.motor.coulomb_friction;
  s.sensor_stiffness = in.stiffness, s.sensor_damping = in.damping;
  if (!out.rigid) s.output_stiffness = out.stiffness, s.output_damping = out.damping;
  if (!rig.link_locked) fill_link(rig, s);
  s.sensor_with_damper = rig.sensor_with_damper;
  for (const double value : {s.motor_inertia, s.pinion_inertia, s.gear_inertia, s.motor_damping,
                             s.sensor_damping, s.output_damping, s.link_inertia})
    if (value <= 0) return std::nullopt;  // a factor of nothing is nothing
  return s;
}

/// N m that declared terms take of the load at rest in the middle of the gap, at the axis of motor_position.
std::function<double(double)> declared_load(const std::shared_ptr<const model::GearTrain>& train,
                                            double ratio) {
  return [train, ratio](double q) {
    return -train->load_forces(model::Motion{0, q / ratio, 0, q / ratio, 0, 0}).net / ratio;
  };
}

/// Teeth of any law about the deflection under a torque, at the axis of motor_position.
diagnosis::GapTraverseSettings::Flank flank_under(const model::ContactLaw& law, double lever, double torque) {
  const double force = torque / lever, depth = law.static_penetration(force);
  const double rate = kLittle * depth;  // m/s, slow: of laws whose damping is no line as well
  const auto damping = [&](double x) { return (law.force(x, rate, 0) - law.force(x, 0, 0)) / rate; };
  const auto power = [&](const auto& of) {
    return std::log(of(depth * (1 + kLittle)) / of(depth * (1 - kLittle))) /
           std::log((1 + kLittle) / (1 - kLittle));
  };
  return {force / depth * lever * lever, damping(depth) * lever * lever,
          power([&](double x) { return law.force(x, 0, 0); }), power(damping)};
}

/// The same, with its values at the axis of motor_position.
std::optional<diagnosis::GapTraverseSettings> gap_traverse_of(
    const model::Rig& rig, const std::shared_ptr<const model::GearTrain>& train) {
  // Where the load is shown at its gear, a shaft behind that is not between what the encoders show.
  const bool on_gear = rig.output_coupling.rigid || rig.bearing_at_gear;
  if (rig.link_locked || !rig.input_coupling.rigid || !on_gear || rig.linear || rig.coupled ||
      rig.mesh.variation || rig.mesh.pairs || rig.mesh.contact->needs_impact_speed())
    return std::nullopt;
  const double ratio = rig.motor_axis_ratio(), lever = rig.mesh.lever() / ratio;
  diagnosis::GapTraverseSettings s;
  s.motor_inertia = rig.motor.inertia + rig.pinion.inertia;
  s.load_inertia = (rig.gear.inertia + rig.output_coupling.inertia + rig.link.inertia) / (ratio * ratio);
  s.motor_damping = rig.motor.viscous_damping + rig.pinion.viscous_damping;
  s.motor_friction = rig.motor.coulomb_friction;
  s.load_friction = rig.link.coulomb_friction / ratio;
  s.load_damping = rig.link.viscous_damping / (ratio * ratio);
  if (const ParameterValues& values = rig.mesh.contact_spec().values;
      rig.mesh.contact_spec().law == "linear") {
    s.flank.stiffness = values.at("stiffness") * lever * lever;
    s.flank.damping = values.at("damping") * lever * lever;
  } else {
    s.flank_under = [law = rig.mesh.contact, lever](double torque) {
      return flank_under(*law, lever, torque);
    };
    s.flank = s.flank_under(1);  // N m: whether it has both
  }
  s.gap = rig.backlash_angle(rig.mesh.backlash);
  s.motor_turn = 2 * M_PI / (rig.motor_side ? 1 : rig.reduction_ratio);
  if (!rig.mesh.angular()) s.base_radius = 1 / rig.backlash_angle(1);
  for (const double value : {s.motor_inertia, s.load_inertia, s.flank.stiffness, s.flank.damping})
    if (!(value > 0)) return std::nullopt;
  if (rig.terms.empty()) return s;
  s.load_torque = declared_load(train, ratio);
  s.motor_torque = [train, ratio](double q) {
    return -train->motor_forces(model::Motion{0, q / ratio, 0, q / ratio, 0, 0}).net / ratio;
  };
  return s;
}

/// What the estimators need to know of the rig.
void fill_from_rig(const model::Rig& rig, diagnosis::DiagnosisSettings& settings) {
  const auto train = std::make_shared<model::GearTrain>(rig);  // refuses what cannot move
  if (rig.mesh.rigid) {                                        // nothing that could have play
    if (settings.lost_motion) settings.lost_motion->elastic_uncertainty = 0;
    return;
  }
  const auto deflection = [train](double torque) { return train->elastic_deflection(torque); };
  const double base_radius = rig.mesh.angular() ? kNaN : 1 / rig.backlash_angle(1);
  if (settings.lost_motion) {
    settings.lost_motion->elastic_deflection = deflection;
    settings.lost_motion->base_radius = base_radius;
    if (std::isnan(settings.lost_motion->elastic_uncertainty))
      settings.lost_motion->elastic_uncertainty = default_uncertainty(rig, *train, settings);
  }
  settings.waveform = waveform_of(rig);
  settings.gap_traverse = gap_traverse_of(rig, train);
  const model::Coupling& coupling = rig.input_coupling;
  const double motor = rig.motor.inertia + 0.5 * coupling.inertia;
  const double pinion = rig.pinion.inertia + 0.5 * coupling.inertia;
  diagnosis::PositionDifferenceSettings& difference = settings.position_difference.emplace();
  difference.elastic_deflection = deflection;
  if (settings.stiffness_uncertainty > 0) difference.elastic_uncertainty = 2 * settings.stiffness_uncertainty;
  difference.motor_inertia = coupling.rigid ? motor + pinion : motor;
  diagnosis::MomentumTransferSettings& momentum = settings.momentum_transfer.emplace();
  momentum.motor_inertia = difference.motor_inertia;
  momentum.motor_damping = rig.motor.viscous_damping;
  momentum.motor_friction = rig.motor.coulomb_friction;
  if (!rig.link_locked) momentum.elastic_uncertainty = kFreeElastic;
  difference.output_locked = momentum.output_locked = rig.link_locked;
  momentum.flank_deflection = deflection;
  if (!coupling.rigid) {
    const double stiffness = coupling.stiffness;
    momentum.pinion_inertia = pinion;
    momentum.coupling_stiffness = stiffness;
    momentum.flank_deflection = [train, stiffness](double torque) {
      return train->elastic_deflection(torque) - torque / stiffness;
    };
  }
  const double ratio = rig.motor_axis_ratio();
  difference.load_ratio = momentum.load_ratio = ratio;
  difference.load_inertia =
      (rig.gear.inertia + rig.output_coupling.inertia + rig.link.inertia) / (ratio * ratio);
  difference.load_damping = rig.link.viscous_damping / (ratio * ratio);
  difference.load_friction = rig.link.coulomb_friction / ratio;
  if (!rig.terms.empty()) difference.load_torque = declared_load(train, ratio);
  difference.encoder_skew = rig.encoder_skew;
  difference.base_radius = momentum.base_radius = base_radius;
}

/// position_difference knows the deflection as well as the file knows the stiffness of sensor and contact,
/// momentum_transfer the motor's side as well.
void use_spread(RigFile& file) {
  const diagnosis::WaveformSpread& spread = file.diagnosis.waveform->spread;
  diagnosis::MomentumSpread& momentum = file.diagnosis.momentum_transfer->spread;
  momentum.motor_inertia = spread.motor_inertia, momentum.pinion_inertia = spread.pinion_inertia;
  momentum.coupling_stiffness = spread.sensor_stiffness, momentum.motor_damping = spread.motor_damping;
  momentum.flank_deflection = spread.contact_stiffness / file.diagnosis.waveform->contact_exponent;
  momentum.motor_friction = std::isnan(spread.dry_friction)
                                ? diagnosis::WaveformSpread::kDryFriction
                                : spread.dry_friction / file.simulation.excitation.amplitude;
  diagnosis::PositionDifferenceSettings& difference = *file.diagnosis.position_difference;
  const double torque = file.simulation.excitation.amplitude, all = difference.elastic_deflection(torque);
  if (!(all > 0)) return;
  const double coupling = torque / file.rig.input_coupling.stiffness, flank = std::fmax(0, all - coupling);
  const double exponent = file.diagnosis.waveform->contact_exponent;
  const double softest = std::expm1(kNormal95 * spread.contact_stiffness / exponent);
  difference.declared_uncertainty =
      (std::expm1(kNormal95 * spread.sensor_stiffness) * coupling + softest * flank) / all;
}

}  // namespace

double elastic_uncertainty(double coupling, double flank, double exponent) {
  using Known = DeclaredUncertainty;
  const double softest = std::pow(Known::kContactFactor, 1 / exponent) - 1;
  const double all = coupling + flank;
  return all > 0 ? (Known::kCoupling * coupling + softest * flank) / all : 0;
}

model::Rig with_machine(model::Rig rig, const diagnosis::WaveformSettings& machine) {
  model::Coupling &in = rig.input_coupling, &out = rig.output_coupling;
  rig.motor.inertia = std::fmax(0, machine.motor_inertia - 0.5 * in.inertia);
  rig.pinion.inertia = std::fmax(0, machine.pinion_inertia - 0.5 * in.inertia);
  rig.motor.viscous_damping = machine.motor_damping;
  rig.motor.coulomb_friction = machine.dry_friction;
  in.stiffness = machine.sensor_stiffness, in.damping = machine.sensor_damping;
  using diagnosis::WaveformOutput;
  if (machine.output != WaveformOutput::link) {
    rig.gear.inertia = std::fmax(0, machine.gear_inertia - 0.5 * out.inertia);
    out.stiffness = machine.output_stiffness, out.damping = machine.output_damping;
  }
  if (machine.output != WaveformOutput::locked) {
    const double moves_along = out.rigid ? rig.gear.inertia : 0.5 * out.inertia;
    rig.link.inertia = std::fmax(0, machine.link_inertia - moves_along);
    if (machine.link_damping > 0) rig.link.viscous_damping = machine.link_damping;
    rig.link.coulomb_friction = machine.link_friction;
  }
  model::ContactSpec contact = rig.mesh.contact_spec();
  contact.values["stiffness"] = machine.contact_stiffness;
  if (machine.contact_loss > 0) contact.values["alpha"] = machine.contact_loss;
  if (machine.contact_damping > 0) contact.values["damping"] = machine.contact_damping;
  rig.mesh.contact = model::make_contact_law(contact.law, contact.values);
  return rig;
}

RigFile rig_file_from_text(const std::string& text, const std::string& source) {
  const YamlReader yaml = YamlReader::from_text(text, source);
  YamlProblems problems;  // all mistakes of the file at once
  RigFile file;
  file.source = source;
  file.text = text;
  file.digest = digest_of(text);
  yaml.integer("schema_version", 1, 1);
  problems.reading([&] { file.rig = model::read_rig(yaml); });
  problems.reading([&] { file.channels = record::read_channels(yaml, file.rig.joint, file.rig.linear); });
  problems.reading([&] {
    file.simulation = simulation::read_simulation_settings(yaml);
    if (yaml.has("excitation"))
      check_excitation(yaml.map("excitation"), file.simulation.excitation, file.rig);
  });
  problems.reading([&] { file.test_runs = read_test_runs(yaml, file.rig); });
  problems.reading([&] { file.diagnosis = diagnosis::read_diagnosis_settings(yaml.map("diagnosis")); });
  problems.reading([&] {
    if (const auto drive = yaml.optional_map("drive"))
      file.drive = read_drive(*drive, file.rig.reduction_ratio);
  });
  if (problems.any()) {
    yaml.ignore("commissioned");  // not read yet
    yaml.finish();
  }
  problems.raise(source);
  if (file.diagnosis.limits && !file.diagnosis.limits->angular && file.rig.mesh.angular())
    yaml.map("diagnosis").fail("limits", "a rig without base_radius needs limits of backlash_angle");
  if (file.simulation.sensors.of(record::Channel::motor_current).declared &&
      std::isnan(file.rig.torque_constant))
    yaml.map("sensors").fail("motor_current", "needs gear_train.motor.torque_constant (N m/A)");
  fill_from_rig(file.rig, file.diagnosis);
  read_known_values(yaml, file);
  if (file.diagnosis.waveform || file.diagnosis.apd) {  // they rest on both
    yaml.map("excitation");
    yaml.map("sensors");
  }
  problems.raise(source);
  if (file.diagnosis.waveform) use_spread(file);
  yaml.finish();
  problems.raise(source);
  if (file.diagnosis.position_difference)
    file.diagnosis.position_difference->output_torque_reversed =
        file.simulation.sensors.of(record::Channel::output_torque).reversed;
  return file;
}

RigFile load_rig_file(const std::string& path) {
  return rig_file_from_text(read_start(path, kLargestYaml + 1), path);  // one more than the parser takes
}

bool is_urdf(const std::string& path) {
  const std::string start = read_start(path, 4096);
  const std::size_t first = start.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  return first != std::string::npos && start[first] == '<';
}

bool is_arm_rig(const std::string& path) {
  if (is_urdf(path))
    throw BadData(path,
                  "is a URDF: what is needed is a rig file, which names it and describes the drives; "
                  "plan_motion writes one (--write-rig) to begin with");
  return YamlReader::from_file(path).has("urdf");
}

RigFile default_rig_file() {
  return rig_file_from_text(kDefaultRig, "built-in sarkar_1997");
}

}  // namespace backlash::rig_file
