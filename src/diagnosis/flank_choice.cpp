// SPDX-License-Identifier: BSD-3-Clause
#include "flank_choice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"

namespace backlash::diagnosis {
namespace {

constexpr std::size_t kHalves[] = {4, 8, 16, 32};  // samples, half a window
// Laws by which a deflection may follow the torque: powers (Hertz's contact 2/3, a spring 1, teeth between
// them), and springs that harden with the third power of the deflection, by this much at a large torque.
constexpr double kPowers[] = {0.55, 2.0 / 3, 0.73, 0.8, 0.9, 1};
constexpr double kHardening[] = {0.05, 0.1, 0.2, 0.4, 0.8, 1.6};
constexpr double kOtherPower = 0.05;  // from the declared one, beyond which it is another: choice
constexpr double kLawErrors = 3;      // standard errors by which the record distinguishes two laws: choice
// Mean square left over that of the best law, up to which another is not ruled out once the declared one is:
// none of those tried is the true one exactly. Larger where the best one gives the play to a tenth only, be
// it the declared one, and where the recorded torque is too noisy to decide. Simulated machines.
constexpr double kAnyLaw = 1.5, kAnyUnsureLaw = 2.5, kAnyNoisyLaw = 3, kSure = 0.1;
constexpr double kSurelyWorse = 3;  // likewise, of one cut: not looked at any further
constexpr double kTooNoisy = 4;  // what is typical over that of the sharpest cut: not read by any other law
constexpr double kSharp = 3;     // the same: where laws are distinguished
constexpr double kNotFound = 4;  // mean square over that of the best law, of one that finds no flanks: choice
// Cuts must give the same play, to within so many of their errors, where what they leave is up to so many
// times what the surest does. Choices.
constexpr double kLikewiseErrors = 4, kLikewise = 2;
constexpr double kOutlying = 5;  // standard deviations, beyond which a window is left by any law: choice

/// One way to cut the record: all windows of one length, by one torque.
struct Cut {
  std::size_t half;
  bool balanced;
  FlankWindows windows;
  std::size_t shorter, longer;  // ways that differ in the length alone; itself where there is none
};

FlankWindows cut(const TwoEncoders& motion, std::size_t half, bool balanced) {
  FlankWindows windows = average_windows(motion, half);
  return balanced ? with_balanced_torque(std::move(windows)) : windows;
}

std::vector<Cut> cuts_of(const TwoEncoders& motion) {
  std::vector<Cut> cuts;
  for (const bool balanced : {false, true})
    for (const std::size_t half : kHalves) {
      const std::size_t at = cuts.size();
      cuts.push_back({half, balanced, cut(motion, half, balanced),
                      half == std::begin(kHalves)[0] ? at : at - 1,
                      half == std::end(kHalves)[-1] ? at : at + 1});
    }
  return cuts;
}

/// The same law of the deflection, read from all cuts.
struct Readings {
  std::vector<FlankFit> fits;
  std::size_t best = 0;                        // of the cuts
  double change = INFINITY, error = INFINITY;  // rad, of that: with the length of the windows, and of all

