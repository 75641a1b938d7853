// SPDX-License-Identifier: BSD-3-Clause
// The rig file of one joint: one inertia, or two where an encoder of the load, a URDF or a person says how
// the inertia is shared.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_draft/draft.h"
#include "rig_text.h"

namespace backlash::rig_draft {
namespace {

using record::Channel;

// Where neither record nor person says more: values to begin with, which a fit may move by factors. Choices.
constexpr double kRotorShare = 0.5;    // of the inertia: in the middle between none and all
constexpr double kLeastShare = 0.05;   // of the inertia, that a rotor or a load has
constexpr double kLoadFriction = 0.1;  // of the friction, behind the gap: seals and bearings of the link
constexpr double kYield = 0.5;         // of the range of motor minus load position: the rest is play
constexpr double kUsualYield = 1e-3;   // rad, of a gear under its usual torque: one to five arc minutes
constexpr double kDamped = 0.1;        // of critical: gears and teeth
constexpr double kUnlike = 1.5;        // an effort whose weight differs so from that of the URDF is no torque
constexpr double kLightest = 0.02;     // of the torque: a smaller weight is left out

/// The values of the machine at the axis of its joint.
struct Machine {
  double rotor = 0, load = 0;  // kg m^2
  std::string rotor_from, load_from;
  bool rotor_known = true, load_known = true;
  double stiffness = 0, damping = 0, gap = 0;
  std::string stiffness_from;
};

class JointDraft {
 public:
  JointDraft(const SeenJoint& seen, const JointPlace& place, const std::optional<UrdfLoad>& urdf,
             const Given& given)
      : seen_(seen), place_(place), urdf_(urdf), given_(given) {
    ratio_ = given.reduction_ratio.value_or(1);
    if (!seen.load || std::abs(seen.load->motor_turns) == 1) return;
    motor_side_ = true;
    seen_ratio_ = ratio_ = std::abs(seen.load->motor_turns);
  }

  Draft draft() {
    judge_torque();
    share_inertia();
    head();
    channels();
    gear_train();
    rest();
    Draft d;
    d.has_play = two_;
    d.notes = notes_;
    d.to_fill = text_.to_fill();
    d.text = preface() + text_.text();
    return d;
  }

 private:
  bool torque() const { return seen_.torque && seen_.torque->explained >= kTakesTorque; }
  /// Of an inertia at the motor's axis, at the joint's.
  double at_joint() const { return motor_side_ ? ratio_ * ratio_ : 1; }
  double torque_at_joint() const { return (motor_side_ ? ratio_ : 1) * scale_; }

  /// Whether the effort is a torque, by the weight that the URDF says.
  void judge_torque() {
    if (!seen_.torque) {
      notes_.push_back("no torque: it was not recorded or stands still");
      return;
    }
    const SeenTorque& t = *seen_.torque;
    const char* name = t.channel == Channel::motor_torque ? "torque" : "current";
    if (!torque()) {
      notes_.push_back(fmt::format(
          "the {} follows the motion of this joint by {:.0f} % only: it is none of its, or other joints move "
          "it as well (then the rig file of the arm says more: --urdf without --joint)",
          name, 100 * t.explained));
      return;
    }
    notes_.push_back(fmt::format(
        "the {} follows the motion by {:.0f} %: inertia {:.3g}, dry friction {:.3g}, viscous {:.3g}", name,
        100 * t.explained, t.inertia.value, t.coulomb.value, t.viscous.value));
    if (urdf_ && t.weight && urdf_->gravity.amplitude > 0) {
      const double times = urdf_->gravity.amplitude / (t.weight->value * (motor_side_ ? ratio_ : 1));
      if (times > kUnlike || times < 1 / kUnlike) scale_ = times;
    }
    if (scale_ != 1)
      notes_.push_back(
          fmt::format("its weight is that of the URDF where a unit of it is {:.3g} N m: a current, or "
                      "the torque of another shaft",
                      scale_));
    if (t.reversed) notes_.push_back("it works against the motion: its sign is the other one");
  }

