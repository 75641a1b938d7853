// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_draft/seen_joint.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::rig_draft {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using record::Channel;

constexpr double kShortest = 5;  // s: choice, some moves of a robot
constexpr double kBand = 20,
                 kWidestBand = 0.1;  // Hz, of the sampling rate: choice, as of the look at a record
constexpr double kStands = 0.05;     // choice: of the rms speed, below which friction has no sign
constexpr double kRare = 0.01;       // choice: of the samples at either end of a range
constexpr double kStill = 1e-9;      // rad: a position that does not move
constexpr double kFollows = 0.99;    // choice: correlation of a load that goes along
constexpr int kParts = 4;            // of the record, whose scatter is the error: choice
constexpr double kLeastError = 0.1;  // relative: choice, what no declared effect is worth
// A weight is distinguished from inertia where the joint travels so far, and where it takes that share of
// what is left without it: choices.
constexpr double kWeighingTravel = 1, kWeighs = 0.5;
// Of the torque's size: a mean torque beyond is a weight, whose slope over the travel such a record does not
// show. Choice, of sensors whose zero is off by less.
constexpr double kTilted = 0.1;
constexpr double kNoiseRange =
    6;  // theory: noise standard deviations in a range that leaves out 1 % on either side, and more

struct Columns {
  std::vector<double> torque, position, speed, acceleration;  // in the band
  double turns = 1;                                           // of the motor's axis per turn of the joint
  std::size_t size() const { return torque.size(); }
};

Columns columns_of(const record::Record& even, Channel torque) {
  const double interval = even.sampling_interval(), band = std::min(kBand, kWidestBand / interval);
  Columns c;
  c.position = signal::low_pass(even.column(Channel::motor_position), interval, band);
  c.speed = signal::derivative(c.position, interval);
  c.acceleration = signal::derivative(c.speed, interval);
  if (even.has(torque)) c.torque = signal::low_pass(even.column(torque), interval, band);
  return c;
}

double root_mean_square(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum / double(std::max<std::size_t>(x.size(), 1)));
}

/// J, d, C, o and with `weight` the sine and the cosine of G, of rows from `begin` on.
struct Spent {
  VectorXd values;
  double left = 0;  // mean square
};

std::optional<Spent> spent(const Columns& c, std::size_t begin, std::size_t end, bool weight) {
  const auto n = Index(end - begin);
  const double stands = kStands * root_mean_square(c.speed);
  MatrixXd a(n, weight ? 6 : 4);
  VectorXd b(n);
  for (Index i = 0; i < n; ++i) {
    const std::size_t k = begin + std::size_t(i);
    const double w = c.speed[k], q = c.position[k] / c.turns;
    a.row(i).head(4) << c.acceleration[k], w, std::abs(w) <= stands ? 0 : std::copysign(1, w), 1;
    if (weight) a.row(i).tail(2) << std::sin(q), std::cos(q);
    b[i] = c.torque[k];
  }
  try {
    const VectorXd x = signal::fit_linear(a, b).values;
    return Spent{x, (b - a * x).squaredNorm() / double(n)};
  } catch (const CannotIdentify&) {  // a motion that does not distinguish them
    return std::nullopt;
  }
}

double variance(const std::vector<double>& x) {
  const Eigen::Map<const VectorXd> v(x.data(), Index(x.size()));
  return (v.array() - v.mean()).square().mean();
}

double half_range(const std::vector<double>& x) {
  return 0.5 * signal::quantile_range(x, kRare);
}

/// Standard errors of `whole` by the parts of the record.
VectorXd errors_of(const Columns& c, const VectorXd& whole, bool weight) {
  VectorXd square = VectorXd::Zero(whole.size());
  int parts = 0;
  for (int p = 0; p < kParts; ++p) {
    const std::size_t begin = c.size() * std::size_t(p) / kParts,
                      end = c.size() * std::size_t(p + 1) / kParts;
    const auto part = spent(c, begin, end, weight);
    if (!part) continue;
    square += (part->values - whole).cwiseAbs2();
    ++parts;
  }
  if (parts < 2) return whole.cwiseAbs();
  return (square / double(parts * (parts - 1))).cwiseSqrt().cwiseMax(kLeastError * whole.cwiseAbs());
}

signal::Measured not_negative(const VectorXd& values, const VectorXd& errors, Index i) {
  return {std::max(0.0, values[i]), errors[i]};
}

