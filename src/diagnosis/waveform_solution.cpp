// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_solution.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"
#include "waveform_priors.h"
#include "waveform_start.h"
#include "waveform_windows.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines, but where another origin is given.
constexpr int kMostWindows = 12;       // beyond them the errors do not shrink: priors and equations limit
constexpr int kSearchWindows = 4;      // for the first guesses
constexpr double kCoarse = 0.01;       // of the swing, noise above which a coarse integration will do
constexpr double kModelError = 0.002;  // of the swing: no model is better
constexpr double kGuesses[] = {0.1, 0.3, 0.8, 2,
                               4.5};  // half gaps per twist of the sensor, along the line of action
constexpr double kFirstLoss = 0.2;    // spreads, of what cannot be below 0: from there its slope is not seen
constexpr double kHopeless = 4;       // times the noise, or this share of the swing: far from any fit
constexpr double kHopelessSwing = 0.02;
constexpr double kFreeLink =
    1.8;  // errors of a free link: simulation, some windows settle beside their best start
// Of a sampled torque that drives, per level: beyond it an answer was wrong and sure. What it leaves of the
// swing of each channel. Simulation.
constexpr double kMostDriveNoise = 0.03;
constexpr double kDriveNoise[kWaveformChannels] = {1, 0.4};
constexpr double kLatest = 3;   // spreads, of the delay of the sensor
constexpr double kSure = 3;     // standard deviations of the correlation of white noise
constexpr double kLeftOut = 4;  // times the median misfit of the windows
constexpr double kLeftOutFree[kWaveformChannels] = {2, 9};  // of a free link, whose windows start anyhow

/// How far a stage looks, in cycles of the ring, and how much of the swing it takes as noise.
struct Look {
  double rings, noise;
  int iterations;
  bool central;
};
constexpr Look kSearch[] = {{3, 0.1, 6, false}, {3, 0.03, 6, false}, {5, 0.03, 5, false}};
constexpr Look kMiddle[] = {{8, 0.01, 8, false}, {12, 0.004, 8, true}};
constexpr Look kLast = {12, 0, 15, true};

class Solver {
 public:
  Solver(const record::EvenGrid& even, const WaveformSettings& settings, double told, double told_error,
         const std::vector<double>& places)
      : settings_(settings), ring_(waveform_ring(settings)), told_gap_(told), told_error_(told_error) {
    const bool free = settings.output != WaveformOutput::locked;
    const record::Record& record = even.record;
    data_.windows = waveform_windows(even, ring_, kMostWindows, free, places);
    data_.lost = even.lost;
    data_.torque = record.column(record::Channel::sensor_torque);
    data_.position = record.column(record::Channel::motor_position);
    time_ = record.time;
    for (const WaveformWindow& w : data_.windows)
      data_.level +=
          (std::fabs(w.before) + std::fabs(w.after)) / 2 / static_cast<double>(data_.windows.size());
    data_.grid = waveform_grid(settings, record.sampling_interval(), data_.level);
    data_.unseen = unseen_samples();
    swing_[kTorqueChannel] = waveform_swing(data_.torque);
    swing_[kPositionChannel] = waveform_position_swing(data_);
    data_.guesses = waveform_starts(data_, settings);
    data_.starts = waveform_start_count(data_, settings);
    drive_noise_ = drive_noise(record);
    for (double& noise : noise_) noise = 0;
    used_.assign(data_.windows.size(), true);
  }

  WaveformSolution solve() {
    WaveformPriors priors = waveform_priors(settings_, data_);
    if (!std::isnan(told_gap_)) priors[kHalfGap] = {told_gap_, told_error_, true};
    WaveformFit fit = searched(priors);
    for (const Look& look : kMiddle) {
      fit.run(stage(look, search_set()));
      measure_noise(fit, search_set());
    }
    refuse_early();
    for (const Look& look : kSearch) fit.run(starts_of_the_others(look));
    fit.run(stage(kMiddle[1], used_));
    leave_out(fit);
    measure_noise(fit, used_);
    fit.run(stage(kLast, used_));
    leave_out(fit);
    measure_noise(fit, used_);
    fit.run(stage(kLast, used_));
    return told(fit, priors);
  }