  void share_inertia() {
    const double all = torque() ? seen_.torque->inertia.value * at_joint() * scale_ : 0;
    const std::string of_all = torque() ? from_record(seen_.torque->inertia) : "";
    if (!(all > 0) && !urdf_)
      throw CannotIdentify(
          place_.record +
          ": its torque shows no inertia, and no URDF says one: record the torque or the current of "
          "the motor while the joint speeds up and slows down, or give --urdf");
    const bool shown = seen_.load && seen_.load->shows;
    if (seen_.load && !shown)
      notes_.emplace_back(
          "the two encoders differ by no more than their noise: neither a gap nor teeth that yield are seen");
    two_ = shown || urdf_ || given_.rotor_inertia;
    if (!two_) {
      m_.rotor = all, m_.rotor_from = of_all + "; with all that it moves";
      return;
    }
    if (given_.rotor_inertia) m_.rotor = *given_.rotor_inertia * ratio_ * ratio_, m_.rotor_from = "given";
    if (urdf_) m_.load = urdf_->inertia, m_.load_from = "by " + urdf_->file + ", " + urdf_->pose;
    const double least = kLeastShare * all;
    if (m_.load == 0 && m_.rotor == 0) {
      m_.rotor = kRotorShare * all, m_.load = all - m_.rotor;
      m_.rotor_known = false;
      m_.load_from = fmt::format("all inertia {:.4g} {}, less the motor's", all, of_all);
    } else if (m_.rotor == 0) {
      m_.rotor = all - m_.load;
      m_.rotor_known = m_.rotor > least && all > 0;
      m_.rotor_from = fmt::format("all inertia {:.4g} {}, less that of the chain", all, of_all);
      if (!m_.rotor_known) m_.rotor = std::max(least, kLeastShare * m_.load);
    } else if (m_.load == 0) {
      m_.load = all - m_.rotor;
      m_.load_known = m_.load > least;
      m_.load_from = fmt::format("all inertia {:.4g} {}, less the motor's", all, of_all);
      if (!m_.load_known) m_.load = std::max(least, kLeastShare * m_.rotor);
    }
    find_teeth();
  }

  void find_teeth() {
    const double load = torque() ? seen_.torque->load * torque_at_joint()
                                 : m_.load * seen_.acceleration / (motor_side_ ? ratio_ : 1);
    const double loose = seen_.load && seen_.load->shows ? seen_.load->looseness : 0;
    m_.gap = loose > 0 ? (1 - kYield) * loose : kUsualYield;
    m_.stiffness = 2 * load / (loose > 0 ? kYield * loose : 2 * kUsualYield);
    if (!(m_.stiffness > 0)) m_.stiffness = m_.load / kUsualYield;
    m_.stiffness_from =
        loose > 0 ? fmt::format(
                        "from the record, within a factor of 3: motor and load are {:.3g} mrad apart under "
                        "+-{:.3g} N m",
                        1e3 * loose, load)
                  : fmt::format("a gear that yields 1 mrad under {:.3g} N m", load);
    if (given_.stiffness) m_.stiffness = *given_.stiffness, m_.stiffness_from = "given";
    m_.damping = 2 * kDamped * std::sqrt(m_.stiffness * m_.rotor * m_.load / (m_.rotor + m_.load));
  }

  void head() {
    text_.line("schema_version: 1");
    text_.line("name: " + quoted(place_.joint));
    text_.line("joint: " + quoted(place_.joint));
    text_.line("");
  }

  void channels() {
    const bool wrong = scale_ != 1 || (seen_.torque && seen_.torque->reversed);
    const bool turns = seen_.load && seen_.load->motor_turns < 0;
    if (!place_.scalable) {
      if (wrong)
        text_.to_fill(
            fmt::format("the column of the torque: it must be {:.3g} times as large", signed_scale()));
      if (turns) text_.to_fill("the column load_position: it turns against motor_position, turn its sign");
    }
    if (!place_.channels.declared && !(place_.scalable && (wrong || turns))) return;
    text_.line("channels:",
               "where " + std::filesystem::path(place_.record).filename().string() + " has the joint");
    for (const record::ChannelSource& source : place_.channels.sources) {
      if (seen_.channel(source.channel) == nullptr) continue;
      std::string line =
          fmt::format("  {}: {{topic: {}, name: {}, field: {}", record::channel_name(source.channel),
                      quoted(source.topic), quoted(source.name), record::field_name(source.field));
      const bool effort = source.channel == Channel::motor_torque;
      if (effort && wrong) line += fmt::format(", scale: {:.4g}", signed_scale());
      if (source.channel == Channel::load_position && turns) line += ", scale: -1";
      text_.line(line + "}", effort && scale_ != 1
                                 ? "N m per unit; by the weight of the chain, FILL IN: the drive's manual"
                                 : "");
      if (effort && scale_ != 1)
        text_.to_fill(
            "channels.motor_torque.scale: N m at the joint per unit of the effort: the drive's manual");
    }
    text_.line("");
  }

