// SPDX-License-Identifier: BSD-3-Clause
#include "strength_in_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "effect_roles.h"
#include "found_effects.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kParts = 3, kBlocks = 30;  // choice
constexpr double kStep = 0.02;                   // theory: of a strength; small, and far above rounding

/// What the effect adds to a channel, what is left there, and the motion: of the samples that count.
struct Samples {
  std::vector<double> adds, left;                        // N m or rad
  std::vector<double> speed, rate, place, torque, time;  // SI units, sizes of speed and torque
  double floor_square = 0;                               // N^2 m^2 or rad^2: sum of what noise alone leaves
};

/// The rig with all strengths of the effect larger by kStep.
model::Rig stronger(const Hypothesis& h, std::size_t effect) {
  const std::vector<FitParameter>& parameters = h.fitted->start.parameters;
  model::Rig rig = h.fitted->fit.machine.rig;
  std::size_t at = h.declared->parameters.size();
  for (std::size_t i = 0; i <= effect; ++i)
    for (std::size_t t = 0; t < h.effects[i].candidate.terms.size(); ++t) {
      if (i == effect) parameters[at].set(rig, (1 + kStep) * parameters[at].get(rig));
      at += fitted_count(h.effects[i].candidate, t);
    }
  return rig;
}

void add_samples(const ServoData& data, const ServoPrediction& as_fitted, const ServoPrediction& stronger,
                 bool deflection, Samples& s) {
  const auto signal = deflection ? &ServoPrediction::deflection : &ServoPrediction::torque;
  const auto measured =
      deflection ? &ServoPrediction::measured_deflection : &ServoPrediction::measured_torque;
  const double floor = deflection ? as_fitted.deflection_floor : as_fitted.torque_floor;
  const auto& counts = deflection ? as_fitted.settled : as_fitted.counts;
  for (std::size_t k = 0; k < data.size(); ++k) {
    const double adds = ((stronger.*signal)[k] - (as_fitted.*signal)[k]) / kStep;
    if (!counts[k] || adds == 0) continue;
    s.adds.push_back(adds);
    s.left.push_back((as_fitted.*measured)[k] - (as_fitted.*signal)[k]);
    s.floor_square += floor * floor;
    s.speed.push_back(std::fabs(data.motor_rate[k]));
    s.rate.push_back(data.motor_rate[k]);
    s.place.push_back(data.motor[k]);
    s.torque.push_back(std::fabs(data.torque[k]));
    s.time.push_back(double(s.time.size()));
  }
}

/// 1 + the step of the strength that these samples ask for; its error from blocks that follow each other.
PartStrength strength(const Samples& s, const std::vector<std::size_t>& part, const std::string& name) {
  std::array<double, kBlocks> asked{}, weight{};
  for (const std::size_t i : part) {
    const std::size_t block = i * kBlocks / s.adds.size();
    asked[block] += s.adds[i] * s.left[i];
    weight[block] += s.adds[i] * s.adds[i];
  }
  const double all = std::accumulate(weight.begin(), weight.end(), 0.0),
               step = std::accumulate(asked.begin(), asked.end(), 0.0) / all;
  double variance = 0;
  for (std::size_t b = 0; b < kBlocks; ++b) variance += std::pow(asked[b] - step * weight[b], 2);
  return {name, 1 + step, std::sqrt(variance) / all};
}

struct Coordinate {
  std::vector<double> Samples::*values;
  std::array<const char*, kParts> parts;
};

constexpr std::array<Coordinate, 5> kCoordinates = {{
    {&Samples::speed, {"at low speed", "at medium speed", "at high speed"}},
    {&Samples::rate, {"moving backward", "moving slowly", "moving forward"}},
    {&Samples::place,
     {"in the lower third of the positions", "in the middle of the positions",
      "in the upper third of the positions"}},
    {&Samples::torque, {"at small torque", "at medium torque", "at large torque"}},
    {&Samples::time, {"early", "in the middle of the time", "late"}},
}};

bool at_noise(const Samples& s, double beyond) {
  return std::inner_product(s.left.begin(), s.left.end(), s.left.begin(), 0.0) <
         beyond * beyond * s.floor_square;
}

/// All samples, then thirds of them, of those that hold enough of what the effect does. None where little but
/// noise is left, which no effect stands in for.
std::vector<PartStrength> strengths(const Samples& s, const std::string& where,
                                    const BeliefSettings& settings) {
  std::vector<std::size_t> order(s.adds.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<PartStrength> all;
  if (order.size() < kParts * kBlocks || at_noise(s, settings.beyond_noise)) return all;
  all.push_back(strength(s, order, where));
  const double whole = std::inner_product(s.adds.begin(), s.adds.end(), s.adds.begin(), 0.0);
  for (const Coordinate& c : kCoordinates) {
    const std::vector<double>& values = s.*c.values;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
    for (std::size_t k = 0; k < kParts; ++k) {
      const std::vector<std::size_t> part(order.begin() + long(order.size() * k / kParts),
                                          order.begin() + long(order.size() * (k + 1) / kParts));
      double share = 0;
      for (const std::size_t i : part) share += s.adds[i] * s.adds[i] / whole;
      if (share >= settings.least_share) all.push_back(strength(s, part, where + " " + c.parts[k]));
    }
  }
  return all;
}

}  // namespace

std::optional<PartStrength> differing_part(const Hypothesis& h, std::size_t effect, const ServoData& unseen,
                                           const SearchContext& context) {
  const std::string& id = h.effects[effect].candidate.id;
  const BeliefSettings& settings = context.settings.belief;
  if (is_learned(id) || shapes_friction(id)) return std::nullopt;
  const Machine& machine = h.fitted->fit.machine;
  const model::Rig more = stronger(h, effect);
  const FitSettings& fit = context.settings.fit;
  const auto add = [&](const ServoData& data, const Calibration& calibration, Samples& samples) {
    add_samples(data, predict_servo(machine.rig, data, fit, calibration),
                predict_servo(more, data, fit, calibration), h.effects[effect].gain.deflection, samples);
  };
  Samples seen, other;
  for (std::size_t i = 0; i < context.data.size(); ++i) add(context.data[i], machine.calibrations[i], seen);
  add(unseen, calibrated(machine, unseen, fit), other);
  std::vector<PartStrength> all = strengths(seen, "on the training records", settings);
  for (PartStrength& s : strengths(other, "on the unseen record", settings)) all.push_back(std::move(s));
  std::optional<PartStrength> worst;
  for (const PartStrength& s : all) {
    const double off = std::fabs(s.ratio - 1);
    if (s.standard_error > settings.part_error || off < settings.least_constant ||
        off < settings.clearly * s.standard_error)
      continue;
    if (!worst || off > std::fabs(worst->ratio - 1)) worst = s;
  }
  return worst;
}

}  // namespace backlash::identification
