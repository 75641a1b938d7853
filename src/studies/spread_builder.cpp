// SPDX-License-Identifier: BSD-3-Clause
#include "spread_builder.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::studies {
namespace {

using diagnosis::DeclaredSpread;

constexpr int kPlaces = 9;            // backlash values of each: choice
constexpr double kReach = 1.5;        // of the curve's length, largest backlash: as its family
constexpr double kDenser = 1.5;       // exponent: a tenth of them below 3 % of the reach. Choice
constexpr int kMostPeriods = 5;       // of a record: choice
constexpr int kMostPhases = 4;        // of a sample: choice
constexpr double kNear = 0.25;        // of the curve's length: answers whose errors are alike. Choice
constexpr std::uint64_t kSeed = 640;  // of the drawn machines

struct Trial {
  double truth = 0;
  diagnosis::Estimate skewness, shape;
};

CurvePlan shorter(CurvePlan plan) {
  plan.request.periods = std::min(plan.request.periods, kMostPeriods);
  plan.phases = std::min(plan.phases, kMostPhases);
  return plan;
}

double length_of(const diagnosis::MonitoringCurve& curve) {
  return curve.points.back().backlash - curve.points.front().backlash;
}

record::Record record_of(const CurvePlan& plan, std::vector<double> samples) {
  record::Record record;
  for (std::size_t k = 0; k < samples.size(); ++k)
    record.time.push_back(static_cast<double>(k) / plan.request.sampling_rate);
  record.column(plan.apd.signal) = std::move(samples);
  return record;
}

/// What the sensor shows of a run, at any phase and any noise but the largest of the curve.
struct Sampled {
  std::size_t machine = 0, noise = 0;
  std::vector<double> samples;
};

Sampled sampled(const CurvePlan& plan, const FineRun& run, std::size_t machine) {
  Random random(kSeed + 1, static_cast<std::uint32_t>(machine));
  const int phase = static_cast<int>(random.below(static_cast<std::size_t>(plan.phases)));
  const std::size_t noise = random.below(plan.noise_levels.size() - 1);
  const int seed = static_cast<int>(random.below(1 << 20));
  return {machine, noise, sample(plan, run, phase, seed, plan.noise_levels[noise])};
}

Trial try_out(const CurvePlan& plan, const diagnosis::MonitoringCurve& curve, double truth,
              std::vector<double> samples) {
  diagnosis::DiagnosisSettings settings;
  settings.apd = plan.apd;
  const diagnosis::Diagnosis diagnosis =
      diagnosis::diagnose(record_of(plan, std::move(samples)), settings, &curve);
  Trial trial;
  trial.truth = truth;
  for (const diagnosis::Estimate& e : diagnosis.estimates) {
    if (e.method == "apd_skewness") trial.skewness = e;
    if (e.method == "apd_shape") trial.shape = e;
  }
  return trial;
}

/// Each drawn machine at backlash values of its own, spread over the curve and beyond; denser where backlash
/// is small, as those alone show a lower bound above the truth.
std::vector<Machine> machines_of(const CurvePlan& plan) {
  std::vector<Machine> machines;
  for (int m = 0; m < plan.request.machines; ++m) {
    Random random(kSeed, static_cast<std::uint32_t>(m));
    const Machine machine = draw_machine(plan.file, random.bits());
    const double offset = random.uniform();
    for (int k = 0; k < kPlaces; ++k) {
      const double place = std::pow((k + offset) / kPlaces, kDenser);
      machines.push_back(with_backlash(machine, kReach * plan.request.max_backlash * place));
    }
  }
  // Machines that stick cannot be moved together with others.
  std::stable_partition(machines.begin(), machines.end(),
                        [](const Machine& m) { return m.rig.motor.coulomb_friction == 0; });
  return machines;
}

std::vector<Trial> run_trials(const CurvePlan& plan, const diagnosis::MonitoringCurve& curve,
                              Ticker& ticker) {
  const std::vector<Machine> machines = machines_of(plan);
  std::vector<Sampled> records(machines.size());
  const std::size_t chunks = (machines.size() + kTogether - 1) / kTogether;
  for_each_in_parallel(static_cast<int>(chunks), ticker, [&](int chunk) {
    const std::size_t begin = chunk * kTogether, end = std::min(begin + kTogether, machines.size());
    const auto runs = run_fine(plan, {machines.begin() + begin, machines.begin() + end}, ticker);
    for (std::size_t i = begin; i < end; ++i) records[i] = sampled(plan, runs[i - begin], i);
  });
  // By noise, as the family is made noisy for each: it knows the last few.
  std::stable_sort(records.begin(), records.end(),
                   [](const Sampled& a, const Sampled& b) { return a.noise < b.noise; });
  std::vector<Trial> trials(records.size());
  for_each_in_parallel(static_cast<int>(records.size()), ticker, [&](int i) {
    Sampled& record = records[i];
    trials[i] = try_out(plan, curve, machines[record.machine].rig.mesh.backlash, std::move(record.samples));
  });
  return trials;
}

/// How far answers near a backlash are off: all within `near`, and the kFewest nearest; `all` that were
/// drawn where there are too few.
void add_point(std::vector<const Trial*> answered, diagnosis::Estimate Trial::*method, double backlash,
               double near, double all, DeclaredSpread::Widening& w) {
  const auto distance = [&](const Trial* t) { return std::fabs((t->*method).backlash - backlash); };
  if (answered.size() < DeclaredSpread::kFewest) {
    w.below.push_back(all);
    w.above.push_back(all);
    return;
  }
  std::sort(answered.begin(), answered.end(),
            [&](const Trial* a, const Trial* b) { return distance(a) < distance(b); });
  double below = 0, above = 0;
  for (std::size_t i = 0;
       i < answered.size() && (i < DeclaredSpread::kFewest || distance(answered[i]) < near); ++i) {
    below = std::max(below, (answered[i]->*method).lower - answered[i]->truth);
    above = std::max(above, answered[i]->truth - (answered[i]->*method).upper);
  }
  w.below.push_back(below);
  w.above.push_back(above);
}

DeclaredSpread::Widening widening(const std::vector<Trial>& trials, diagnosis::Estimate Trial::*method,
                                  const diagnosis::MonitoringCurve& curve) {
  DeclaredSpread::Widening w;
  w.bound = 0;
  std::vector<const Trial*> answered;
  for (const Trial& trial : trials) {
    const diagnosis::Estimate& e = trial.*method;
    if (e.status == diagnosis::Status::ok) answered.push_back(&trial);
    if (e.status == diagnosis::Status::above_range) w.bound = std::fmax(w.bound, e.lower - trial.truth);
  }
  for (const diagnosis::CurvePoint& point : curve.points)
    add_point(answered, method, point.backlash, kNear * length_of(curve),
              kReach * curve.points.back().backlash, w);
  return w;
}

double skewness_of(const CurvePlan& plan, const FineRun& run) {
  diagnosis::DiagnosisSettings settings;
  settings.apd = plan.apd;
  const record::Record record = record_of(plan, sample(plan, run, 0, 0, 0));
  return diagnosis::diagnose(record, settings, nullptr).apd->skewness;
}

/// What changes skewness most when it is off by its spread, in the middle of the curve.
std::string limit_of(const CurvePlan& plan, Ticker& ticker) {
  const double middle = plan.request.max_backlash / 2;
  std::vector<Machine> machines = {with_backlash(declared_machine(plan.file), middle)};
  const auto& all = diagnosis::waveform_quantities();
  std::vector<std::size_t> places;
  for (std::size_t q = 0; q <= all.size(); ++q)
    if (q == all.size() || all[q].in(*plan.file.diagnosis.waveform)) places.push_back(q);
  for (const std::size_t q : places) machines.push_back(with_backlash(machine_off(plan.file, q, 1), middle));
  const std::vector<FineRun> runs = run_fine(plan, machines, ticker);
  const double declared = skewness_of(plan, runs[0]);
  std::size_t most = 0;
  double change = -1;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double by = std::fabs(skewness_of(plan, runs[i + 1]) - declared);
    if (by > change) change = by, most = places[i];
  }
  return most < all.size() ? all[most].words : "scale that all values have in common";
}

}  // namespace

long spread_runs(const CurvePlan& plan) {
  if (!plan.file.diagnosis.waveform || plan.request.machines == 0) return 0;
  const auto& all = diagnosis::waveform_quantities();
  const auto has = [&plan](const diagnosis::WaveformQuantity& q) {
    return q.in(*plan.file.diagnosis.waveform);
  };
  return static_cast<long>(plan.request.machines) * kPlaces + std::count_if(all.begin(), all.end(), has) + 2;
}

DeclaredSpread learn_spread(const CurvePlan& plan, const diagnosis::MonitoringCurve& curve, Ticker& ticker) {
  const CurvePlan brief = shorter(plan);
  const std::vector<Trial> trials = run_trials(brief, curve, ticker);
  DeclaredSpread spread;
  spread.machines = plan.request.machines;
  spread.limit = limit_of(brief, ticker);
  spread.skewness = widening(trials, &Trial::skewness, curve);
  spread.shape = widening(trials, &Trial::shape, curve);
  return spread;
}

}  // namespace backlash::studies
