// SPDX-License-Identifier: BSD-3-Clause
// The text of a rig file whose values are replaced one by one: its layout, other values and comments stay.
#pragma once

#include <map>
#include <string>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash {

class RigText {
 public:
  explicit RigText(const RigFile& file) : text_(file.text), name_(file.source) {}

  const std::string& text() const { return text_; }

  /// Throws BadData as with_yaml_value().
  void set(const std::string& key, double value, const std::string& comment);

  /// A number for both directions, or a map, as the file has it; a map where they differ.
  void set_directional(const std::string& part, const std::string& key, double mean, double asymmetry,
                       const std::string& comment);

  /// Another law with all its values in place of the declared one.
  void set_contact_law(const ContactSpec& contact);

  /// In the words of the file: backlash, half_gap or backlash_angle.
  void set_backlash(const Rig& rig, const std::string& comment);

 private:
  std::string text_, name_;
};

/// What a fit says of a machine: its rig at the load side, and by the names of servo_parameters() what of it
/// was fitted.
struct FittedMachine {
  const Rig& rig;
  const std::map<std::string, Measured>& parameters;
  const std::map<std::string, std::string>& units;

  /// "kg m^2, fitted +- 0.02", of a value that the file has divided by `divisor`.
  std::string comment(const std::string& name, double divisor = 1) const;
};

/// Replaces what was fitted; `ratio` is motor_axis_ratio() of the file.
void write_servo(RigText& text, const FittedMachine& found, double ratio);

}  // namespace backlash
