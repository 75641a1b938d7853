// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/waveform.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "refusal.h"
#include "waveform_solution.h"

namespace backlash::diagnosis {
namespace {

constexpr double kUndetermined = 0.9;  // of what was known, from which a record determines nothing: choice
constexpr double kFinest =
    0.002;  // of a value, choice: the equations are no better, see kModelError of the fit

/// Those that the machine has, by their places in waveform_quantities().
std::vector<std::size_t> quantities_of(const WaveformSettings& machine) {
  std::vector<std::size_t> places;
  const auto& all = waveform_quantities();
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i].in(machine)) places.push_back(i);
  return places;
}

/// What the record leaves of a machine, by the equations of waveform.h.
WaveformSettings after(const WaveformSettings& before, const WaveformSolution& s) {
  const std::vector<std::size_t> places = quantities_of(before);
  const auto count = static_cast<int>(places.size());
  const auto of_fit = [&places](int i) { return kQuantityPlaces[places[static_cast<std::size_t>(i)]]; };
  Eigen::MatrixXd c(count, count);
  Eigen::VectorXd u(count);
  for (int i = 0; i < count; ++i) {
    u[i] = s.priors.powers[static_cast<std::size_t>(of_fit(i))];
    for (int j = 0; j < count; ++j) {
      const int a = of_fit(i), b = of_fit(j);
      c(i, j) = s.covariance(a, b) * s.priors.shared[static_cast<std::size_t>(a)].spread *
                s.priors.shared[static_cast<std::size_t>(b)].spread;
    }
  }
  const Eigen::VectorXd unit = c.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled = unit.cwiseInverse().asDiagonal() * c * unit.cwiseInverse().asDiagonal();
  const Eigen::VectorXd direction = u.cwiseQuotient(unit);
  const double common = 1 / direction.dot(signal::solve_symmetric(scaled, direction).col(0));
  Eigen::MatrixXd rest = scaled - common * direction * direction.transpose();
  const Eigen::VectorXd own = rest.diagonal().cwiseMax(1e-6).cwiseSqrt();
  rest = own.cwiseInverse().asDiagonal() * rest * own.cwiseInverse().asDiagonal();
  const double widest = std::sqrt(std::max(1.0, signal::symmetric_eigenvalues(rest)[count - 1]));
  WaveformSettings machine = before;
  machine.common_scale = std::sqrt(common);
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(of_fit(i));
    const fit::Prior& prior = s.priors.shared[k];
    const double finest = prior.factor ? kFinest : kFinest * s.values[k];
    const double spread = std::min(prior.spread, std::max(finest, widest * own[i] * unit[i]));
    const WaveformQuantity& q = waveform_quantities()[places[static_cast<std::size_t>(i)]];
    machine.*q.at = prior.factor ? s.values[k] : std::max(0.0, s.values[k]);
    machine.spread.*q.spread = spread;
  }
  return machine;
}

WaveformCommissioning::State state_of(const WaveformSolution& s, bool position) {
  WaveformCommissioning::State state;
  state.backlash = 2 * s.half_gap, state.log_error = s.log_error;
  state.position = position;
  for (int c = 0; c < (position ? 2 : 1); ++c) {
    state.residual[c] = s.misfit[c].rms / s.misfit[c].swing;
    state.noise[c] = s.misfit[c].noise / s.misfit[c].swing;
  }
  state.windows = s.windows, state.left_out = s.left_out;
  return state;
}

}  // namespace

const std::vector<WaveformQuantity>& waveform_quantities() {
  using S = WaveformSettings;
  using W = WaveformSpread;
  static const char* const kInertia = "kg m^2";
  static const char* const kDamping = "N m s/rad";
  static const std::vector<WaveformQuantity> table = {
      {"motor_viscous", kDamping, "motor damping", true, 1, &S::motor_damping, &W::motor_damping},
      {"motor_coulomb", "N m", "dry friction", false, 0, &S::dry_friction, &W::dry_friction},
      {"friction_speed", "rad/s", "speed of dry friction", true, -1, &S::friction_speed, &W::friction_speed},
      {"sensor_stiffness", "N m/rad", "sensor stiffness", true, 1, &S::sensor_stiffness,
       &W::sensor_stiffness},
      {"sensor_damping", kDamping, "sensor damping", true, 1, &S::sensor_damping, &W::sensor_damping},
      {"motor_inertia", kInertia, "motor inertia", true, 1, &S::motor_inertia, &W::motor_inertia},
      {"pinion_inertia", kInertia, "pinion inertia", true, 1, &S::pinion_inertia, &W::pinion_inertia},
      {"gear_inertia", kInertia, "gear inertia", true, 1, &S::gear_inertia, &W::gear_inertia},
      {"output_stiffness", "N m/rad", "output stiffness", true, 1, &S::output_stiffness,
       &W::output_stiffness},
      {"output_damping", kDamping, "output damping", true, 1, &S::output_damping, &W::output_damping},
      {"contact_stiffness", "N/m^n", "contact stiffness", true, kNaN, &S::contact_stiffness,
       &W::contact_stiffness, "N m/rad^n"},
      {"contact_loss", "s/m", "contact loss", true, 1, &S::contact_loss, &W::contact_loss, "s/rad"},
      {"contact_damping", "N s/m", "contact damping", true, 1, &S::contact_damping, &W::contact_damping,
       kDamping},
      {"load_inertia", kInertia, "link inertia", true, 1, &S::link_inertia, &W::link_inertia},
      {"load_viscous", kDamping, "link damping", true, 1, &S::link_damping, &W::link_damping},
      {"load_coulomb", "N m", "dry friction of the link", false, 0, &S::link_friction, &W::link_friction},
      {"sensor_gain", "-", "sensor gain", true, 0, &S::sensor_gain, &W::sensor_gain},
      {"sensor_delay", "s", "delay of the sensor", false, 0, &S::sensor_delay, &W::sensor_delay},
      {"sensor_time_constant", "s", "time constant of the sensor", false, 0, &S::sensor_time_constant,
       &W::sensor_time_constant}};
  return table;
}

double scale_power(const WaveformQuantity& quantity, const WaveformSettings& settings) {
  return quantity.at == &WaveformSettings::contact_stiffness ? settings.contact_exponent : quantity.power;
}

WaveformCommissioning commission_waveform(const std::vector<record::Record>& records,
                                          const WaveformSettings& settings, double known,
                                          double known_error) {
  WaveformCommissioning result;
  result.machine = settings;
  const std::vector<std::size_t> places = quantities_of(settings);
  std::vector<double> left(places.size(), 1);  // of what was known before the first record
  for (const record::Record& record : records) {
    try {
      check_waveform(record, result.machine);
      const bool first = result.states.empty();
      WaveformTask task;
      if (first) task.half_gap = known / 2, task.log_error = known_error;
      const WaveformSolution s = solve_waveform(record, result.machine, task);
      refuse_waveform(s);
      for (std::size_t i = 0; i < places.size(); ++i)
        left[i] *= s.left_of_spread[static_cast<std::size_t>(kQuantityPlaces[places[i]])];
      result.machine = after(result.machine, s);
      result.states.push_back(state_of(s, record.has(record::Channel::motor_position)));
    } catch (const Refusal& refusal) {
      throw CannotIdentify(record.name + ": " + refusal.reason);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i)
    if (left[i] > kUndetermined) result.undetermined.emplace_back(waveform_quantities()[places[i]].name);
  return result;
}

}  // namespace backlash::diagnosis
