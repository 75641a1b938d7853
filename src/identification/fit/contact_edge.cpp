// SPDX-License-Identifier: BSD-3-Clause
#include "contact_edge.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr double kEdge = 0.04;  // simulation: of the gap; what is borne out hardly depends on it

constexpr double kClear =
    6;  // simulation: deviations of white noise; 4 come by chance, a real onset has 15 to 21

/// A term that takes away the share of the damping that is missing at small penetration.
class Onset : public model::Term {
 public:
  Onset(double damping, double distance) : damping_(damping), distance_(distance) {
    values["distance"] = distance;
  }
  bool loads_flanks() const override { return true; }
  void load_flank(const model::FlankLoad& flank, double& torque) const override {
    torque -= damping_ * flank.rate * std::max(0.0, 1 - flank.penetration / distance_);
  }

 private:
  double damping_, distance_;  // N m s/rad, rad
};

/// N m s/rad, 0 where the force does not jump.
double jumping_damping(const model::Rig& rig) {
  if (rig.mesh.rigid || !(rig.mesh.backlash > 0)) return 0;
  const auto law = rig.mesh.contact->power_contact();
  return law ? law->damping * rig.mesh.lever() * rig.mesh.lever() : 0;
}

}  // namespace

Eigen::VectorXd shift_of_contact_edge(const MachineFit& fit, const RecordSet& records) {
  model::Rig rig = fit.machine.rig;
  const double damping = jumping_damping(rig);
  if (!(damping > 0) || !simulation::load_moves_freely(rig) || rig.coupled || fit.machine.deflection_only)
    return Eigen::VectorXd::Zero(fit.fit.values.size());
  const Eigen::VectorXd now = records.rows(rig, fit.machine.calibrations);
  rig.terms.push_back(std::make_shared<Onset>(damping, kEdge * rig.mesh.backlash / rig.mesh.lever()));
  const Eigen::VectorXd change = records.rows(rig, fit.machine.calibrations) - now;
  const Eigen::MatrixXd& jacobian = fit.fit.jacobian;
  const Eigen::VectorXd unit = jacobian.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = jacobian * unit.asDiagonal();
  const auto rows = scaled.topRows(now.size());
  const Eigen::VectorXd moved = -signal::solve_symmetric(signal::gram(scaled), rows.transpose() * change);
  const Eigen::VectorXd own = change + rows * moved;
  const double in_errors = own.dot(now) / own.norm() / (now.norm() / std::sqrt(double(now.size())));
  if (!(std::fabs(in_errors) > kClear)) return Eigen::VectorXd::Zero(moved.size());
  return unit.cwiseProduct(moved) * (-own.dot(now) / own.squaredNorm());
}

}  // namespace backlash::identification
