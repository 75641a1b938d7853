// SPDX-License-Identifier: BSD-3-Clause
// Two inertias from the frequency response.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kResponseModel = 0.002;  // simulation: a mesh that is not quite linear
constexpr double kLeastCoherence =
    0.1;  // simulation: dropping faint points would leave the anti-resonance those that noise lifts

std::size_t reversing(const FrequencyResponse& response) {
  return std::count_if(response.points.begin(), response.points.end(),
                       [](const ResponsePoint& p) { return p.reverses; });
}

/// Held between samples or not: as which the fitted delay vanishes.
ResponseDetail respond(const record::Record& record) {
  ResponseDetail best;
  double least = INFINITY;
  for (const bool held : {false, true}) {
    ResponseSettings settings;
    settings.held = held;
    settings.least_coherence = kLeastCoherence;
    ResponseDetail d;
    d.held = held;
    d.response = estimate_response(record, settings);
    d.resonances = find_resonances(d.response);
    d.plateaus = find_inertias(d.response, d.resonances);
    d.fit = fit_two_mass(d.response);
    if (std::fabs(d.fit.delay.value) < least) {
      least = std::fabs(d.fit.delay.value);
      best = std::move(d);
    }
  }
  const std::pair<const char*, KnownInertia> kinds[] = {{"a", KnownInertia::total_inertia},
                                                        {"b", KnownInertia::motor_inertia},
                                                        {"c", KnownInertia::both_inertias}};
  for (const auto& [letter, known] : kinds) {
    try {
      best.alternatives[letter] =
          split_stiffness(known, best.resonances, best.plateaus.total, best.plateaus.motor);
    } catch (const CannotIdentify&) {  // frequencies and inertias that contradict each other: the fit
                                       // says more
    }
  }
  return best;
}

}  // namespace

ProcedureReport run_frequency_response(IdentificationCase& c) {
  ProcedureReport report{"frequency_response", {}, ""};
  std::optional<ResponseDetail> best;
  const auto used = on_each(c, &CaseRecord::drive, [&](const CaseRecord& r) {
    ResponseDetail d = respond(r.record);
    const auto share = [](const ResponseDetail& x) {
      return double(reversing(x.response)) / double(x.response.points.size());
    };
    if (best && share(*best) <= share(d)) throw CannotIdentify("another record reverses less");
    best = std::move(d);
    report.records = {r.record.name};
  });
  const TwoMassFit& fit = best->fit;
  report.message = "resonance " + plus_minus(best->resonances.resonance, "Hz") + ", anti-resonance " +
                   plus_minus(best->resonances.anti_resonance, "Hz") + ", stiffness " +
                   plus_minus(fit.stiffness, "N m/rad");
  if (2 * reversing(best->response) < best->response.points.size()) {
    add_finding(c, report.name, {{"motor_inertia", 1}}, with_model_error(fit.motor_inertia, kResponseModel));
    add_finding(c, report.name, {{"load_inertia", 1}}, with_model_error(fit.load_inertia, kResponseModel));
    add_finding(c, report.name, {{"mesh_stiffness", 1}}, with_model_error(fit.stiffness, kResponseModel));
    add_finding(c, report.name, {{"mesh_damping", 1}}, with_model_error(fit.damping, 5 * kResponseModel));
  } else {
    report.message += "; the speed reverses, so play and Coulomb friction are in it: not used further";
    c.result.warnings.emplace_back(
        "frequency_response: the speed reverses in the record; a bias torque would keep the "
        "teeth in contact");
  }
  c.result.response = std::move(*best);
  return report;
}

}  // namespace backlash::identification
