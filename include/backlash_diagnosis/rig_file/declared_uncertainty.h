// SPDX-License-Identifier: BSD-3-Clause
// How well the values of a rig file are known where it does not say so itself.
#pragma once

namespace backlash::rig_file {

/// What a declared value may be off by, 95 %, both ends. Choices: what data sheets and drawings are good for.
/// The diagnosis of a commissioned rig should not need them: state the uncertainty in the file.
struct DeclaredUncertainty {
  /// -, relative, of the compliance of a coupling: tolerance of a torsion spring with its clamps.
  static constexpr double kCoupling = 0.12;
  /// -, factor of the contact stiffness of a mesh and of what holds it: depends on tooth form, position and
  /// width of contact, which no data sheet states.
  static constexpr double kContactFactor = 2.5;
};

/// Relative 95 % uncertainty of an elastic deflection, of which the couplings' share [rad] is `coupling` and
/// that of the flanks `flank`, whose force goes with the power `exponent` of their deflection.
/// The two are added: both may err to one side.
double elastic_uncertainty(double coupling, double flank, double exponent = 1.5);

}  // namespace backlash::rig_file
