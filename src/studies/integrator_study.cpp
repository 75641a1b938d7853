// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/integrator_study.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/restitution.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::studies {
namespace {

const double kNone = std::nan("");
constexpr double kReferenceTolerance = 1e-13;
constexpr int kLoosest = 1, kTightest = 10;  // decades, from where every method errs to where none does
constexpr AbsoluteTolerance kKinds[] = {AbsoluteTolerance::scaled, AbsoluteTolerance::plain};

Tooth started(const Tooth& tooth, int start, int starts) {
  Tooth moved = tooth;
  moved.distance *= 1 - 0.5 * start / starts;
  return moved;
}

/// Of the first touch; NaN under a force, which has no closed form.
double exact_restitution(const Tooth& tooth) {
  return tooth.force == 0 ? model::hunt_crossley_restitution(tooth.alpha * tooth.impact_speed()) : kNone;
}

double largest_difference(const Tooth& tooth, const ToothMotion& a, const ToothMotion& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.penetration.size(); ++k)
    most = std::max(most, std::fabs(a.penetration[k] - b.penetration[k]));
  return most / (tooth.distance + tooth.depth());
}

ToothErrors errors_of(const Tooth& tooth, const ToothMotion& motion, const ToothMotion& right) {
  const double start = tooth.start_energy(), e = exact_restitution(tooth);
  ToothErrors errors;
  errors.restitution = std::fabs(-motion.speed.back() / tooth.impact_speed() / e - 1);
  errors.loop_area = std::fabs(motion.loop_area / (start * (1 - e * e)) - 1);
  errors.energy = std::fabs(motion.end_energy - right.end_energy) / start;
  errors.energy_gain = std::max(0.0, motion.most_energy / start - 1);
  errors.opposite = motion.opposite;
  errors.motion = largest_difference(tooth, motion, right);
  return errors;
}

void summarise(const std::vector<ToothErrors>& runs, ToothRow& row) {
  for (double ToothErrors::*error :
       {&ToothErrors::restitution, &ToothErrors::loop_area, &ToothErrors::energy, &ToothErrors::energy_gain,
        &ToothErrors::opposite, &ToothErrors::motion}) {
    std::vector<double> values;
    for (const ToothErrors& run : runs) values.push_back(run.*error);
    const bool known = !values.empty() && !std::isnan(values.front());
    row.worst.*error = known ? *std::max_element(values.begin(), values.end()) : kNone;
    row.median.*error = known ? signal::median(values) : kNone;
  }
  row.opposite_runs = static_cast<int>(
      std::count_if(runs.begin(), runs.end(), [](const ToothErrors& run) { return run.opposite > 0; }));
}

/// All starts of one tooth, each with its right motion.
struct Starts {
  std::vector<Tooth> teeth;
  std::vector<ToothMotion> right;
};

ToothMotion right_motion(const Tooth& tooth, const std::string& method, int samples) {
  return ToothSimulator(tooth, method, kReferenceTolerance, AbsoluteTolerance::scaled).run(samples);
}

Starts make_starts(const Tooth& tooth, const IntegratorStudySettings& settings, ToothReference& reference) {
  Starts starts;
  reference = {tooth.name, tooth.impact_speed(), tooth.depth(), exact_restitution(tooth), 0, 0};
  for (int k = 0; k < settings.starts; ++k) {
    const Tooth moved = started(tooth, k, settings.starts);
    ToothMotion right = right_motion(moved, "verner", settings.samples);
    if (right.opposite > 0)
      throw InvalidParameter("gap of tooth " + tooth.name, tooth.gap,
                             "the right motion reaches the other flank");
    const ToothMotion other = right_motion(moved, "dormand_prince", settings.samples);
    reference.agreement = std::max(reference.agreement, largest_difference(moved, right, other));
    reference.restitution_error =
        std::max(reference.restitution_error, errors_of(moved, right, right).restitution);
    starts.teeth.push_back(moved);
    starts.right.push_back(std::move(right));
  }
  if (tooth.force > 0) reference.restitution_error = kNone;
  return starts;
}

ToothRow make_row(const Starts& starts, const std::string& method, AbsoluteTolerance absolute,
                  double tolerance, int samples) {
  ToothRow row;
  row.tooth = starts.teeth.front().name;
  row.method = method;
  row.absolute = absolute;
  row.tolerance = tolerance;
  std::vector<ToothErrors> runs;
  for (std::size_t k = 0; k < starts.teeth.size(); ++k) try {
      ToothSimulator simulator(starts.teeth[k], method, tolerance, absolute);
      runs.push_back(errors_of(starts.teeth[k], simulator.run(samples), starts.right[k]));
      row.steps += static_cast<double>(simulator.statistics().steps);
    } catch (const IntegrationError&) {
      ++row.failed_runs;
    }
  if (!runs.empty()) row.steps /= static_cast<double>(runs.size());
  summarise(runs, row);
  return row;
}

std::vector<DrawnMotion> draw(const std::vector<Tooth>& teeth, int samples) {
  std::vector<DrawnMotion> drawn;
  for (const Tooth& tooth : teeth)
    for (const char* method : {"bdf", "verner"})
      for (const double tolerance : {tooth.loose, tooth.tight})
        drawn.push_back({tooth.name, method, tolerance,
                         ToothSimulator(tooth, method, tolerance, AbsoluteTolerance::plain).run(samples)});
  return drawn;
}