  const FlankFit& surest() const { return fits[best]; }
};

/// What windows of another length give, of the same torque: they reach into touches and flights otherwise.
double windows_change(const std::vector<Cut>& cuts, const std::vector<FlankFit>& fits, std::size_t at) {
  for (const std::size_t other : {cuts[at].longer, cuts[at].shorter})
    if (other != at && fits[other].found) return std::abs(fits[other].gap - fits[at].gap);
  return INFINITY;
}

/// Of the cuts that are `worth` reading.
Readings read(const std::vector<Cut>& cuts, const std::vector<char>& worth, const FlankModel& model) {
  Readings out;
  for (std::size_t k = 0; k < cuts.size(); ++k)
    out.fits.push_back(worth[k] ? fit_flanks(cuts[k].windows, model) : FlankFit{});
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    if (!out.fits[k].found) {  // the one that comes closest shows what the record lacks
      if (out.fits[k].obstacle > out.surest().obstacle) out.best = k;
      continue;
    }
    const double change = windows_change(cuts, out.fits, k),
                 error = std::hypot(error_of(out.fits[k]), change);
    if (!out.surest().found || error < out.error) out.best = k, out.change = change, out.error = error;
  }
  return out;
}

/// Of the cuts that leave as little: the play that is farthest away beyond the errors of both;
/// the surest cut's where there is none.
double another_gap(const Readings& readings) {
  const FlankFit& surest = readings.surest();
  double gap = surest.gap, farthest = 0;
  for (const FlankFit& other : readings.fits) {
    if (!other.found || other.residual > kLikewise * surest.residual) continue;
    const double beyond =
        std::abs(other.gap - surest.gap) - kLikewiseErrors * std::hypot(error_of(other), error_of(surest));
    if (beyond > farthest) farthest = beyond, gap = other.gap;
  }
  return gap;
}

/// u + h u^3 = (1 + h) t.
double hardening(double t, double h) {
  const double p = 1 / h, q = (1 + h) * t / h;
  return 2 * std::sqrt(p / 3) * std::sinh(std::asinh(1.5 * q / p * std::sqrt(3 / p)) / 3);
}

/// The models whose deflection follows the torque by another law, the same at the large torque.
std::vector<FlankModel> other_laws(const FlankModel& model, double torque) {
  std::vector<FlankModel> others;
  const double typical = std::abs(model.elastic(torque));
  if (!(typical > 0)) return others;
  const double declared = std::log2(std::abs(model.elastic(2 * torque)) / typical);
  const auto add = [&](const std::function<double(double)>& law) {  // of a spring's, both in `typical`
    others.push_back(model);
    others.back().elastic = [elastic = model.elastic, typical, declared, law](double t) {
      const double e = elastic(t);
      return std::copysign(typical * law(std::pow(std::abs(e) / typical, 1 / declared)), e);
    };
  };
  for (const double power : kPowers)
    if (std::abs(power - declared) > kOtherPower)
      add([power](double spring) { return std::pow(spring, power); });
  for (const double h : kHardening) add([h](double spring) { return hardening(spring, h); });
  return others;
}

struct Law {
  FlankModel model;
  Readings readings;
};

/// Median size of the residuals of all windows, as a standard deviation.
double typical_of(const FlankFit& fit) {
  std::vector<double> away;
  for (const double a : fit.away)
    if (!std::isnan(a)) away.push_back(a);
  return away.empty() || !fit.found ? INFINITY : signal::kNormalPerMedianDeviation * signal::median(away);
}

/// Mean square of what a law leaves of all windows of a cut, over the square of `typical`.
double left(const FlankFit& fit, double typical) {
  if (!fit.found) return INFINITY;
  double sum = 0, count = 0;
  for (const double away : fit.away) {
    if (std::isnan(away)) continue;
    const double deviations = std::min(away / std::max(typical, 1e-300), kOutlying);
    sum += deviations * deviations, ++count;
  }
  return count > 0 ? sum / count : INFINITY;
}

/// The cut, of those by one torque if that is given, of which some law leaves least: there laws are
/// distinguished.
std::size_t sharpest_cut(const std::vector<Law>& laws, const std::vector<Cut>& cuts,
                         std::optional<bool> balanced = {}) {
  std::size_t sharpest = 0;
  double least = INFINITY;
  for (const Law& law : laws)
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      if (cuts[c].balanced != balanced.value_or(cuts[c].balanced)) continue;
      if (const double t = typical_of(law.readings.fits[c]); t < least) least = t, sharpest = c;
    }
  return sharpest;
}

/// What each of the fits of one cut leaves of it, over what the best one does, at least 1.
std::vector<double> squares_over_least(const std::vector<const FlankFit*>& fits) {
  double typical = INFINITY, least = INFINITY;
  for (const FlankFit* fit : fits) typical = std::min(typical, typical_of(*fit));
  std::vector<double> squares;
  for (const FlankFit* fit : fits) squares.push_back(left(*fit, typical));
  for (const double s : squares) least = std::min(least, s);
  for (double& s : squares) s = s > least ? s / least : 1;
  return squares;
}

/// The declared law first, then those that are not surely worse where it leaves least, by either torque.
std::vector<Law> read_laws(const std::vector<Cut>& cuts, const FlankModel& model, double large_torque) {
  std::vector<Law> laws = {{model, read(cuts, std::vector<char>(cuts.size(), true), model)}};
  const std::vector<FlankFit>& declared = laws[0].readings.fits;
  if (!laws[0].readings.surest().found) return laws;
  const double least = typical_of(declared[sharpest_cut(laws, cuts)]);
  std::vector<char> worth;
  for (const FlankFit& fit : declared) worth.push_back(typical_of(fit) <= kTooNoisy * least);
  std::vector<FlankModel> others = other_laws(model, large_torque);
  std::vector<double> squares(others.size(), INFINITY);
  for (const bool balanced : {false, true}) {
    const std::size_t at = sharpest_cut(laws, cuts, balanced);
    std::vector<FlankFit> fits;
    for (const FlankModel& law : others) fits.push_back(fit_flanks(cuts[at].windows, law));
    std::vector<const FlankFit*> there = {&declared[at]};
    for (const FlankFit& fit : fits) there.push_back(&fit);
    const std::vector<double> here = squares_over_least(there);
    for (std::size_t k = 0; k < others.size(); ++k) squares[k] = std::min(squares[k], here[k + 1]);
  }
  for (std::size_t k = 0; k < others.size(); ++k) {
    if (squares[k] > kSurelyWorse) continue;
    Readings readings = read(cuts, worth, others[k]);
    if (readings.surest().found && readings.surest().gap > 0)
      laws.push_back({std::move(others[k]), std::move(readings)});
  }
  return laws;
}

