// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/uncertainty_study.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "drawn_record.h"

namespace backlash::studies {
namespace {

// What makes a miss one that was wrong and sure. Choices.
constexpr double kWidths = 2;          // of the interval, outside of it
constexpr double kFarOutside = 10e-6;  // m (angular mesh: rad), outside of it, and
constexpr double kFarOfTruth = 0.2;    // this share of the backlash

Draw draw(const StudyRequest& request, double period, std::uint64_t index) {
  Random random(request.seed, static_cast<std::uint32_t>(index));
  Draw d{};
  d.backlash = request.max_backlash * random.uniform();
  d.noise = request.noise[random.below(request.noise.size())];
  d.start = period * random.uniform();
  d.periods = request.fewest_periods +
              static_cast<int>(random.uniform() * (request.most_periods - request.fewest_periods + 1));
  d.seed = random.bits();
  return d;
}

using Change = std::function<void(rig_file::RigFile&)>;

record::Record signal_alone(const record::Record& record, record::Channel signal) {
  record::Record alone;
  alone.name = record.name;
  alone.time = record.time;
  alone.column(signal) = record.column(signal);
  return alone;
}

/// What a rig without encoders records.
record::Record torques_alone(const record::Record& record, record::Channel signal) {
  record::Record alone = signal_alone(record, signal);
  alone.column(record::Channel::motor_torque) = record.column(record::Channel::motor_torque);
  return alone;
}

std::vector<diagnosis::Estimate> estimates_of(const record::Record& record, const rig_file::RigFile& file,
                                              const diagnosis::MonitoringCurve& curve, bool waveform) {
  diagnosis::DiagnosisSettings settings = file.diagnosis;
  if (!waveform) settings.leave_out_waveform();
  const diagnosis::Diagnosis diagnosis = diagnosis::diagnose(record, settings, &curve);
  std::vector<diagnosis::Estimate> all = diagnosis.estimates;
  all.push_back(estimate_of_verdict(diagnosis.verdict));
  return all;
}

void check(const rig_file::RigFile& file, const StudyRequest& request) {
  if (!file.diagnosis.apd) throw InvalidParameter("diagnosis.apd", "absent", "the study needs its signal");
  if (!(file.diagnosis.apd->period > 0))
    throw InvalidParameter("diagnosis.apd.period", "absent", "the study counts in periods");
  if (request.records < 1) throw InvalidParameter("records", request.records, "must be >= 1");
  if (!(request.max_backlash > 0 && std::isfinite(request.max_backlash)))
    throw InvalidParameter("max_backlash", request.max_backlash, "must be > 0 and finite");
  if (request.fewest_periods < 1 || request.most_periods < request.fewest_periods)
    throw InvalidParameter("periods", request.fewest_periods, "must be >= 1 and not above the most");
  if (request.noise.empty()) throw InvalidParameter("noise", "none", "needs at least one level");
  for (const double level : request.noise)
    if (!(level >= 0 && std::isfinite(level))) throw InvalidParameter("noise", level, "must be >= 0");
}

rig_file::RigFile at_rate(rig_file::RigFile file, double rate) {
  if (rate > 0) file.simulation.sensors.sampling_rate = rate;
  return file;
}

double width(const diagnosis::Estimate& e) {
  return e.upper - e.lower;
}

bool holds(const diagnosis::Estimate& e, double truth) {
  return truth >= e.lower && truth <= e.upper;
}

bool wrong_and_sure(const diagnosis::Estimate& e, double truth) {
  const double outside = std::max(e.lower - truth, truth - e.upper);
  return outside > kWidths * width(e) || (outside > kFarOutside && outside > kFarOfTruth * truth);
}

struct Variant {
  std::string name;
  Change change;
  double shortest = 0;  // of max_backlash: the smallest backlash drawn
  double duration = 0;  // periods after settling; 0: as drawn
};

std::vector<Variant> variants_of(const rig_file::RigFile& file) {
  const auto amplitude = [](double factor) {
    return [factor](rig_file::RigFile& f) { f.simulation.excitation.amplitude *= factor; };
  };
  const auto frequency = [](double factor) {
    return [factor](rig_file::RigFile& f) { f.simulation.excitation.frequency *= factor; };
  };
  const auto sampling = [](double factor) {
    return [factor](rig_file::RigFile& f) { f.simulation.sensors.sampling_rate *= factor; };
  };
  const double torque = file.simulation.excitation.amplitude;
  const auto limit = [torque](double factor) {
    return [torque, factor](rig_file::RigFile& f) {
      f.simulation.sensors.of(f.diagnosis.apd->signal).limit = factor * torque;
    };
  };
  const auto free_output = [](double inertia) {
    return [inertia](rig_file::RigFile& f) {
      f.rig.link_locked = false;
      f.rig.link.inertia = inertia;
    };
  };
  return {{"amplitude -20 %", amplitude(0.8)},
          {"amplitude +20 %", amplitude(1.2)},
          {"frequency -20 %", frequency(0.8)},
          {"frequency +25 %", frequency(1.25)},
          {"sampling halved", sampling(0.5)},
          {"sampling doubled", sampling(2)},
          {"saturated at 0.8", limit(0.8)},
          {"saturated at 1.2", limit(1.2)},
          {"output free", free_output(1e-3)},
          {"output free and light", free_output(5e-5)},
          {"constant torque", [](rig_file::RigFile& f) { f.simulation.excitation.type = "constant"; }},
          {"too short", [](rig_file::RigFile&) {}, 0, -1.2},
          {"above the range", [](rig_file::RigFile&) {}, 1.1}};
}

record::Record simulate_variant(const rig_file::RigFile& file, const Variant& variant, const Draw& d,
                                int settling) {
  rig_file::RigFile machine = file;
  variant.change(machine);
  record::Record record = simulate_draw(machine, d);
  if (variant.duration != 0)
    record = record.slice(0, (settling + variant.duration) * file.diagnosis.apd->period);
  return record;
}

}  // namespace

rig_file::RigFile known_to(rig_file::RigFile file, double share) {
  if (!(share > 0 && std::isfinite(share))) throw InvalidParameter("known", share, "must be > 0 and finite");
  if (!file.diagnosis.waveform) throw InvalidParameter("known", share, file.diagnosis.no_waveform);
  diagnosis::WaveformSpread& spread = file.diagnosis.waveform->spread;
  for (double* friction : {&spread.dry_friction, &spread.link_friction})
    if (std::isnan(*friction))
      *friction = diagnosis::WaveformSpread::kDryFriction * file.simulation.excitation.amplitude;
  for (const diagnosis::WaveformQuantity& q : diagnosis::waveform_quantities()) spread.*q.spread *= share;
  file.diagnosis.waveform->common_scale *= share;
  return file;
}

std::vector<StudyTrial> run_study(const rig_file::RigFile& rig_file, const diagnosis::MonitoringCurve& curve,
                                  const StudyRequest& request, const Progress& progress) {
  check(rig_file, request);
  const rig_file::RigFile file = at_rate(rig_file, request.sampling_rate);
  const diagnosis::ApdSettings& apd = *file.diagnosis.apd;
  std::vector<StudyTrial> trials(2 * static_cast<std::size_t>(request.records));
  Ticker ticker(progress, request.records, "simulating and diagnosing records");
  for_each_in_parallel(request.records, ticker, [&](int i) {
    const Draw d = draw(request, apd.period, static_cast<std::uint64_t>(i));
    const record::Record record = simulate_draw(file, d);
    trials[2 * i] = {"",        d.backlash, d.noise,
                     d.periods, true,       estimates_of(record, file, curve, request.waveform)};
    trials[2 * i + 1] = {
        "",      d.backlash,
        d.noise, d.periods,
        false,   estimates_of(torques_alone(record, apd.signal), file, curve, request.waveform)};
    ticker.tick();
  });
  return trials;
}

std::vector<StudyRow> summarise_study(const std::vector<StudyTrial>& trials, bool position,
                                      double max_half_gap, double noise) {
  std::vector<StudyRow> rows;
  const std::size_t methods = trials.empty() ? 0 : trials.front().estimates.size();
  for (std::size_t m = 0; m < methods; ++m) {
    StudyRow row;
    std::vector<double> errors, widths;
    int held = 0;
    for (const StudyTrial& trial : trials) {
      if (trial.position != position || trial.backlash > 2 * max_half_gap) continue;
      if (!std::isnan(noise) && trial.noise != noise) continue;
      const diagnosis::Estimate& e = trial.estimates[m];
      row.method = e.method;
      ++row.trials;
      if (e.status != diagnosis::Status::ok) continue;
      errors.push_back(std::fabs(e.backlash - trial.backlash));
      widths.push_back(width(e));
      held += holds(e, trial.backlash);
      row.wrong_and_sure += wrong_and_sure(e, trial.backlash);
    }
    row.answered = static_cast<int>(errors.size());
    if (row.trials > 0) row.cannot_tell = 1 - static_cast<double>(row.answered) / row.trials;
    if (row.answered > 0) {
      row.coverage = static_cast<double>(held) / row.answered;
      row.p95_error = signal::quantile(errors, 0.95);
      row.median_error = signal::median(std::move(errors));
      row.median_width = signal::median(std::move(widths));
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<StudyTrial> run_variants(const rig_file::RigFile& rig_file,
                                     const diagnosis::MonitoringCurve& curve, const StudyRequest& request,
                                     int records, const Progress& progress) {
  check(rig_file, request);
  const rig_file::RigFile file = at_rate(rig_file, request.sampling_rate);
  const diagnosis::ApdSettings& apd = *file.diagnosis.apd;
  const std::vector<Variant> variants = variants_of(file);
  const int count = records * static_cast<int>(variants.size());
  std::vector<StudyTrial> trials(2 * static_cast<std::size_t>(count));
  Ticker ticker(progress, count, "records under other conditions");
  for_each_in_parallel(count, ticker, [&](int i) {
    const Variant& variant = variants[i / records];
    Draw d = draw(request, apd.period, static_cast<std::uint64_t>(request.records) + i);
    d.backlash += variant.shortest * request.max_backlash;
    const record::Record record = simulate_variant(file, variant, d, apd.settling_periods);
    trials[2 * i] = {variant.name, d.backlash, d.noise,
                     d.periods,    true,       estimates_of(record, file, curve, request.waveform)};
    trials[2 * i + 1] = {
        variant.name, d.backlash,
        d.noise,      d.periods,
        false,        estimates_of(signal_alone(record, apd.signal), file, curve, request.waveform)};
    ticker.tick();
  });
  return trials;
}

std::vector<VariantRow> summarise_variants(const std::vector<StudyTrial>& trials) {
  std::vector<VariantRow> rows;
  const auto row_of = [&rows](const StudyTrial& trial, const std::string& method) -> VariantRow& {
    for (VariantRow& row : rows)
      if (row.variant == trial.variant && row.method == method && row.position == trial.position) return row;
    rows.push_back({trial.variant, method, trial.position});
    return rows.back();
  };
  for (const StudyTrial& trial : trials)
    for (const diagnosis::Estimate& e : trial.estimates) {
      VariantRow& row = row_of(trial, e.method);
      const double below = e.lower - trial.backlash, above = trial.backlash - e.upper;
      const bool near = std::max(below, above) <= width(e);
      ++(e.status != diagnosis::Status::ok ? row.recognised : near ? row.right : row.wrong);
    }
  return rows;
}

}  // namespace backlash::studies
