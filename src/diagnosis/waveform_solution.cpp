// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_solution.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// All choices, tried on simulated machines, but where another origin is given.
constexpr int kMostWindows = 12;       // beyond them the errors do not shrink: priors and equations limit
constexpr int kSearchWindows = 4;      // for the first guesses
constexpr double kCoarse = 0.01;       // of the swing, noise above which a coarse integration will do
constexpr double kModelError = 0.002;  // of the swing: no model is better
constexpr double kGuesses[] = {0.1, 0.3, 0.8, 2,
                               4.5};  // half gaps per twist of the sensor, along the line of action
constexpr double kFirstLoss = 0.2;    // spreads, of what cannot be below 0: from there its slope is not seen
constexpr double kHopeless = 0.08;    // of the swing, left of the torque early on: far from any fit
constexpr double kFreeLink =
    1.8;  // errors of a free link: simulation, some windows settle beside their best start
// Of a sampled torque that drives, per level: beyond it an answer was wrong and sure. What it leaves of the
// swing of each channel. Simulation.
constexpr double kMostDriveNoise = 0.03;
constexpr double kDriveNoise[kWaveformChannels] = {1, 0.4};
constexpr double kSure = 3;       // standard deviations of the correlation of white noise
constexpr double kLeftOut = 0.5;  // weight of a window that is said to be left out
// Theory: of a cost of some thousand, a hundredth of a standard error.
constexpr double kSettledFit = 1e-7;
constexpr double kSame = 0.05;  // of the logarithm of two gaps that are one
// Of the swing, what is left beyond noise where the machine is fitted with what a rig file may lack.
constexpr double kLacking[kWaveformChannels] = {0.01, 0.0006};

constexpr double kBentTo = 3;  // or spreads of a value, which has been bent to hold something else: theory

/// How far a stage looks, in cycles of the ring, and how much of the swing it takes as noise.
struct Look {
  double rings, noise;
  int iterations;
};
constexpr Look kSearch[] = {{3, 0.1, 6}, {3, 0.03, 6}, {5, 0.03, 5}};
constexpr Look kMiddle[] = {{8, 0.01, 8}, {12, 0.004, 8}};
constexpr Look kLast = {12, 0, 40};
constexpr double kSharp[] = {3, 5, 8, 12};  // rings, one after the other
constexpr int kSharpIterations = 12;

/// A machine fitted to some windows.
struct Fitted {
  std::unique_ptr<WaveformResiduals> windows;
  fit::WindowedFit fit;

  Fitted(const WaveformData& data, const WaveformSettings& settings, const WaveformPriors& priors,
         std::vector<std::size_t> chosen)
      : windows(std::make_unique<WaveformResiduals>(data, settings, priors, std::move(chosen))),
        fit(*windows) {}

  double value(int k) const { return windows->priors().value(k, fit.shared); }

  /// rms in noises of a channel of a window.
  double rms(int w, int channel) const {
    const VectorXd& r = fit.residual(w);
    const Index rows = r.size() / windows->channels();
    return std::sqrt(r.segment(channel * rows, rows).squaredNorm() / double(rows));
  }
};

class Solver {
 public:
  Solver(const record::Record& record, const WaveformSettings& settings, const WaveformTask& task)
      : settings_(settings), task_(task) {
    const bool locked = settings.output == WaveformOutput::locked;
    data_ = waveform_data(record, {waveform_ring(settings), kMostWindows, !locked, task.from, task.to});
    swing_[kTorqueChannel] = waveform_swing(data_.torque);
    swing_[kPositionChannel] = waveform_position_swing(data_, locked);
    drive_noise_ = drive_noise();
    for (int c = 0; c < channels(); ++c) signal_noise_[c] = signal_noise(WaveformChannel(c));
  }

  WaveformSolution solve() {
    Fitted fit = fitted(searched(priors(false)));
    if (beyond_noise(fit) > 1) fit = sharpened(std::move(fit));
    bool lacking = beyond_noise(fit) > 1;
    for (int k = kHalfGap + 1; k < kSharedValues; ++k) lacking |= std::fabs(fit.fit.shared[k]) > kBentTo;
    if (lacking) fit = with_what_it_lacks(fit);
    WaveformSolution s = solution(fit);
    s.lacking = lacking;
    return s;
  }

 private:
  int channels() const { return data_.position.empty() ? 1 : 2; }

  WaveformPriors priors(bool lacking) const {
    WaveformPriors p = waveform_priors(settings_, data_, lacking);
    if (fit::Prior& gap = p.shared[kHalfGap]; !std::isnan(task_.half_gap)) {
      gap.step *= gap.spread / task_.log_error;
      gap.centre = task_.half_gap, gap.spread = task_.log_error;
    }
    return p;
  }