  double signed_scale() const { return seen_.torque && seen_.torque->reversed ? -scale_ : scale_; }

  void ratio() {
    if (seen_ratio_)
      text_.value("  reduction_ratio", ratio_, "from the record: motor_position over load_position");
    else if (given_.reduction_ratio)
      text_.value("  reduction_ratio", ratio_, "given");
    else
      text_.fill_in("  reduction_ratio", ratio_, "-", "gear_train.reduction_ratio",
                    "on the plate of motor or gear");
    if (motor_side_)
      text_.line("  motor_side: true", "the motor's signals and values are those of its own shaft");
  }

  void friction(const std::string& indent, double share, double per) {
    if (!torque()) return;
    const SeenTorque& t = *seen_.torque;
    const std::string part = share == 1 ? "" : fmt::format(", {:.0f} % of all [choice]", 100 * share);
    text_.value(indent + "viscous_damping", share * t.viscous.value * scale_ * per,
                "N m s/rad; " + from_record(t.viscous) + part);
    text_.value(indent + "coulomb_friction",
                share * t.coulomb.value * scale_ * (per > 1 ? std::sqrt(per) : 1),
                "N m; " + from_record(t.coulomb) + part);
  }

  void gear_train() {
    text_.line("gear_train:", seen_ratio_ ? "" : "all values are seen from the joint, behind the reduction");
    ratio();
    text_.line("  motor:");
    const double per = at_joint();
    if (m_.rotor_known)
      text_.value("    inertia", m_.rotor / per, "kg m^2; " + m_.rotor_from);
    else
      text_.fill_in("    inertia", m_.rotor / per, "kg m^2", "gear_train.motor.inertia",
                    fmt::format("the rotor's, by the motor's data sheet{}",
                                motor_side_ ? "" : ", times reduction_ratio^2"));
    friction("    ", two_ ? 1 - kLoadFriction : 1, 1);
    text_.line("  input_coupling: rigid");
    if (!two_) {
      text_.line("  mesh: rigid", "one inertia: the record does not show which part is behind the gear");
      text_.line("  output_coupling: rigid");
      text_.to_fill(
          "for the play of this joint the rotor's inertia is needed (motor's data sheet): run make_rig again "
          "with "
          "--reduction-ratio and --rotor-inertia, or with --urdf");
      return;
    }
    mesh();
    text_.line("  output_coupling: rigid");
    text_.line("  link:");
    if (m_.load_known)
      text_.value("    inertia", m_.load, "kg m^2; " + m_.load_from);
    else
      text_.fill_in("    inertia", m_.load, "kg m^2", "gear_train.link.inertia",
                    "the load's about the joint: the record's whole inertia is not more than the rotor's");
    friction("    ", kLoadFriction, per);
    gravity();
  }

  void mesh() {
    text_.line("  mesh:", "gear and teeth as one spring");
    text_.value(
        "    backlash_angle", m_.gap,
        "rad, total; only where a fit begins" +
            std::string(seen_.load ? ": half of the range of motor minus load position" : " [choice]"));
    text_.line("    contact:");
    text_.line("      law: linear");
    if (given_.stiffness || (seen_.load && seen_.load->shows))
      text_.value("      stiffness", m_.stiffness, "N m/rad; " + m_.stiffness_from);
    else
      text_.fill_in("      stiffness", m_.stiffness, "N m/rad", "gear_train.mesh.contact.stiffness",
                    "torsional stiffness, by the gear's data sheet; here " + m_.stiffness_from);
    text_.value("      damping", m_.damping, "N m s/rad; a tenth of critical [choice]");
  }

  void gravity() {
    Wave wave;
    std::string from;
    if (urdf_ && urdf_->gravity.amplitude > 0)
      wave = urdf_->gravity, from = "by " + urdf_->file + ", " + urdf_->pose;
    else if (torque() && seen_.torque->weight)
      wave = {seen_.torque->weight->value * torque_at_joint(), seen_.torque->phase},
      from = from_record(*seen_.torque->weight);
    const double size = seen_.torque ? seen_.torque->size * torque_at_joint() : 0;
    if (!(wave.amplitude > kLightest * size)) return;
    text_.line("");
    text_.line("terms:");
    text_.line(
        fmt::format("  - {{id: gravity, amplitude: {:.4g}, phase: {:.4g}}}", wave.amplitude, wave.phase),
        "N m, rad; " + from);
  }