void accumulate(simulation::IntegratorStatistics& sum, const simulation::IntegratorStatistics& part) {
  sum.steps += part.steps;
  sum.evaluations += part.evaluations;
  sum.error_test_failures += part.error_test_failures;
}

}  // namespace

IntegratorStudySettings load_integrator_study(const std::string& path) {
  const YamlReader yaml = YamlReader::from_file(path);
  IntegratorStudySettings settings;
  yaml.integer("schema_version", 1, 1);
  yaml.text("name");
  settings.starts = static_cast<int>(yaml.integer("starts", 1, 1000));
  settings.samples = static_cast<int>(yaml.integer("samples", 10, 1'000'000));
  for (const YamlReader& tooth : yaml.maps("teeth")) settings.teeth.push_back(read_tooth(tooth));
  if (settings.teeth.empty()) yaml.fail("teeth", "must name at least one tooth");
  const YamlReader rig = yaml.map("rig");
  settings.half_gap = rig.number("half_gap", Range::not_negative());
  settings.rig_duration = rig.number("duration", Range::positive());
  yaml.finish();
  return settings;
}

bool ToothRow::right(double share) const {
  if (failed_runs > 0 || opposite_runs > 0) return false;
  // NaN: does not apply
  const double errors[] = {worst.restitution, worst.loop_area, worst.energy, worst.energy_gain, worst.motion};
  return std::none_of(std::begin(errors), std::end(errors), [share](double error) { return error > share; });
}

double IntegratorStudy::right_from(const std::string& tooth, const std::string& method,
                                   AbsoluteTolerance absolute, double share) const {
  double loosest = kNone;
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {  // from tight to loose
    if (row->tooth != tooth || row->method != method || row->absolute != absolute) continue;
    if (!row->right(share)) break;
    loosest = row->tolerance;
  }
  return loosest;
}

void study_tooth(const Tooth& tooth, const IntegratorStudySettings& settings, IntegratorStudy& study,
                 const std::function<void()>& tick, const std::vector<std::string>& methods) {
  ToothReference reference;
  const Starts starts = make_starts(tooth, settings, reference);
  study.references.push_back(reference);
  for (const std::string& method : methods) {
    for (const AbsoluteTolerance absolute : kKinds)
      for (int decade = kLoosest; decade <= kTightest; ++decade)
        study.rows.push_back(make_row(starts, method, absolute, std::pow(10, -decade), settings.samples));
    if (tick) tick();
  }
}

WorkPrecision impact_work(const Tooth& tooth, int starts, const std::function<void()>& tick) {
  const auto solve = [&](const std::string& method, double tolerance,
                         simulation::IntegratorStatistics& statistics) {
    std::vector<double> ends;
    for (int k = 0; k < starts; ++k) {
      const Tooth moved = started(tooth, k, starts);
      ToothSimulator simulator(moved, method, tolerance, AbsoluteTolerance::scaled);
      const ToothMotion motion = simulator.run(1);  // in one go: interpolated samples would cost, too
      ends.push_back(motion.penetration.back() / (moved.distance + moved.depth()));
      ends.push_back(motion.speed.back() / moved.impact_speed());
      accumulate(statistics, simulator.statistics());
    }
    return ends;
  };
  return WorkPrecision("impact", solve, tick);
}

WorkPrecision rig_work(const rig_file::RigFile& file, double half_gap, double duration, WorkPoint& declared,
                       const std::function<void()>& tick, const std::vector<std::string>& methods) {
  model::Rig rig = file.rig;
  rig.mesh.backlash = 2 * half_gap;
  const simulation::SolverSettings& own = file.simulation.solver;
  const double rate = file.simulation.sensors.sampling_rate;
  const long samples = std::lround(duration * rate);
  if (samples < 1) throw InvalidParameter("rig.duration", duration, "must hold at least one sample");
  const auto solve = [&](const std::string& method, double tolerance,
                         simulation::IntegratorStatistics& statistics) {
    const double share = tolerance / own.relative_tolerance;
    simulation::Plant plant(
        rig, file.simulation.excitation,
        {method, tolerance, share * own.position_tolerance, share * own.velocity_tolerance});
    std::vector<double> signal;
    for (long k = 1; k <= samples; ++k) {
      plant.advance_to(double(k) / rate);
      const model::Observation o = plant.observe();
      signal.push_back(rig.input_coupling.rigid ? o.motor_position : o.sensor_torque);
    }
    accumulate(statistics, plant.statistics());
    return signal;
  };
  const WorkPrecision work("rig", solve, tick, methods);
  declared = work.measure(solve, own.method, own.relative_tolerance);
  return work;
}

IntegratorStudy study_integrators(const rig_file::RigFile& file, const IntegratorStudySettings& settings,
                                  const Progress& progress) {
  const double total =
      static_cast<double>((settings.teeth.size() + 2) * simulation::integrator_methods().size());
  int done = 0;
  std::string phase;
  const auto tick = [&] {
    if (progress && !progress(++done / total, phase)) throw Cancelled();
  };
  IntegratorStudy study;
  for (const Tooth& tooth : settings.teeth) {
    phase = "tooth " + tooth.name;
    study_tooth(tooth, settings, study, tick);
  }
  phase = "work and precision, impact";
  study.work.push_back(impact_work(settings.teeth.front(), settings.starts, tick));
  phase = "work and precision, rig";
  study.work.push_back(rig_work(file, settings.half_gap, settings.rig_duration, study.rig_declared, tick));
  study.drawn = draw(settings.teeth, settings.samples);
  return study;
}

}  // namespace backlash::studies