/// What all laws make of one cut.
std::vector<const FlankFit*> fits_of(const std::vector<Law>& laws, std::size_t cut) {
  std::vector<const FlankFit*> fits;
  for (const Law& law : laws) fits.push_back(&law.readings.fits[cut]);
  return fits;
}

/// What each law leaves over what the best one does, geometric mean over the cuts that distinguish laws.
std::vector<double> squares_of_laws(const std::vector<Law>& laws, const std::vector<Cut>& cuts) {
  const auto typical_at = [&](std::size_t c) {
    double typical = INFINITY;
    for (const FlankFit* fit : fits_of(laws, c)) typical = std::min(typical, typical_of(*fit));
    return typical;
  };
  const double sharpest = typical_at(sharpest_cut(laws, cuts));
  std::vector<double> sums(laws.size(), 0.0);
  double count = 0;
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    if (!(typical_at(c) <= kSharp * sharpest)) continue;
    const std::vector<double> squares = squares_over_least(fits_of(laws, c));
    for (std::size_t k = 0; k < laws.size(); ++k) sums[k] += std::log(std::min(squares[k], kNotFound));
    ++count;
  }
  const double least = *std::min_element(sums.begin(), sums.end());
  for (double& s : sums) s = std::exp((s - least) / count);
  return sums;
}

}  // namespace

double scatter_of(const FlankFit& fit) {
  const double pairs = std::max(1.0, std::floor(std::min(0.5 * double(fit.stays), double(fit.against))) - 1);
  return signal::student_t_quantile(0.975, pairs) * fit.standard_error;
}

double error_of(const FlankFit& fit) {
  return std::hypot(scatter_of(fit), std::hypot(fit.attenuation, kResidualShare * fit.residual));
}

FlankFit read_again(const TwoEncoders& motion, const FlankReading& reading) {
  return fit_flanks(cut(motion, reading.half_window, reading.balanced), reading.model);
}

FlankWindows part_of(const FlankWindows& windows, std::size_t begin, std::size_t end) {
  const auto cut = [&](const auto& column) {
    return std::decay_t<decltype(column)>(column.begin() + long(begin), column.begin() + long(end));
  };
  return {
      cut(windows.centre), cut(windows.torque),  cut(windows.deflection),   cut(windows.load),
      cut(windows.speed),  cut(windows.slip),    cut(windows.acceleration), cut(windows.load_acceleration),
      cut(windows.least),  cut(windows.largest), cut(windows.rough)};
}

FlankReading read_flanks(const TwoEncoders& motion, const FlankModel& model, double large_torque) {
  std::vector<Cut> cuts = cuts_of(motion);
  const std::vector<Law> laws = read_laws(cuts, model, large_torque);
  FlankReading reading;
  if (!laws[0].readings.surest().found) {
    reading.fit.obstacle = laws[0].readings.surest().obstacle;
    return reading;
  }
  const std::vector<double> squares = squares_of_laws(laws, cuts);
  const auto least = std::size_t(std::min_element(squares.begin(), squares.end()) - squares.begin());
  // Each stay on a flank counts once.
  const double apart =
      1 + kLawErrors * kLawErrors / double(std::max<std::size_t>(1, laws[least].readings.surest().stays));
  const std::size_t best = squares[0] <= apart ? 0 : least;
  const Readings& chosen = laws[best].readings;
  reading.fit = chosen.surest();
  reading.windows_change = chosen.change;
  reading.another_gap = another_gap(chosen);
  reading.declared_law = best == 0;
  const bool unsure = chosen.error > kSure * chosen.surest().gap;
  const bool noisy = best != 0 && cuts[chosen.best].balanced;
  const double any = noisy ? kAnyNoisyLaw : unsure ? kAnyUnsureLaw : best != 0 ? kAnyLaw : apart;
  reading.least = reading.largest = reading.fit.gap;
  for (std::size_t k = 0; k < laws.size(); ++k) {
    if (squares[k] > std::max(apart, any)) continue;
    const double gap = laws[k].readings.surest().gap;
    reading.least = std::min(reading.least, gap), reading.largest = std::max(reading.largest, gap);
  }
  reading.half_window = cuts[chosen.best].half, reading.balanced = cuts[chosen.best].balanced;
  reading.windows = std::move(cuts[chosen.best].windows);
  reading.model = laws[best].model;
  return reading;
}

}  // namespace backlash::diagnosis
