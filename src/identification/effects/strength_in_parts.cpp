// SPDX-License-Identifier: BSD-3-Clause
#include "strength_in_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "effect_roles.h"
#include "found_effects.h"
#include "unseen_gain.h"
#include "unseen_record.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kParts = 3, kBlocks = 30;  // choice
constexpr double kStep = 0.02;                   // theory: of a strength; small, and far above rounding

/// What the effect adds to a channel, what is left there, and the motion: of the samples that count.
struct Samples {
  std::vector<double> adds, left;                        // N m or rad
  std::vector<double> speed, rate, place, torque, time;  // SI units, sizes of speed and torque
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
  const auto& counts = deflection ? as_fitted.settled : as_fitted.counts;
  for (std::size_t k = 0; k < data.size(); ++k) {
    const double adds = ((stronger.*signal)[k] - (as_fitted.*signal)[k]) / kStep;
    if (!counts[k] || adds == 0) continue;
    s.adds.push_back(adds);
    s.left.push_back((as_fitted.*measured)[k] - (as_fitted.*signal)[k]);
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

/// All samples, then thirds of them, of those that hold enough of what the effect does.
std::vector<PartStrength> strengths_of(const Samples& s, const std::string& where, double least_share) {
  std::vector<std::size_t> order(s.adds.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<PartStrength> all;
  if (order.size() < kParts * kBlocks) return all;
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
      if (share >= least_share) all.push_back(strength(s, part, where + " " + c.parts[k]));
    }
  }
  return all;
}

}  // namespace

StrengthInParts::StrengthInParts(const Hypothesis& h, const ServoData& unseen, const SearchContext& context)
    : h_(h), context_(context) {
  const Machine& machine = h.fitted->fit.machine;
  const FitSettings& fit = context.settings.fit;
  const auto record = [&](const ServoData& data, const Calibration& calibration) {
    return Record{&data, calibration, predict_servo(machine.rig, data, fit, calibration)};
  };
  for (std::size_t i = 0; i < context.data.size(); ++i)
    seen_.push_back(record(context.data[i], machine.calibrations[i]));
  unseen_.push_back(record(unseen, calibrated(machine, unseen, fit)));
}

std::vector<PartStrength> StrengthInParts::strengths(const std::vector<Record>& records, std::size_t effect,
                                                     const model::Rig& stronger,
                                                     const std::string& where) const {
  const BeliefSettings& settings = context_.settings.belief;
  const bool deflection = h_.effects[effect].gain.deflection;
  double left_square = 0, noise = 0;
  for (const Record& r : records) {
    const Left of_record = left(r.prediction, deflection, settings);
    left_square += of_record.total();
    noise += of_record.noise;
  }
  if (left_square < settings.beyond_noise * settings.beyond_noise * noise) return {};
  Samples samples;
  for (const Record& r : records)
    add_samples(*r.data, r.prediction, predict_servo(stronger, *r.data, context_.settings.fit, r.calibration),
                deflection, samples);
  return strengths_of(samples, where, settings.least_share);
}

std::optional<PartStrength> StrengthInParts::differing(std::size_t effect) const {
  const std::string& id = h_.effects[effect].candidate.id;
  if (is_learned(id) || shapes_friction(id)) return std::nullopt;
  const BeliefSettings& settings = context_.settings.belief;
  const model::Rig more = stronger(h_, effect);
  std::vector<PartStrength> all = strengths(seen_, effect, more, "on the training records");
  for (PartStrength& s : strengths(unseen_, effect, more, "on the unseen record"))
    all.push_back(std::move(s));
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