  std::vector<std::size_t> all_windows() const {
    std::vector<std::size_t> all(data_.windows.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  std::vector<std::size_t> search_windows() const {
    std::vector<std::size_t> some;
    const std::size_t pairs = data_.windows.size() / 2,
                      take = std::min<std::size_t>(pairs, kSearchWindows / 2);
    for (std::size_t i = 0; i < take; ++i)
      some.push_back(i * pairs / take * 2), some.push_back(i * pairs / take * 2 + 1);
    return some;
  }

  void run(Fitted& f, const Look& look) const {
    f.windows->rings = look.rings;
    for (int c = 0; c < kWaveformChannels; ++c)
      f.windows->noise[c] = std::hypot(std::max(noise_[c], kModelError * swing_[c]), look.noise * swing_[c]);
    f.windows->coarse = look.noise >= kCoarse;
    fit::FitOptions options;
    options.iterations = look.iterations;
    options.central = look.noise == 0;
    if (look.noise == 0) options.tolerance = kSettledFit;
    f.fit.run(options);
  }

  /// Middle one of the windows.
  void measure_noise(const Fitted& f) {
    for (int c = 0; c < channels(); ++c) {
      std::vector<double> rms;
      for (int w = 0; w < f.windows->count(); ++w) rms.push_back(f.rms(w, c) * f.windows->noise[c]);
      noise_[c] = signal::median(rms);
    }
  }

  /// The best of several guesses of the gap, on some windows.
  Fitted searched(const WaveformPriors& priors) {
    const bool known = !std::isnan(task_.half_gap);
    const fit::Prior& gap = priors.shared[kHalfGap];
    std::vector<Fitted> fits;
    for (const double guess : kGuesses) {
      fits.emplace_back(data_, settings_, priors, search_windows());
      VectorXd& z = fits.back().fit.shared;
      z[kHalfGap] =
          known ? 0 : std::log(guess * waveform_twist(settings_, data_.level) / gap.centre) / gap.spread;
      for (const int k : {kDryFriction, kLinkFriction, kSensorTime})
        if (priors.shared[std::size_t(k)].spread > 0 && priors.shared[std::size_t(k)].centre == 0)
          z[k] = kFirstLoss;
      if (known) break;
    }
    for_each_in_parallel(int(fits.size()), [&](int i) {
      for (const Look& look : kSearch) run(fits[std::size_t(i)], look);
    });
    std::stable_sort(fits.begin(), fits.end(),
                     [](const Fitted& a, const Fitted& b) { return a.fit.cost() < b.fit.cost(); });
    while (fits.size() > 1 && std::fabs(std::log(fits[1].value(kHalfGap) / fits[0].value(kHalfGap))) < kSame)
      fits.erase(fits.begin() + 1);
    if (fits.size() > 2) fits.erase(fits.begin() + 2, fits.end());
    for (Fitted& f : fits) run(f, kMiddle[0]);
    if (fits.size() > 1) {
      const double more = fits[1].fit.cost() - fits[0].fit.cost();
      if (more < 0) std::swap(fits[0], fits[1]);
      rival_ = fits[1].value(kHalfGap), rival_cost_ = std::fabs(more);
    }
    return std::move(fits[0]);
  }

  /// On all windows, with the noise that it leaves.
  Fitted fitted(Fitted some) {
    measure_noise(some);
    run(some, kMiddle[1]);
    measure_noise(some);
    refuse_early();
    Fitted all(data_, settings_, some.windows->priors(), all_windows());
    all.fit.shared = some.fit.shared;
    run(all, kMiddle[1]);
    return finished(std::move(all));
  }

  Fitted finished(Fitted f) {
    for (int i = 0; i < 2; ++i) {
      measure_noise(f);
      widen_noise(f);
      run(f, kLast);
    }
    return f;
  }

  /// What a machine of another kind leaves is no noise of each sample: within half a cycle of the ring it is
  /// the same, and in all windows to one side, which are one experiment again and again.
  void widen_noise(const Fitted& f) {
    const double alike = waveform_ring(settings_) / (2 * data_.interval) * f.windows->count() / 2;
    for (int c = 0; c < channels(); ++c)
      noise_[c] = std::hypot(noise_[c], misfit(f, c).left() * std::sqrt(std::max(1.0, alike)));
  }

  /// What is left of the channels that is no noise, over what a machine that lacks nothing leaves.
  double beyond_noise(const Fitted& f) const {
    if (!std::isfinite(f.fit.cost()))
      return std::numeric_limits<double>::infinity();  // it cannot be followed
    double most = 0;
    for (int c = 0; c < channels(); ++c)
      most = std::max(most, misfit(f, c).left() / (kLacking[c] * swing_[c]));
    return most;
  }

  /// Fits with the noise that a wrong machine leaves stay where they are, as that hides what would move them:
  /// with the noise of the channels alone, and from the first rings on, whose phase no machine can mistake.
  /// The better of both.
  Fitted sharpened(Fitted plain) {
    Fitted f(data_, settings_, plain.windows->priors(), all_windows());
    f.fit.shared = plain.fit.shared;
    const double left[kWaveformChannels] = {noise_[0], noise_[1]};
    std::copy(std::begin(signal_noise_), std::end(signal_noise_), std::begin(noise_));
    for (const double rings : kSharp) run(f, {rings, 0, kSharpIterations});
    f = finished(std::move(f));
    if (beyond_noise(f) < beyond_noise(plain)) return f;
    std::copy(std::begin(left), std::end(left), std::begin(noise_));
    return plain;
  }

  Fitted with_what_it_lacks(const Fitted& plain) {
    Fitted f(data_, settings_, priors(true), all_windows());
    f.fit.shared = plain.fit.shared, f.fit.own = plain.fit.own;
    run(f, kLast);
    measure_noise(f);
    widen_noise(f);
    run(f, kLast);
    return f;
  }

  /// Of the level. A square wave is known by its levels, whatever their noise.
  double drive_noise() const {
    if (data_.square) return 0;
    const double noise = signal::noise_from_differences(data_.drive, 3) / data_.level;
    if (!(noise <= kMostDriveNoise))
      throw Refusal{
          Status::out_of_domain,
          fmt::format("motor_torque is no square wave, and its noise of {:.2g} % moves the machine that "
                      "it is taken to drive: at most {:.2g} %",
                      100 * noise, 100 * kMostDriveNoise)};
    return noise;
  }

  /// Nothing that comes later would mend this.
  void refuse_early() const {
    if (noise_[kTorqueChannel] >
        std::max(3 * signal_noise_[kTorqueChannel], kHopeless * swing_[kTorqueChannel]))
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the machine of the rig file, whatever its values, does not explain the torque: "
                      "{:.2g} % of its swing are left",
                      100 * noise_[kTorqueChannel] / swing_[kTorqueChannel])};
  }

