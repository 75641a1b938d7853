#include "backlash_diagnosis/identification/effect_search.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/bandwidth.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "effects/search.h"

namespace backlash {
namespace {

constexpr double kTwoInertiaCutoff = 60;  // Hz
constexpr double kHighestCutoff = 0.2;    // of the sampling rate
constexpr double kUnexplained = 2;        // times the floor, beyond which something is left

double default_cutoff(const Rig& rig, const std::vector<ServoData>& data) {
  const double highest = kHighestCutoff / data.front().interval;
  if (load_moves_freely(rig)) return std::min(kTwoInertiaCutoff, highest);
  double widest = 0;
  for (const ServoData& d : data) widest = std::max(widest, motion_bandwidth(d.motor, d.interval));
  return std::min(widest, highest);
}

ServoData data_of(const Record& record, const Rig& rig) {
  ServoData data = servo_data(record, rig);
  if (load_moves_freely(rig) && data.load.empty())
    throw CannotIdentify(record.name + " has no load_position, which a rig with two inertias needs");
  return data;
}

/// What a machine says of the test record, with the record's own calibration.
ServoPrediction predicted(Machine machine, const ServoData& test, double cutoff) {
  const std::vector<ServoData> data = {test};
  const Calibration like = machine.calibrations.front();
  machine.parameters.clear();
  machine.calibrations = {like};
  NonlinearOptions options;
  options.parallel = true;
  for (const double band : {std::min(15.0, cutoff), cutoff}) {
    if (machine.largest_delay == 0 && machine.rig.mesh.rigid) break;  // nothing to calibrate
    RecordSet records(data, band, kLoadFeedback);
    records.weigh(machine);
    machine = fit_machine(machine, records, {}, options).machine;
  }
  OutputErrorSettings settings;
  settings.cutoff = cutoff;
  return predict_servo(machine.rig, test, settings, machine.calibrations.front());
}

}  // namespace

Trace trace_residual(const Rig& raw, const std::vector<Record>& train, const Record& test,
                     const TraceSettings& settings, const Progress& progress) {
  const Rig declared = load_side(raw);
  std::vector<ServoData> data;
  for (const Record& record : train) data.push_back(data_of(record, raw));
  const ServoData unseen = data_of(test, raw);
  Trace trace;
  trace.cutoff = settings.cutoff > 0 ? settings.cutoff : default_cutoff(declared, data);
  Search search(declared, data, trace.cutoff, settings, progress);
  search.fit_base();
  search.add_effects();
  search.drop_superfluous();
  trace.base = search.base().fit.machine.rig;
  trace.augmented = search.stage().fit.machine.rig;
  const ServoPrediction before = predicted(search.base().fit.machine, unseen, trace.cutoff),
                        after = predicted(search.stage().fit.machine, unseen, trace.cutoff);
  trace.channels["torque"] = {before.torque_error.error, after.torque_error.error, after.torque_error.floor};
  if (!after.deflection.empty())
    trace.channels["deflection"] = {before.deflection_error.error, after.deflection_error.error,
                                    after.deflection_error.floor};
  for (const Accepted& a : search.effects()) {
    FoundEffect e;
    e.id = a.candidate.id;
    e.channel = a.gain.deflection ? "deflection" : "torque";
    e.evidence = a.gain.evidence;
    e.equivalent_to = a.equivalent_to;
    trace.steps.push_back(e);
  }
  if (!trace.steps.empty()) trace.verdict = TraceVerdict::effect_found;
  return trace;
}

}  // namespace backlash
