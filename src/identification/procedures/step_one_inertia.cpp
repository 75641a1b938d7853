// SPDX-License-Identifier: BSD-3-Clause
// The one procedure for a machine of one inertia.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "procedures.h"

namespace backlash::identification {
namespace {

constexpr double kByNoise = 5;  // choice: standard errors below zero, that an explained torque may have

/// The samples that were used, in their places.
ChannelTrace trace_of(const OneInertia& found, const record::Record& record) {
  ChannelTrace trace;
  trace.record = record.name;
  trace.interval = record.sampling_interval();
  const std::size_t n = std::lround((record.time.back() - record.time.front()) / trace.interval) + 1;
  trace.measured.assign(n, 0);
  trace.predicted.assign(n, 0);
  trace.counts.assign(n, 0);
  for (std::size_t i = 0; i < found.time.size(); ++i) {
    const std::size_t k = std::lround((found.time[i] - record.time.front()) / trace.interval);
    if (k >= n) continue;
    trace.measured[k] = found.measured[i];
    trace.predicted[k] = found.predicted[i];
    trace.counts[k] = 1;
  }
  return trace;
}

/// A load that the model lacks can leave it with an inertia or a friction that no machine has.
void require_possible(const OneInertia& found, const std::string& record) {
  const auto refuse = [&](const char* name, const signal::Measured& m) {
    throw CannotIdentify(fmt::format(
        "{}: {} comes out as {:.3g} +- {:.2g}, and {:.3g} % of the torque is left where noise alone would "
        "leave {:.3g} %: the machine has effects that one inertia with friction lacks, as gravity; "
        "trace_residual looks for them",
        record, name, m.value, m.standard_error, 100 * found.relative_error, 100 * found.floor));
  };
  if (found.inertia.value <= 0) refuse("inertia", found.inertia);
  // A friction that is nearly nothing may come out below zero by noise.
  const double by_noise = found.relative_error <= kMisfit * found.floor ? kByNoise : 0;
  const signal::Measured least = {found.coulomb.value - std::fabs(found.offset.value),
                                  std::hypot(found.coulomb.standard_error, found.offset.standard_error)};
  if (found.viscous.value < -by_noise * found.viscous.standard_error) refuse("viscous", found.viscous);
  if (least.value < -by_noise * least.standard_error) refuse("coulomb friction of the one direction", least);
}

}  // namespace

ProcedureReport run_one_inertia(IdentificationCase& c) {
  ProcedureReport report{"one_inertia", {}, ""};
  if (c.records.size() != 1)
    c.result.warnings.emplace_back("a machine of one inertia is fitted to the first record that allows it");
  std::string reasons;
  for (const CaseRecord& r : c.records) {
    try {
      c.result.one_inertia = identify_one_inertia(r.record);
    } catch (const CannotIdentify& error) {
      reasons += (reasons.empty() ? "" : "; ") + r.record.name + ": " + error.what();
      continue;
    }
    report.records = {r.record.name};
    c.result.torque = {trace_of(*c.result.one_inertia, r.record)};
    break;
  }
  if (!c.result.one_inertia) throw CannotIdentify(reasons);
  const OneInertia& found = *c.result.one_inertia;
  require_possible(found, report.records.front());
  c.result.parameters = {{"inertia", found.inertia},
                         {"viscous", found.viscous},
                         {"coulomb", found.coulomb},
                         {"offset", found.offset}};
  for (const rig_file::RigParameter& p : rig_file::servo_parameters())
    if (!p.one_inertia.empty()) c.result.units[p.one_inertia] = model::axis_unit(p.unit, c.declared.linear);
  c.result.channels["torque"] = {found.relative_error, found.floor};
  c.result.delay = found.delay;
  c.result.warnings.insert(c.result.warnings.end(), found.warnings.begin(), found.warnings.end());
  model::Body& body = c.result.rig.motor;
  body.inertia =
      found.inertia.value - c.declared.pinion.inertia - c.declared.gear.inertia - c.declared.link.inertia;
  body.viscous_damping = std::max(0.0, found.viscous.value);
  body.viscous_asymmetry = 0;
  body.coulomb_friction = std::max(0.0, found.coulomb.value);
  body.coulomb_asymmetry = std::clamp(found.offset.value, -body.coulomb_friction, body.coulomb_friction);
  report.message = fmt::format("torque error {:.3g} %, low-pass {:.3g} Hz, torque acts {:.3g} ms late",
                               100 * found.relative_error, found.cutoff, 1e3 * found.delay.value);
  return report;
}

}  // namespace backlash::identification