  /// At most, by itself: a signal at rest between two steps of its resolution shows no noise.
  double signal_noise(WaveformChannel channel) const {
    const double period = 2.0 * double(data_.windows[1].first - data_.windows[0].first);
    std::vector<double> values = channel == kTorqueChannel ? data_.torque : data_.position;
    const double noise = signal::estimate_noise(values, period).upper;
    std::sort(values.begin(), values.end());
    double step = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < values.size(); ++i)
      if (values[i] > values[i - 1]) step = std::min(step, values[i] - values[i - 1]);
    return std::isfinite(step) ? std::max(noise, step) : noise;
  }

  WaveformMisfit misfit(const Fitted& f, int channel) const {
    double squares = 0, neighbours = 0, count = 0;
    for (int w = 0; w < f.windows->count(); ++w) {
      if (f.fit.weight(w) < kLeftOut) continue;
      const VectorXd& all = f.fit.residual(w);
      const Index rows = all.size() / channels();
      const VectorXd r = f.windows->noise[channel] * all.segment(channel * rows, rows);
      for (Index i = 2; i < r.size(); ++i) {
        squares += r[i] * r[i], ++count;
        neighbours += r[i] * (r[i - 1] + r[i - 2]) / 2;
      }
    }
    if (count == 0) squares = std::numeric_limits<double>::infinity(), count = 1;
    const double variance = squares / count, chance = kSure * variance / std::sqrt(2 * count);
    return {std::sqrt(variance), std::sqrt(std::max(0.0, neighbours / count - chance)),
            signal_noise_[channel], swing_[channel], kDriveNoise[channel] * drive_noise_ * swing_[channel]};
  }

  WaveformEvidence evidence(const Fitted& f) const {
    WaveformEvidence e;
    e.interval = data_.interval;
    e.torque_noise = f.windows->noise[kTorqueChannel];
    e.position_noise = channels() > 1 ? f.windows->noise[kPositionChannel] : kNaN;
    for (int w = 0; w < f.windows->count(); ++w) {
      if (f.fit.weight(w) < kLeftOut) {
        ++e.left_out;
        continue;
      }
      const WaveformWindow& of = data_.windows[std::size_t(w)];
      WaveformEvidence::Window window;
      window.start = data_.time[of.first];
      const std::size_t rows = f.windows->length(w);
      window.times.assign(of.at.begin(), of.at.begin() + std::ptrdiff_t(rows));
      for (int c = 0; c < channels(); ++c) {
        window.misfit = std::max(window.misfit, f.rms(w, c));
        WaveformEvidence::Trace& trace = c == kTorqueChannel ? window.torque : window.position;
        const std::vector<double>& all = c == kTorqueChannel ? data_.torque : data_.position;
        for (std::size_t i = 0; i < rows; ++i) {
          trace.measured.push_back(all[of.first + i]);
          trace.model.push_back(trace.measured.back() -
                                f.windows->noise[c] * f.fit.residual(w)[Index(std::size_t(c) * rows + i)]);
        }
      }
      e.windows.push_back(std::move(window));
    }
    return e;
  }

  /// With the values' deviations from what is declared, their common factor within them.
  WaveformSolution solution(const Fitted& f) const {
    WaveformSolution s;
    s.priors = f.windows->priors();
    s.half_gap = f.value(kHalfGap);
    s.wider = settings_.output == WaveformOutput::locked ? 1 : kFreeLink * kFreeLink;
    MatrixXd total = MatrixXd::Zero(kGlobalValues, kSharedValues);
    for (int k = 0; k < kGlobalValues; ++k) {
      if (!(s.priors.shared[std::size_t(k)].spread > 0)) continue;
      s.fitted.push_back(k);
      total(k, k) = 1;
      if (k != kHalfGap) total(k, kCommonScale) = s.priors.common(k);
    }
    s.covariance = s.wider * (total * f.fit.covariance() * total.transpose());
    const double clustered = s.wider * f.fit.clustered_covariance()(kHalfGap, kHalfGap);
    const VectorXd z = total * f.fit.shared;
    s.z.assign(z.data(), z.data() + kGlobalValues);
    s.pull.assign(f.fit.shared.data(), f.fit.shared.data() + kGlobalValues);
    s.left_of_spread.assign(kGlobalValues, 1);
    for (const int k : s.fitted)
      s.left_of_spread[std::size_t(k)] = std::min(1.0, std::sqrt(s.covariance(k, k)));
    for (int k = 0; k < kGlobalValues; ++k) s.values.push_back(f.value(k));
    s.log_error = s.priors.shared[kHalfGap].spread *
                  std::max(s.left_of_spread[kHalfGap], std::min(1.0, std::sqrt(clustered)));
    if (data_.position.empty()) s.log_error = std::max(s.log_error, waveform_symmetry_error(s.priors));
    s.prior_cost = f.fit.shared.squaredNorm() - std::pow(f.fit.shared[kHalfGap], 2);
    s.information =
        (f.fit.information() - MatrixXd::Identity(kSharedValues, kSharedValues))(s.fitted, s.fitted);
    s.foreign_torque = kForeignTorque * data_.level;
    s.finest = settings_.finest(), s.unit = settings_.angular ? "rad" : "m";
    for (int c = 0; c < channels(); ++c) s.misfit[c] = misfit(f, c);
    s.evidence = evidence(f);
    s.windows = f.windows->count(), s.left_out = s.evidence.left_out;
    s.cost = f.fit.cost();
    s.rival = rival_, s.rival_cost = rival_cost_;
    return s;
  }

  const WaveformSettings& settings_;
  WaveformTask task_;
  WaveformData data_;
  double swing_[kWaveformChannels] = {1, 1}, noise_[kWaveformChannels] = {0, 0},
         signal_noise_[kWaveformChannels] = {0, 0};
  double drive_noise_ = 0;
  double rival_ = kNaN, rival_cost_ = kNaN;
};

}  // namespace

double WaveformMisfit::left() const {
  const double noise_of = std::hypot(noise, drive);
  return std::max(std::sqrt(std::max(0.0, rms * rms - noise_of * noise_of)),
                  std::sqrt(std::max(0.0, structure * structure - drive * drive)));
}

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
                                                   "time constant of the torque",
                                                   "offset of the drive",
                                                   "slope of the drive",
                                                   "zero of the position",
                                                   "hysteresis of the teeth",
                                                   "Stribeck friction",
                                                   "load-dependent friction",
                                                   "quadratic drag",
                                                   "dry friction of the pinion",
                                                   "exponent of the teeth",
                                                   "curve of the sensor"};
  return names[which];
}

WaveformSolution solve_waveform(const record::Record& record, const WaveformSettings& settings,
                                const WaveformTask& task) {
  return Solver(record, settings, task).solve();
}

}  // namespace backlash::diagnosis
