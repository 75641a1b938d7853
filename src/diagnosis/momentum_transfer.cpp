// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/momentum_transfer.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"
#include "momentum_flank.h"
#include "momentum_square_wave.h"
#include "refusal.h"
#include "same_throughout.h"

namespace backlash::diagnosis {
namespace momentum {
namespace {

constexpr double kSamplesPerCycle = 10;  // of motor against pinion
constexpr double kFlight = 0.3;          // torque left in flight over that in contact, at most
constexpr double kTiming = 0.5;          // samples, when the impact began
// Of the averages' half width, by which noise moves impact and release where it is as large as may be:
// simulated servos with 20 % torque noise.
constexpr double kNoisyTiming = 0.8;
constexpr double kLeastOverFriction = 0.7;  // simulation: servos with up to twice the declared friction
constexpr int kSettle = 2;                  // choice: looks at what is left in flight
constexpr double kTangent = 1.5;  // theory: Hertz, deflection at a tangent stiffness over that at the secant
// Simulation: momentum at the impact over what friction took on the way, at least. Servos have 0.9 and more,
// slow ramps less than 0.004.
constexpr double kMomentumLeft = 0.1;
constexpr double kUnlike = 0.4;     // simulation: rigs whose values are all off; share of the crossings
constexpr double kNormal95 = 1.96;  // theory: standard deviations of 95 %, both ends
constexpr double kEstimatedElasticShare = 0.2;  // simulation: the level is estimated to some 10 %

void require(bool valid, const char* name, double value, const char* limit) {
  if (!valid) throw InvalidParameter(std::string("momentum_transfer.") + name, value, limit);
}

void check(const MomentumTransferSettings& s) {
  require(s.motor_inertia > 0 && std::isfinite(s.motor_inertia), "motor_inertia", s.motor_inertia,
          "must be > 0");
  require(s.motor_damping >= 0 && std::isfinite(s.motor_damping), "motor_damping", s.motor_damping,
          "must be >= 0");
  require(s.pinion_inertia >= 0 && std::isfinite(s.pinion_inertia), "pinion_inertia", s.pinion_inertia,
          "must be >= 0");
  require(s.coupling_stiffness > 0, "coupling_stiffness", s.coupling_stiffness, "must be > 0");
  require(!flexible(s) || s.pinion_inertia > 0, "pinion_inertia", s.pinion_inertia,
          "must be > 0 beyond a flexible coupling");
  require(s.motor_friction >= 0 && std::isfinite(s.motor_friction), "motor_friction", s.motor_friction,
          "must be >= 0");
  require(s.elastic_uncertainty >= 0 && std::isfinite(s.elastic_uncertainty), "elastic_uncertainty",
          s.elastic_uncertainty, "must be >= 0");
  require(s.load_ratio > 0 && std::isfinite(s.load_ratio), "load_ratio", s.load_ratio, "must be > 0");
  require(!(s.base_radius <= 0), "base_radius", s.base_radius, "must be > 0");
}

/// Mean of |F| while the motor side flies, over all flights longer than the averages; 0 without any.
double torque_in_flight(const std::vector<double>& flank, const std::vector<Crossing>& crossings,
                        std::size_t half) {
  double sum = 0, count = 0;
  for (const Crossing& c : crossings) {
    const auto end = static_cast<std::size_t>(std::max(0.0, c.impact)) - half;
    for (auto i = static_cast<std::size_t>(c.release) + half; i < end && c.impact > static_cast<double>(half);
         ++i) {
      sum += std::abs(flank[i]);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

/// The crossings of the gap; refuses where they are too few or no free flights.
std::vector<Crossing> free_crossings(const Flank& flank, double shortness) {
  std::vector<Crossing> crossings = find_crossings(flank, shortness);
  if (crossings.empty())
    throw Refusal{Status::out_of_domain, "the motor side never leaves one flank for the other"};
  if (crossings.size() < kFewestCrossings)
    throw Refusal{Status::insufficient_data, "the gap is crossed " + std::to_string(crossings.size()) +
                                                 " times, needed are " + std::to_string(kFewestCrossings)};
  const double in_flight = torque_in_flight(flank.torque, crossings, flank.half);
  if (in_flight > kFlight * flank.level)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the motor side does not fly freely between the flanks: {:.4g} N m are left there, "
                    "{:.4g} N m in contact; inertia, damping or friction are not as declared",
                    in_flight, flank.level)};
  return crossings;
}

/// Dry friction [N m] that in the median leaves nothing on the flank while the motor side flies.
double friction_in_flight(const Motor& motor, const MomentumTransferSettings& s) {
  const Flank flank = calm_flank(motor, s);
  std::vector<double> left;
  for (const Crossing& c : find_crossings(flank, shortness_of_impacts(flank, motor.interval, s)))
    for (double i = std::ceil(c.release) + double(flank.half); i < c.impact - double(flank.half); ++i)
      left.push_back(std::copysign(1, motor.speed[std::size_t(i)]) * flank.torque[std::size_t(i)]);
  if (left.size() < kFewestCrossings) return s.motor_friction;
  return std::max(0.0, s.motor_friction + signal::median(std::move(left)));
}

/// Of all crossings, rad but for the speed.
struct Travels {
  std::vector<int> side;
  std::vector<double> impact;  // sample
  std::vector<double> gap, timing, elastic, law, smear;
  std::vector<double> impact_speed;  // rad/s
  std::vector<double> friction;      // N m s, what viscous and dry friction took of the momentum on the way
};

/// [N m] On the flank, of the record's larger ones.
double large_torque(const Flank& flank) {
  std::vector<double> sizes;
  for (const double f : flank.torque) sizes.push_back(std::abs(f));
  return signal::quantile(std::move(sizes), 0.95);
}

/// By how much more the flank yields under a small torque where it does by Hertz and is as stiff as declared
/// at the torque `most` of the record.
double more_after_hertz(double torque, double most, const MomentumTransferSettings& s) {
  if (s.output_locked || !s.flank_deflection || !(torque > 0 && torque < most)) return 0;
  return kTangent * s.flank_deflection(most) * std::pow(torque / most, 2.0 / 3) - s.flank_deflection(torque);
}

Travels travels_of(const Motor& motor, const Flank& flank, const std::vector<Crossing>& crossings,
                   double shortness, const MomentumTransferSettings& s) {
  // The integral of a speed that jumps between two samples is known to half a sample too.
  const double blur = kTiming * (motor.tachometer ? 1 + shortness : 1);
  const double most = large_torque(flank);
  Travels all;
  for (const Crossing& c : crossings) {
    const auto place = [&](double index) { return at(flank.pinion.position, index) - at(motor.load, index); };
    const double law =
        0.5 * (more_after_hertz(0.5 * flank.level, most, s) + more_after_hertz(c.impact_torque, most, s));
    const double deflection = law + (s.flank_deflection ? s.flank_deflection(0.5 * flank.level) +
                                                              s.flank_deflection(c.impact_torque)
                                                        : 0);
    all.side.push_back(c.side);
    all.impact.push_back(c.impact);
    all.gap.push_back(c.side * (place(c.impact) - place(c.release)) - deflection);
    all.timing.push_back(std::abs(place(c.impact) - place(c.impact - blur)));
    all.elastic.push_back(deflection);
    all.law.push_back(law);
    all.smear.push_back(std::abs(place(c.impact) - place(c.impact - double(flank.half))));
    all.impact_speed.push_back(std::abs(at(motor.speed, c.impact)));
    all.friction.push_back(s.motor_damping *
                               std::abs(at(motor.position, c.impact) - at(motor.position, c.release)) +
                           s.motor_friction * (c.impact - c.release) * motor.interval);
  }
  return all;
}

/// Half of the interval.
double half_width(const Travels& travels, const signal::RobustScale& scale, const Motor& motor,
                  const Flank& flank, const MomentumTransferSettings& s) {
  const auto count = static_cast<double>(travels.gap.size());
  const double scatter =
      signal::student_t_quantile(0.975, std::max(1.0, count - 1)) * 1.25 * scale.deviation / std::sqrt(count);
  // A flexible coupling limits the averages to a part of its own cycle.
  const double smear = flexible(s) ? 0 : signal::median(travels.smear);
  if (smear > std::max(0.0, scale.centre) + scatter)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("within the +-{:.4g} s that torque and speed must be averaged over for their noise, the "
                    "motor side travels {:.4g} rad, farther than the gap",
                    static_cast<double>(flank.half) * motor.interval, smear)};
  const double noisy = kNoisyTiming * smear * std::min(1.0, 2 * kNoiseFree * flank.noise / flank.level);
  const double share = std::max(s.elastic_uncertainty, motor.torque_measured ? 0 : kEstimatedElasticShare);
  // Whatever makes crossings of a free load differ may also shift all of them.
  const double unlike = s.output_locked ? 0 : scale.deviation;
  return std::sqrt(scatter * scatter + unlike * unlike + std::pow(signal::median(travels.timing), 2) +
                   noisy * noisy +
                   std::pow(share * signal::median(travels.elastic) + signal::median(travels.law), 2));
}

void require_sense(double lower, double upper, const MomentumTransferSettings& s) {
  if (!(upper > 0))
    throw Refusal{Status::out_of_domain,
                  "the pinion travels less than the flanks yield elastically: the rig is not this machine"};
  if (!s.output_locked && !(lower > 0))
    throw Refusal{
        Status::insufficient_data,
        fmt::format("in flight the motor side travels no farther than the flanks yield, which the rig "
                    "file states within {:.0f} %",
                    100 * s.elastic_uncertainty)};
}

void check_friction(const Flank& flank, const MomentumTransferSettings& s) {
  if (flank.level < kLeastOverFriction * s.motor_friction)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the flanks carry {:.4g} N m, and the dry friction of the motor, known from the rig "
                    "file only, is {:.4g} N m",
                    flank.level, s.motor_friction)};
}

/// The reading of a record by one machine.
struct Reading {
  Flank flank;
  Travels travels;
  signal::RobustScale scale;  // of the gap
};

Reading read(const Motor& motor, const MomentumTransferSettings& s) {
  Reading r;
  r.flank = calm_flank(motor, s);
  check_friction(r.flank, s);
  const double shortness = shortness_of_impacts(r.flank, motor.interval, s);
  r.travels = travels_of(motor, r.flank, free_crossings(r.flank, shortness), shortness, s);
  r.scale = signal::robust_scale(r.travels.gap, 0);
  return r;
}

void check_domain(const Motor& motor, const MomentumTransferSettings& s) {
  const double cycle = internal_cycle(s);
  if (cycle > 0 && cycle < kSamplesPerCycle * motor.interval)
    throw Refusal{Status::out_of_domain,
                  fmt::format("sampled at {:.4g} Hz, but motor and pinion swing against each other at {:.4g} "
                              "Hz: needed are {:.4g} samples per cycle",
                              1 / motor.interval, 1 / cycle, kSamplesPerCycle)};
}

/// The machine with each value that is uncertain `off` standard deviations from the declared one.
std::vector<MomentumTransferSettings> moved(const MomentumTransferSettings& s, const Motor& motor,
                                            double off) {
  std::vector<MomentumTransferSettings> all;
  const auto add = [&](double spread, auto&& move) {
    if (!(spread > 0)) return;
    all.push_back(s);
    move(all.back(), spread);
  };
  const auto factor = [&](double MomentumTransferSettings::*value) {
    return [=](MomentumTransferSettings& to, double spread) { to.*value *= std::exp(off * spread); };
  };
  using S = MomentumTransferSettings;
  add(s.spread.motor_inertia, factor(&S::motor_inertia));
  add(s.spread.motor_damping, factor(&S::motor_damping));
  if (flexible(s)) add(s.spread.pinion_inertia, factor(&S::pinion_inertia));
  if (flexible(s)) add(s.spread.coupling_stiffness, factor(&S::coupling_stiffness));
  if (s.flank_deflection)
    add(s.spread.flank_deflection, [&](S& to, double spread) {
      to.flank_deflection = [of = s.flank_deflection, by = std::exp(off * spread)](double torque) {
        return by * of(torque);
      };
    });
  std::vector<double> sizes;
  for (const double torque : motor.torque) sizes.push_back(std::abs(torque));
  add(s.spread.motor_friction * signal::median(std::move(sizes)),
      [&](S& to, double spread) { to.motor_friction = std::max(0.0, to.motor_friction + off * spread); });
  return all;
}

/// By how much the gap of the same crossings changes in the median; NaN where few of them are found again, as
/// the record is not one of such a machine.
double change_of_gap(const Reading& from, const Reading& to) {
  std::vector<double> changes;
  std::size_t k = 0;
  const auto reach = 2 * double(from.flank.half);
  for (std::size_t i = 0; i < from.travels.gap.size(); ++i) {
    while (k < to.travels.gap.size() && to.travels.impact[k] < from.travels.impact[i] - reach) ++k;
    if (k == to.travels.gap.size()) break;
    if (to.travels.side[k] == from.travels.side[i] && to.travels.impact[k] < from.travels.impact[i] + reach)
      changes.push_back(to.travels.gap[k] - from.travels.gap[i]);
  }
  if (2 * changes.size() < from.travels.gap.size()) return kNaN;
  return signal::median(std::move(changes));
}

/// By what the declared values leave open.
double declared_half_width(const Motor& motor, const Reading& reading, const MomentumTransferSettings& s) {
  const std::vector<MomentumTransferSettings> less = moved(s, motor, -1), more = moved(s, motor, 1);
  const auto change = [&](const MomentumTransferSettings& machine) {
    try {
      return std::abs(change_of_gap(reading, read(motor, machine)));
    } catch (const Refusal&) {
      return kNaN;  // not such a machine
    }
  };
  double squares = 0;
  for (std::size_t i = 0; i < less.size(); ++i) {
    const double larger = std::fmax(change(less[i]), change(more[i]));  // of those that are known
    if (std::isnan(larger))
      throw Refusal{
          Status::out_of_domain,
          "with values as far from the declared ones as the rig file leaves open other crossings are "
          "found: inertia, damping, friction and stiffness must be known better"};
    squares += std::pow(kNormal95 * larger, 2);
  }
  return std::sqrt(squares);
}

/// A motor that friction leads across the gap hands over no momentum: what is on the flank is then the
/// difference of torque and friction, and as wrong as the friction is.
void require_momentum(const Travels& travels, const MomentumTransferSettings& s) {
  const double momentum = s.motor_inertia * signal::median(travels.impact_speed),
               friction = signal::median(travels.friction);
  if (momentum >= kMomentumLeft * friction) return;
  throw Refusal{
      Status::out_of_domain,
      fmt::format("the motor brings a momentum of {:.2g} N m s to the impacts, friction takes {:.2g} "
                  "N m s on the way there: it is led across the gap, and does not fly",
                  momentum, friction)};
}

/// All crossings of a gap are as wide. Where they are not, some are something else: swings of the motor that
/// a wrong inertia or stiffness makes look like flights.
void require_alike(const Travels& travels, double half, const MomentumTransferSettings& s) {
  if (!s.output_locked) return;  // the interval of a free load holds them
  const double low = signal::quantile(travels.gap, 0.5 * kUnlike),
               high = signal::quantile(travels.gap, 1 - 0.5 * kUnlike);
  if (high - low <= 2 * half) return;
  throw Refusal{
      Status::out_of_domain,
      fmt::format(
          "of the crossings a fifth travel less than {:.4g} rad and a fifth more than {:.4g} rad: not "
          "all are crossings of one gap, or the rig is not this machine",
          low, high)};
}

void fill(const record::Record& record, MomentumTransferSettings s, Estimate& estimate) {
  Motor motor = collect(record, s);
  check_domain(motor, s);
  if (!motor.torque_measured) estimate_torque(motor, s);
  if (!s.output_locked && motor.torque_measured)
    for (int i = 0; i < kSettle; ++i) s.motor_friction = friction_in_flight(motor, s);
  const Reading reading = read(motor, s);
  const auto& [flank, travels, scale] = reading;
  require_momentum(travels, s);
  const double read = half_width(travels, scale, motor, flank, s);
  require_same_throughout(travels.gap, read);
  require_alike(travels, read, s);
  estimate.declared = declared_half_width(motor, reading, s);
  const double half = std::hypot(read, estimate.declared);
  require_sense(scale.centre - half, scale.centre + half, s);
  estimate.angle_lower = std::max(0.0, scale.centre - half);
  estimate.angle_upper = scale.centre + half;
  if (!motor.torque_measured) check_rest(motor, s, estimate);
  estimate.status = estimate.angle_lower > 0 ? Status::ok : Status::below_range;
  estimate.backlash_angle = std::max(0.0, scale.centre);
  estimate.backlash = s.base_radius * estimate.backlash_angle;
  estimate.lower = s.base_radius * estimate.angle_lower;
  estimate.upper = s.base_radius * estimate.angle_upper;
  estimate.message =
      fmt::format("median of {} crossings, impacts at {:.4g} rad/s, momentum averaged over +-{:.4g} s",
                  travels.gap.size(), signal::median(travels.impact_speed),
                  static_cast<double>(flank.half) * motor.interval);
  if (!motor.torque_measured)
    estimate.message += fmt::format("; torque estimated from the motion, a square wave of {:.4g} N m",
                                    std::abs(motor.torque.front()));
  if (estimate.status == Status::below_range)
    estimate.message += "; contact is lost for no longer than elastic deflection and averaging explain";
}

}  // namespace
}  // namespace momentum

Estimate estimate_momentum_transfer(const record::Record& record, const MomentumTransferSettings& settings) {
  momentum::check(settings);
  return estimate_or_refusal("momentum_transfer",
                             [&](Estimate& estimate) { momentum::fill(record, settings, estimate); });
}

}  // namespace backlash::diagnosis