std::optional<SeenTorque> torque_of(const Columns& c, Channel channel, double travel) {
  if (c.torque.empty() || !(signal::peak_to_peak(c.torque) > 0)) return std::nullopt;
  SeenTorque seen;
  seen.channel = channel;
  seen.size = half_range(c.torque);
  auto fit = spent(c, 0, c.size(), false);
  const auto heavy = travel > kWeighingTravel ? spent(c, 0, c.size(), true) : std::nullopt;
  const bool weight = heavy && fit && heavy->left < kWeighs * fit->left;
  if (weight) fit = heavy;
  if (!fit) return seen;
  seen.explained = std::clamp(1 - fit->left / variance(c.torque), 0.0, 1.0);
  seen.reversed = seen.explained >= kTakesTorque && fit->values[0] < 0 && fit->values[2] < 0;
  if (seen.reversed) {
    Columns turned = c;
    for (double& t : turned.torque) t = -t;
    auto right = torque_of(turned, channel, travel);
    if (right) right->reversed = true;
    return right;
  }
  const VectorXd errors = errors_of(c, fit->values, weight);
  seen.inertia = not_negative(fit->values, errors, 0);
  seen.viscous = not_negative(fit->values, errors, 1);
  seen.coulomb = not_negative(fit->values, errors, 2);
  if (weight) {
    const Wave wave = wave_of(fit->values[4], fit->values[5]);
    seen.weight = {wave.amplitude, errors.tail(2).norm()};
    seen.phase = wave.phase;
  } else if (const double mean = fit->values[3]; std::abs(mean) > kTilted * seen.size) {
    seen.weight = {std::abs(mean), errors[3]};
    const signal::Extent q = signal::extent(c.position);
    seen.phase = std::copysign(M_PI_2, mean) - 0.5 * (q.low + q.high) / c.turns;
  }
  std::vector<double> load(c.size());
  for (std::size_t i = 0; i < c.size(); ++i)
    load[i] = c.torque[i] - 0.5 * seen.inertia.value * c.acceleration[i] - seen.viscous.value * c.speed[i] -
              std::copysign(seen.coulomb.value, c.speed[i]);
  seen.load = half_range(load);
  return seen;
}

/// Both encoders' travels, and how far they are apart.
std::optional<SeenLoad> load_of(const record::Record& even) {
  if (!even.has(Channel::load_position)) return std::nullopt;
  const std::vector<double>&motor = even.column(Channel::motor_position),
        &load = even.column(Channel::load_position);
  const Eigen::Map<const VectorXd> m(motor.data(), Index(motor.size())), l(load.data(), Index(load.size()));
  const VectorXd a = m.array() - m.mean(), b = l.array() - l.mean();
  if (!(b.norm() > 0) || std::abs(a.dot(b)) < kFollows * a.norm() * b.norm()) return std::nullopt;
  SeenLoad seen;
  seen.motor_turns = a.dot(b) / b.squaredNorm();
  constexpr double kSame = 0.02;  // choice: encoders differ by less, and no reduction is so small
  if (std::abs(std::abs(seen.motor_turns) - 1) < kSame) seen.motor_turns = std::copysign(1, seen.motor_turns);
  const VectorXd apart = a / seen.motor_turns - b;
  seen.looseness = signal::quantile_range({apart.data(), apart.data() + apart.size()}, kRare);
  return seen;
}

}  // namespace

Wave wave_of(double sine, double cosine) {
  return {std::hypot(sine, cosine), std::atan2(cosine, sine)};
}

const record::ChannelState* SeenJoint::channel(Channel wanted) const {
  const auto found = std::find_if(check.channels.begin(), check.channels.end(),
                                  [&](const record::ChannelState& c) { return c.channel == wanted; });
  return found == check.channels.end() ? nullptr : &*found;
}

SeenJoint look_at_joint(const record::CheckedRecord& checked) {
  const record::Record& record = checked.record;
  if (!record.has(Channel::motor_position))
    throw BadData(record.name,
                  "has no motor_position: a rig file needs the position and the torque of the motor");
  const double duration = record.time.empty() ? 0 : record.time.back() - record.time.front();
  if (!(duration >= kShortest))
    throw BadData(record.name,
                  fmt::format("lasts {:.3g} s: at least {:g} s of motion are needed, half a minute is better",
                              duration, kShortest));
  const record::Record even = record::even_grid(record).record;
  SeenJoint seen;
  seen.check = checked.check;
  seen.rate = 1 / even.sampling_interval();
  seen.duration = duration;
  const Channel torque = record.has(Channel::motor_torque) ? Channel::motor_torque : Channel::motor_current;
  seen.load = load_of(even);
  Columns columns = columns_of(even, torque);
  if (seen.load) {
    columns.turns = seen.load->motor_turns;
    double noise = 0;
    for (const Channel channel : {Channel::motor_position, Channel::load_position})
      if (const record::ChannelState* state = seen.channel(channel))
        noise += (kNoiseRange * state->noise + state->resolution) /
                 (channel == Channel::motor_position ? std::abs(columns.turns) : 1);
    seen.load->shows = seen.load->looseness > noise;
  }
  const signal::Extent extent = signal::extent(columns.position);
  seen.middle = 0.5 * (extent.low + extent.high);
  seen.travel = extent.size();
  if (!(seen.travel > kStill))
    throw BadData(record.name, "motor_position does not move: record the joint while it works");
  seen.fastest = half_range(columns.speed);
  seen.acceleration = half_range(columns.acceleration);
  seen.torque = torque_of(columns, torque, seen.travel / std::abs(columns.turns));
  return seen;
}

}  // namespace backlash::rig_draft