 private:
  /// At the start of a window: what a late sensor shows there was before it.
  int unseen_samples() const {
    const double latest = settings_.sensor_delay + kLatest * settings_.spread.sensor_delay;
    return std::min(static_cast<int>(std::ceil(latest / data_.grid.interval)),
                    waveform_lead(ring_, data_.grid.interval) / 2);
  }

  std::vector<bool> search_set() const {
    std::vector<bool> set(data_.windows.size(), false);
    const std::size_t pairs = set.size() / 2, take = std::min<std::size_t>(pairs, kSearchWindows / 2);
    for (std::size_t i = 0; i < take; ++i) set[i * pairs / take * 2] = set[i * pairs / take * 2 + 1] = true;
    return set;
  }

  WaveformFit::Stage stage(const Look& look, const std::vector<bool>& set) const {
    WaveformFit::Stage stage;
    for (std::size_t w = 0; w < set.size(); ++w)
      stage.lengths.push_back(
          set[w] ? waveform_length(data_.windows[w], look.rings, ring_, data_.grid.interval) : 0);
    for (int c = 0; c < kWaveformChannels; ++c)
      stage.noise[c] = std::hypot(std::max(noise_[c], kModelError * swing_[c]), look.noise * swing_[c]);
    stage.iterations = look.iterations;
    stage.central = look.central;
    stage.coarse = look.noise >= kCoarse;
    return stage;
  }

  WaveformFit::Stage starts_of_the_others(const Look& look) const {
    std::vector<bool> set = search_set();
    set.flip();
    WaveformFit::Stage only = stage(look, set);
    only.starts_only = true;
    return only;
  }

