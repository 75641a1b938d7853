// SPDX-License-Identifier: BSD-3-Clause
// The force between two teeth that touch.
//
// A new law: one file in src/model/contact/ with its equation, and one line in contact_law.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/parameter.h"

namespace backlash::model {

/// A force with four coefficients, which can be computed for many teeth at once:
///   F = max(0, K d^n (1 + loss d') + damping d')
struct PowerContact {
  double stiffness, exponent;  // K, n
  double loss = 0;             // s/m
  double damping = 0;          // N s/m
};

/// Name and parameters of a law, from which it can be created again, also with other values.
struct ContactSpec {
  std::string law;
  ParameterValues values;
};

/// Contact force along the common normal as a function of penetration d [m] and its rate d' [m/s], d > 0
/// where the flanks overlap, d' > 0 while they approach. Force > 0 pushes the flanks apart [N]. A rig without
/// base radius uses the same laws with angles: d [rad], d' [rad/s], force [N m].
class ContactLaw {
 public:
  virtual ~ContactLaw() = default;

  ContactSpec made_of;  // set by make_contact_law(); empty of another law

  /// Force at penetration d > 0; callers handle d <= 0 (no contact, no force). `impact_speed` [m/s] is the
  /// approach speed d' > 0 at the touch that began this contact, 0 if none did (the flanks overlapped from
  /// the start); only laws with needs_impact_speed() read it.
  virtual double force(double penetration, double rate, double impact_speed) const = 0;

  /// Whether touches must be found and their speed kept.
  virtual bool needs_impact_speed() const { return false; }

  /// Coefficient of restitution by which the speeds jump at a touch; none for laws that act by their force
  /// alone. A law that jumps needs the impact speed.
  virtual std::optional<double> jump_restitution(double /*impact_speed*/) const { return std::nullopt; }

  /// The same law as coefficients of PowerContact, if it has this form.
  virtual std::optional<PowerContact> power_contact() const { return std::nullopt; }

  /// Elastic energy at penetration d >= 0: the integral of the force at rest [J].
  virtual double elastic_energy(double penetration) const = 0;

  /// Penetration at rest under a force >= 0: the inverse of force(d, 0, 0) [m].
  virtual double static_penetration(double force) const = 0;
};

/// What the registry knows of a law.
struct ContactLawType {
  std::string name;
  std::vector<ParameterSpec> parameters;
  std::unique_ptr<ContactLaw> (*create)(const ParameterValues&);
};

/// All laws, by the name that a rig file uses.
const std::vector<ContactLawType>& contact_laws();

/// Reads `law: NAME` and that law's parameters.
ContactSpec read_contact_spec(const YamlReader& yaml);

/// Creates a law by name; throws InvalidParameter for an unknown name or a value outside its range.
std::shared_ptr<const ContactLaw> make_contact_law(const std::string& name, const ParameterValues& values);

}  // namespace backlash::model