  void sensor(Channel channel, const char* unit) {
    const record::ChannelState* state = seen_.channel(channel);
    if (state == nullptr) return;
    std::string values;
    const double scale = channel == Channel::motor_torque ? std::abs(signed_scale()) : 1;
    if (state->noise > 0) values += fmt::format("noise: {:.3g}", scale * state->noise);
    if (state->resolution > 0)
      values += fmt::format("{}resolution: {:.3g}", values.empty() ? "" : ", ", scale * state->resolution);
    if (values.empty()) return;
    text_.line(fmt::format("  {}: {{{}}}", record::channel_name(channel), values),
               std::string(unit) + "; from the record");
  }

  void rest() {
    text_.line("");
    text_.line("excitation:",
               "for simulate alone: as far and as fast as the record. A diagnosis does not use it");
    text_.line("  type: sine");
    const double torque = seen_.torque ? seen_.torque->size * scale_ : m_.load * seen_.acceleration;
    text_.value("  amplitude", torque, "N m; from the record");
    text_.value("  frequency", seen_.fastest / (M_PI * seen_.travel), "Hz; from the record");
    text_.line("");
    text_.line("sensors:");
    text_.value("  sampling_rate", seen_.rate, "Hz; from the record");
    text_.line("  seed: 1", "of the noise that simulate adds");
    sensor(Channel::motor_torque, "N m");
    sensor(Channel::motor_position, "rad");
    sensor(Channel::load_position, "rad");
    text_.line("");
    if (!two_) {
      text_.line("diagnosis: {}", "one inertia has no play to diagnose");
      return;
    }
    text_.line("diagnosis:");
    text_.line("  stiffness_uncertainty: 0.2",
               "relative: the largest that there is; the file's stiffness is a start");
    text_.line("  # limits:",
               "FILL IN: the play from which on you want to act; without limits nothing is graded");
    text_.line("  #   backlash_angle: {watch: 1.0e-3, service: 2.0e-3, stop: 3.0e-3}", "rad, an example");
    text_.to_fill("diagnosis.limits: the play from which on you want to act");
  }

  std::string preface() const {
    std::string text = fmt::format(
        "# Rig file of joint {}, made by make_rig from {:.3g} s of {}{}. Beside each value: unit, where it "
        "came\n"
        "# from, how well it is known. It can be used as it is.\n",
        place_.joint, seen_.duration, std::filesystem::path(place_.record).filename().string(),
        urdf_ ? " and " + urdf_->file : "");
    if (!text_.to_fill().empty()) text += "# To be filled in by a person:\n";
    for (const std::string& what : text_.to_fill()) text += "#   " + what + "\n";
    return text;
  }

  const SeenJoint& seen_;
  const JointPlace& place_;
  const std::optional<UrdfLoad>& urdf_;
  const Given& given_;
  double ratio_ = 1, scale_ = 1;  // N m per unit of the effort
  std::optional<double> seen_ratio_;
  bool motor_side_ = false, two_ = false;
  Machine m_;
  RigText text_;
  std::vector<std::string> notes_;
};

}  // namespace

UrdfLoad load_of_chain(const arm::Chain& chain, std::size_t joint, const std::vector<double>& pose) {
  const auto n = Eigen::Index(chain.size());
  const auto at = Eigen::Index(joint);
  const arm::Joints none = arm::Joints::Zero(n);
  arm::Joints q = Eigen::Map<const arm::Joints>(pose.data(), n), unit = none;
  unit[at] = 1;
  UrdfLoad load;
  load.inertia =
      arm::inverse_dynamics(chain, q, none, unit)[at] - arm::inverse_dynamics(chain, q, none, none)[at];
  q[at] = 0;
  const double cosine = arm::inverse_dynamics(chain, q, none, none)[at];
  q[at] = M_PI_2;
  load.gravity = wave_of(arm::inverse_dynamics(chain, q, none, none)[at], cosine);
  return load;
}

Draft draft_joint(const SeenJoint& seen, const JointPlace& place, const std::optional<UrdfLoad>& urdf,
                  const Given& given) {
  return JointDraft(seen, place, urdf, given).draft();
}

}  // namespace backlash::rig_draft
