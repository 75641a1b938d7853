// SPDX-License-Identifier: BSD-3-Clause
#include "flank_choice.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include "backlash_diagnosis/signal/distributions.h"

namespace backlash::diagnosis {
namespace {

constexpr std::size_t kHalves[] = {4, 8, 16, 32};  // samples, half a window
// Laws by which a deflection may follow the torque: powers (Hertz's contact 2/3, a spring 1, teeth between
// them), and springs that harden with the third power of the deflection, by this much at a large torque.
constexpr double kPowers[] = {2.0 / 3, 0.8, 1};
constexpr double kHardening[] = {0.05, 0.1, 0.2, 0.4, 0.8};
constexpr double kOtherPower = 0.05;  // from the declared one, beyond which it is another: choice
constexpr double kLawErrors = 3;      // standard errors by which the record tells two laws apart: choice
// Square of the residual over that of the best law, up to which another is not ruled out once the declared
// one is: none of those tried is the true one exactly.
constexpr double kAnyLaw = 2.5;

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

/// What windows of another length tell, of the same torque: they reach into touches and flights otherwise.
double windows_change(const std::vector<Cut>& cuts, const std::vector<FlankFit>& fits, std::size_t at) {
  for (const std::size_t other : {cuts[at].longer, cuts[at].shorter})
    if (other != at && fits[other].found) return std::abs(fits[other].gap - fits[at].gap);
  return INFINITY;
}

Readings read(const std::vector<Cut>& cuts, const FlankModel& model) {
  Readings out;
  for (const Cut& cut : cuts) out.fits.push_back(fit_flanks(cut.windows, model));
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    if (!out.fits[k].found) continue;
    const double change = windows_change(cuts, out.fits, k),
                 error = std::hypot(error_of(out.fits[k]), change);
    if (!out.surest().found || error < out.error) out.best = k, out.change = change, out.error = error;
  }
  return out;
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

std::size_t used(const FlankFit& fit) {
  return fit.used[0] + fit.used[1];
}

/// Squares of the residuals over one cut.
double left(const FlankFit& fit) {
  return fit.found ? fit.residual * fit.residual : INFINITY;
}

/// Ratio of squares beyond which the record tells two laws apart: each stay tells once.
double told(const FlankFit& fit) {
  return 1 + kLawErrors * kLawErrors / double(std::max<std::size_t>(1, fit.stays));
}

/// The declared law first, then those that the record does not rule out where that is surest.
std::vector<Law> read_laws(const std::vector<Cut>& cuts, const FlankModel& model, double large_torque) {
  std::vector<Law> laws = {{model, read(cuts, model)}};
  const Readings declared = laws[0].readings;
  if (!declared.surest().found) return laws;
  for (FlankModel& law : other_laws(model, large_torque)) {
    const FlankFit first = fit_flanks(cuts[declared.best].windows, law);
    if (left(first) > told(declared.surest()) * left(declared.surest())) continue;
    Readings readings = read(cuts, law);
    if (readings.surest().found && readings.surest().gap > 0)
      laws.push_back({std::move(law), std::move(readings)});
  }
  return laws;
}

}  // namespace

double scatter_of(const FlankFit& fit) {
  const double pairs = std::max(1.0, std::floor(0.5 * static_cast<double>(fit.stays)) - 1);
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
      cut(windows.centre), cut(windows.torque), cut(windows.deflection),   cut(windows.load),
      cut(windows.speed),  cut(windows.slip),   cut(windows.acceleration), cut(windows.load_acceleration)};
}

FlankReading read_flanks(const TwoEncoders& motion, const FlankModel& model, double large_torque) {
  std::vector<Cut> cuts = cuts_of(motion);
  const std::vector<Law> laws = read_laws(cuts, model, large_torque);
  FlankReading reading;
  if (!laws[0].readings.surest().found) return reading;
  // Laws are compared over the same windows, of those that are surest by one law the most.
  const auto fewer = [](const Law& a, const Law& b) {
    return used(a.readings.surest()) < used(b.readings.surest());
  };
  const std::size_t common = std::max_element(laws.begin(), laws.end(), fewer)->readings.best;
  const auto left_by = [&](std::size_t k) { return left(laws[k].readings.fits[common]); };
  const double apart = told(laws[0].readings.surest());
  std::size_t best = 0;
  for (std::size_t k = 1; k < laws.size(); ++k)
    if (apart * left_by(k) < left_by(0) && left_by(k) < left_by(best)) best = k;
  const Readings& chosen = laws[best].readings;
  reading.fit = chosen.surest();
  reading.windows_change = chosen.change;
  reading.declared_law = best == 0;
  reading.least = reading.largest = reading.fit.gap;
  for (std::size_t k = 0; k < laws.size(); ++k) {
    if (left_by(k) > (best == 0 ? apart : kAnyLaw) * left_by(best)) continue;
    const double gap = laws[k].readings.surest().gap;
    reading.least = std::min(reading.least, gap), reading.largest = std::max(reading.largest, gap);
  }
  reading.half_window = cuts[chosen.best].half, reading.balanced = cuts[chosen.best].balanced;
  reading.windows = std::move(cuts[chosen.best].windows);
  reading.model = laws[best].model;
  return reading;
}

}  // namespace backlash::diagnosis
