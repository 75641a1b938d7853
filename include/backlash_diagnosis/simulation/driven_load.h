// SPDX-License-Identifier: BSD-3-Clause
// The load of a gear train whose motor moves as it was recorded.
//
//   J_L w' = T_mesh(q_M, w_M, q_L, w_L) - friction + terms + J_L k (w_rec - w)
//
// Driven by its torque, a simulated gear train with play soon leaves the recorded one: in the gap the motion
// is chaotic. Driven by the recorded motor position, with the speed of the simulated load drawn to the
// recorded one (k [1/s]), it follows. What remains between simulated and recorded load is the error of the
// model.
//
// Behind a flexible output coupling with the bearing at the gear (Rig::bearing_at_gear) the load is
//   J_L w' = k_O (q_G - q_L) - c_L w + terms + J_L k (w_rec - w_G)
//   T_mesh(q_M, q_G) - R = k_O (q_G - q_L)        |R| <= F_L
// with J_L of gear and link: the gear q_G, which the encoder shows, is massless and moves no farther than it
// must to keep the friction R of its bearing within the limit. Right for motions slow beside the gear's own
// between teeth and coupling. Damping of the coupling and presliding of the bearing are left out.
//
// Where the link is locked or the mesh rigid the load has no motion of its own: it stands, or moves with the
// motor, and only the torque on the motor is computed.
//
// Fixed steps of one sample, classical Runge-Kutta, motor position cubic between samples, its speed the
// derivative of that. A step is divided where the load comes to rest, turns round or breaks away and where
// teeth touch or part.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::simulation {

/// Columns of equal length, at the load side.
struct RecordedMotion {
  double interval = 0;                              // s
  const std::vector<double>* motor = nullptr;       // rad
  const std::vector<double>* motor_rate = nullptr;  // rad/s
  const std::vector<double>* load_rate = nullptr;   // rad/s, draws the simulated load; null: it runs free
  double first_load = 0, first_load_rate = 0;       // rad, rad/s: where the load starts
  // rad/s^2 of the motor, smooth, for friction of one inertia that follows what its load takes; null: 0
  const std::vector<double>* acceleration = nullptr;
  double start = 0;  // s, of the first sample, as terms see it
};

struct DrivenLoad {
  std::vector<double> load, load_rate;  // rad, as an encoder without error shows it; rad/s, of the link
  std::vector<double> mesh_torque;      // N m, through the teeth; 0 of a rigid mesh
  /// N m, of the teeth on the motor: mean about each sample, weighted 1 - |t| / interval, which is what a
  /// second difference of the motor position sees. At the ends over one interval.
  std::vector<double> mesh_on_motor;
};

/// All torques on the motor except that of its drive and of its own inertia.
struct MotorTorques {
  std::vector<double> mean;  // N m, with the mesh, without dry friction; weighted as above
  std::vector<model::FrictionLimits> friction;
  std::vector<double> mesh_torque;  // N m, as terms see it: of one inertia what its load takes
};

/// Typical k [1/s].
constexpr double kLoadFeedback = 50;

/// Whether the load has a motion of its own to be simulated.
bool load_moves_freely(const model::Rig& rig);

/// Throws InvalidParameter for a rig with a flexible input coupling, a flexible output coupling with the
/// bearing at the link, or a contact law that needs touches;
/// IntegrationError where the load runs away.
DrivenLoad simulate_driven_load(const model::Rig& rig, const RecordedMotion& motion,
                                double feedback = kLoadFeedback);

/// How many loads this processor follows at once.
std::size_t loads_at_once();

/// At most so many rigs with the same motor, each from its own first position [rad]: number by number what
/// simulate_driven_load() gives, in a fraction of the time. Empty where they cannot be moved at once: terms
/// that move the load, presliding, teeth with a memory or of different exponents. Throws likewise.
std::vector<DrivenLoad> simulate_driven_loads(const std::vector<model::Rig>& rigs,
                                              const std::vector<double>& first_loads,
                                              const RecordedMotion& motion, double feedback);

/// A rig reduced to what acts on its load: loads of rigs that are then equal move equally when the motor
/// does. What is taken away is all that does not: a new member of Rig counts until it is named there.
model::Rig acting_on_load(model::Rig rig);

/// Beside a load that has been simulated with this motion, by a rig that may differ in what does not move the
/// load.
MotorTorques motor_torques(const model::Rig& rig, const RecordedMotion& motion, const DrivenLoad& load);

}  // namespace backlash::simulation