  /// The best of several guesses of the gap.
  WaveformFit searched(const WaveformPriors& priors) {
    std::vector<WaveformFit> fits;
    std::vector<double> costs;
    for (const double guess : kGuesses) {
      fits.emplace_back(data_, priors, settings_.common_scale);
      const WaveformPrior& gap = priors[kHalfGap];
      const bool known = !std::isnan(told_gap_);
      fits.back().point.z[kHalfGap] =
          known ? 0 : std::log(guess * waveform_twist(settings_, data_.level) / gap.value) / gap.spread;
      if (settings_.dry_friction == 0) fits.back().point.z[kDryFriction] = kFirstLoss;
      if (settings_.link_friction == 0) fits.back().point.z[kLinkFriction] = kFirstLoss;
      if (settings_.sensor_time_constant == 0) fits.back().point.z[kSensorTime] = kFirstLoss;
      double cost = 0;
      for (const Look& look : kSearch) cost = fits.back().run(stage(look, search_set()));
      costs.push_back(cost);
      if (known) break;
    }
    std::vector<std::size_t> order(costs.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return costs[a] < costs[b]; });
    WaveformFit& best = fits[order[0]];
    for (const std::size_t i : order) {  // the best that went elsewhere
      const double apart = fits[i].value(kHalfGap) / best.value(kHalfGap);
      if (std::fabs(std::log(apart)) < 0.05) continue;
      const double first = best.run(stage(kMiddle[0], search_set()));
      const double second = fits[i].run(stage(kMiddle[0], search_set()));
      rival_cost_ = std::fabs(second - first);
      WaveformFit& loser = second < first ? best : fits[i];
      rival_ = loser.value(kHalfGap);
      return second < first ? fits[i] : best;
    }
    return best;
  }

  /// Of the level. A square wave is known by its levels, whatever their noise.
  double drive_noise(const record::Record& record) const {
    if (data_.windows[0].drive.empty()) return 0;
    const double noise =
        signal::noise_from_differences(record.column(record::Channel::motor_torque), 3) / data_.level;
    if (!(noise <= kMostDriveNoise))
      throw Refusal{
          Status::out_of_domain,
          fmt::format("motor_torque is no square wave, and its noise of {:.2g} % moves the machine that "
                      "it is taken to drive: at most {:.2g} %",
                      100 * noise, 100 * kMostDriveNoise)};
    return noise;
  }

  double window_rms(const WaveformFit& fit, std::size_t window, WaveformChannel channel) const {
    double sum = 0;
    const std::vector<double> r = fit.residual(window, channel);
    for (const double e : r) sum += e * e / static_cast<double>(r.size());
    return std::sqrt(sum);
  }

  int channels() const { return data_.position.empty() ? 1 : 2; }

  void measure_noise(const WaveformFit& fit, const std::vector<bool>& set) {
    for (int c = 0; c < channels(); ++c) {
      std::vector<double> rms;
      for (std::size_t w = 0; w < used_.size(); ++w)
        if (set[w]) rms.push_back(window_rms(fit, w, static_cast<WaveformChannel>(c)));
      noise_[c] = signal::median(rms);
    }
  }

  /// Nothing that comes later would mend this.
  void refuse_early() const {
    const double noise = signal_noise(kTorqueChannel);
    if (noise_[kTorqueChannel] > kHopeless * std::max(noise, kHopelessSwing * swing_[kTorqueChannel]))
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the machine of the rig file, whatever its values, does not explain the torque: "
                      "{:.2g} % of its swing are left",
                      100 * noise_[kTorqueChannel] / swing_[kTorqueChannel])};
  }

  /// At most, by itself: a signal at rest between two steps of its resolution shows no noise.
  double signal_noise(WaveformChannel channel) const {
    const double period = 2.0 * (data_.windows[1].first - data_.windows[0].first);
    std::vector<double> values = channel == kTorqueChannel ? data_.torque : data_.position;
    const double noise = signal::estimate_noise(values, period).upper;
    std::size_t recorded = 0;  // what is interpolated lies anywhere between two steps
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!data_.lost[i]) values[recorded++] = values[i];
    values.resize(recorded);
    std::sort(values.begin(), values.end());
    double step = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < values.size(); ++i)
      if (values[i] > values[i - 1]) step = std::min(step, values[i] - values[i - 1]);
    return std::isfinite(step) ? std::max(noise, step) : noise;
  }

  /// Windows whose motion the start values do not catch.
  void leave_out(const WaveformFit& fit) {
    for (int c = 0; c < channels(); ++c) {
      std::vector<double> rms(used_.size(), 0), of_used;
      for (std::size_t w = 0; w < used_.size(); ++w)
        if (used_[w]) of_used.push_back(rms[w] = window_rms(fit, w, static_cast<WaveformChannel>(c)));
      if (of_used.empty()) return;  // a fit that went nowhere: it is refused for what it leaves out
      const double middle = signal::median(of_used);
      const bool locked = data_.grid.output == WaveformOutput::locked;
      const double most =
          std::max(middle, kModelError * swing_[c]) * std::sqrt(locked ? kLeftOut : kLeftOutFree[c]);
      for (std::size_t w = 0; w < used_.size(); ++w)
        if (!(rms[w] <= most)) used_[w] = false;
    }
  }

  WaveformMisfit misfit(const WaveformFit& fit, WaveformChannel channel) const {
    double squares = 0, neighbours = 0, count = 0;
    for (std::size_t w = 0; w < used_.size(); ++w) {
      if (!used_[w]) continue;
      const std::vector<double> r = fit.residual(w, channel);
      for (std::size_t i = 2; i < r.size(); ++i) {
        squares += r[i] * r[i], ++count;
        neighbours += r[i] * (r[i - 1] + r[i - 2]) / 2;
      }
    }
    const double variance = squares / count, chance = kSure * variance / std::sqrt(2 * count);
    return {std::sqrt(variance), std::sqrt(std::max(0.0, neighbours / count - chance)), signal_noise(channel),
            swing_[channel], kDriveNoise[channel] * drive_noise_ * swing_[channel]};
  }

  WaveformEvidence::Trace trace(const WaveformFit& fit, std::size_t window, WaveformChannel channel) const {
    const std::vector<double>& all = channel == kTorqueChannel ? data_.torque : data_.position;
    const std::vector<double> r = fit.residual(window, channel);
    WaveformEvidence::Trace trace;
    for (std::size_t i = 0; i < r.size(); ++i) {
      trace.measured.push_back(all[static_cast<std::size_t>(data_.windows[window].first) + i]);
      trace.model.push_back(trace.measured.back() - r[i]);
    }
    return trace;
  }

  double fitted_noise(WaveformChannel channel) const {
    return std::max(noise_[channel], kModelError * swing_[channel]);
  }

  WaveformEvidence evidence(const WaveformFit& fit) const {
    WaveformEvidence e;
    e.interval = data_.grid.interval;
    e.torque_noise = fitted_noise(kTorqueChannel);
    e.position_noise = channels() > 1 ? fitted_noise(kPositionChannel) : kNaN;
    e.left_out = static_cast<int>(std::count(used_.begin(), used_.end(), false));
    for (std::size_t w = 0; w < used_.size(); ++w) {
      if (!used_[w]) continue;
      WaveformEvidence::Window window;
      window.start = time_[static_cast<std::size_t>(data_.windows[w].first)];
      for (int c = 0; c < channels(); ++c) {
        const auto channel = static_cast<WaveformChannel>(c);
        window.misfit = std::max(window.misfit, window_rms(fit, w, channel) / fitted_noise(channel));
        (c == kTorqueChannel ? window.torque : window.position) = trace(fit, w, channel);
      }
      e.windows.push_back(std::move(window));
    }
    return e;
  }

  WaveformSolution told(const WaveformFit& fit, const WaveformPriors& priors) const {
    WaveformSolution s;
    s.half_gap = fit.value(kHalfGap);
    const double wider = settings_.output == WaveformOutput::locked ? 1 : kFreeLink * kFreeLink;
    const Eigen::MatrixXd covariance = wider * fit.covariance();
    s.z.assign(fit.point.z.data(), fit.point.z.data() + kGlobalValues);
    s.told.assign(kGlobalValues, 1);
    for (std::size_t i = 0; i < fit.fitted().size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      s.told[static_cast<std::size_t>(fit.fitted()[i])] = std::min(1.0, std::sqrt(covariance(k, k)));
    }
    for (int k = 0; k < kGlobalValues; ++k) s.values.push_back(fit.value(k));
    s.log_error = priors[kHalfGap].spread * s.told[kHalfGap];
    if (data_.position.empty())
      s.log_error = std::max(s.log_error, waveform_symmetry_error(priors, settings_.common_scale));
    Eigen::VectorXd machine = fit.point.z;
    machine[kHalfGap] = 0;
    s.prior_cost = fit.prior_cost(machine);
    s.covariance = Eigen::MatrixXd::Zero(kGlobalValues, kGlobalValues);
    s.covariance(fit.fitted(), fit.fitted()) = covariance;
    s.information = fit.information(), s.fitted = fit.fitted(), s.wider = wider;
    s.priors = priors, s.common_scale = settings_.common_scale;
    s.finest = settings_.finest(), s.unit = settings_.angular ? "rad" : "m";
    for (int c = 0; c < channels(); ++c) s.misfit[c] = misfit(fit, static_cast<WaveformChannel>(c));
    s.windows = static_cast<int>(used_.size());
    s.left_out = static_cast<int>(std::count(used_.begin(), used_.end(), false));
    s.iterations = fit.iterations();
    s.cost = fit.cost();
    s.rival = rival_, s.rival_cost = rival_cost_;
    s.evidence = evidence(fit);
    return s;
  }

  const WaveformSettings& settings_;
  double ring_;
  std::vector<double> time_;
  WaveformData data_;
  double told_gap_, told_error_;
  double swing_[kWaveformChannels], noise_[kWaveformChannels];
  std::vector<bool> used_;
  double drive_noise_ = 0;
  double rival_ = kNaN, rival_cost_ = kNaN;
};

}  // namespace

const char* waveform_value_name(int which) {
  static const char* const names[kGlobalValues] = {"half gap",
                                                   "motor damping",
                                                   "dry friction",
                                                   "speed of dry friction",
                                                   "sensor stiffness",
                                                   "sensor damping",
                                                   "motor inertia",
                                                   "pinion inertia",
                                                   "gear inertia",
                                                   "output stiffness",
                                                   "output damping",
                                                   "contact stiffness",
                                                   "contact loss",
                                                   "contact damping",
                                                   "link inertia",
                                                   "link damping",
                                                   "dry friction of the link",
                                                   "sensor gain",
                                                   "sensor bias",
                                                   "delay of the sensor",
                                                   "time constant of the sensor",
                                                   "delay of the torque",
                                                   "offset of the drive",
                                                   "slope of the drive",
                                                   "zero of the position"};
  return names[which];
}

WaveformSolution solve_waveform(const record::Record& record, const WaveformSettings& settings, double told,
                                double told_error, const std::vector<double>& places) {
  return Solver(record::even_grid(record), settings, told, told_error, places).solve();
}

}  // namespace backlash::diagnosis
