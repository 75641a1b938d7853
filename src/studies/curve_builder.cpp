// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/curve_builder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"
#include "drawn_machine.h"
#include "family_builder.h"
#include "fine_run.h"
#include "spread_builder.h"

namespace backlash::studies {
namespace {

/// What one backlash value contributes.
struct Cell {
  diagnosis::CurvePoint point;
  std::vector<diagnosis::Quantiles> members;
  double motor_travel = 0, amplitude = 0, excitation_level = 0;
};

/// Skewness of each period of one sampled run.
std::vector<double> skewness_of(const CurvePlan& plan, const std::vector<double>& samples) {
  diagnosis::PeriodAnalyser analyser(plan.apd.period, plan.apd.layout);
  std::vector<double> skewness;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const diagnosis::PeriodResult* period =
        analyser.add(static_cast<double>(k) / plan.request.sampling_rate, samples[k]);
    if (period && period->index >= plan.apd.settling_periods) skewness.push_back(period->apd.skewness());
  }
  return skewness;
}

/// Mean over all, scatter inside the runs, scatter of the runs' means beyond that.
diagnosis::SkewnessCell summarise(const std::vector<std::vector<double>>& runs) {
  diagnosis::RunningMoments all, means;
  double within = 0;
  std::size_t freedom = 0;
  for (const auto& run : runs) {
    diagnosis::RunningMoments own;
    for (double s : run) {
      all.add(s);
      own.add(s);
    }
    means.add(own.mean());
    within += own.standard_deviation() * own.standard_deviation() * double(own.count());
    freedom += own.count() - 1;
  }
  diagnosis::SkewnessCell cell;
  cell.mean = all.mean();
  cell.within = freedom > 0 ? std::sqrt(within / double(freedom)) : 0;
  const double n = double(runs.front().size()), m = double(runs.size());
  const double variance = m > 1 ? means.standard_deviation() * means.standard_deviation() * m / (m - 1) : 0;
  cell.between = std::sqrt(std::max(0.0, variance - cell.within * cell.within / n));
  return cell;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Skewness at each noise level, and the level of the signal at the declared one. `means` (may be null)
/// becomes the mean skewness by level and seed.
diagnosis::CurvePoint make_point(const CurvePlan& plan, const FineRun& run, double backlash,
                                 std::vector<std::vector<double>>* means = nullptr) {
  diagnosis::CurvePoint point;
  point.backlash = backlash;
  for (const double noise : plan.noise_levels) {
    std::vector<std::vector<double>> skewness;
    for (int seed = 0; seed < plan.request.seeds; ++seed) {
      auto samples = sample(plan, run, plan.phase_of(seed), seed, noise);
      skewness.push_back(skewness_of(plan, samples));
      if (noise == plan.file.simulation.sensors.of(plan.apd.signal).noise)
        point.signal_level = diagnosis::signal_level(std::move(samples));
    }
    point.cells.push_back(summarise(skewness));
    if (means) {
      means->emplace_back();
      for (const auto& seed : skewness) means->back().push_back(mean_of(seed));
    }
    if (std::isnan(point.cells.back().mean))
      throw InvalidParameter("diagnosis.apd", plan.apd.layout.upper,
                             "the classes hold no sample of the signal");
  }
  return point;
}

Cell make_cell(const CurvePlan& plan, double backlash, const FineRun& run) {
  Cell cell;
  cell.point = make_point(plan, run, backlash);
  cell.members = family_members(plan, run);
  cell.motor_travel = diagnosis::travel_of(run.position);
  for (double torque : run.torque) cell.amplitude = std::max(cell.amplitude, std::fabs(torque));
  cell.excitation_level = diagnosis::signal_level(run.torque);
  return cell;
}

/// Runs in the middle between two points, to learn how well curve and family hold there.
struct Middle {
  std::vector<double> backlash;
  std::vector<std::vector<diagnosis::SkewnessCell>> cells;
  std::vector<std::vector<std::vector<double>>> means;  // of skewness, by noise level and seed
  std::vector<FineRun> runs;                            // of use: the signal
};

struct Cells {
  std::vector<Cell> points;
  Middle middle;
  std::vector<std::vector<diagnosis::Quantiles>> beyond;  // members of the family beyond the end of the curve
};

constexpr double kBeyond = 0.5;  // of the curve's length

int count_beyond(const CurvePlan& plan) {
  return static_cast<int>(std::ceil(kBeyond * (plan.request.points - 1)));
}

/// All machines that are run, by backlash: those of the points, those in the middle between two points, which
/// are as far from the file as a real one may be, and those beyond the end of the curve.
std::vector<Machine> machines_of(const CurvePlan& plan) {
  const int count = plan.request.points;
  const double step = plan.request.max_backlash / (count - 1);
  const Machine declared = declared_machine(plan.file);
  std::vector<Machine> machines;
  for (int i = 0; i < count; ++i) machines.push_back(with_backlash(declared, i * step));
  for (int i = 0; i + 1 < count; ++i)
    machines.push_back(
        with_backlash(draw_stiffness(plan.file, 2 * static_cast<std::uint64_t>(i) + 1), (i + 0.5) * step));
  for (int i = 0; i < count_beyond(plan); ++i)
    machines.push_back(with_backlash(declared, (count + i) * step));
  return machines;
}

/// What the run of machine `i` contributes.
void take(const CurvePlan& plan, std::size_t i, double backlash, FineRun run, Cells& all) {
  const std::size_t count = all.points.size();
  if (i < count) {
    all.points[i] = make_cell(plan, backlash, run);
  } else if (i < 2 * count - 1) {
    i -= count;
    run.torque = run.position = {};
    all.middle.backlash[i] = backlash;
    all.middle.cells[i] = make_point(plan, run, backlash, &all.middle.means[i]).cells;
    all.middle.runs[i] = std::move(run);
  } else {
    all.beyond[i - (2 * count - 1)] = family_members(plan, run);
  }
}

/// Reports which points of the curve are there.
class PointsDone {
 public:
  explicit PointsDone(const CurveRequest& request) : request_(request) {}

  void add(const diagnosis::CurvePoint& point) {
    if (!request_.best_so_far) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    lowest_ = std::min(lowest_, point.cells.front().mean);
    highest_ = std::max(highest_, point.cells.front().mean);
    request_.best_so_far(fmt::format("{} of {} points, skewness {:.3g} to {:.3g}", ++done_, request_.points,
                                     lowest_, highest_));
  }

 private:
  const CurveRequest& request_;
  std::mutex mutex_;
  int done_ = 0;
  double lowest_ = std::numeric_limits<double>::infinity(),
         highest_ = -std::numeric_limits<double>::infinity();
};

Cells make_cells(const CurvePlan& plan, Ticker& ticker) {
  const int count = plan.request.points;
  Cells all;
  all.points.resize(count);
  all.middle.backlash.resize(count - 1);
  all.middle.cells.resize(count - 1);
  all.middle.means.resize(count - 1);
  all.middle.runs.resize(count - 1);
  all.beyond.resize(count_beyond(plan));
  const std::vector<Machine> machines = machines_of(plan);
  PointsDone points(plan.request);
  const std::size_t chunks = (machines.size() + kTogether - 1) / kTogether;
  for_each_in_parallel(static_cast<int>(chunks), ticker, [&](int chunk) {
    const std::size_t begin = chunk * kTogether, end = std::min(begin + kTogether, machines.size());
    std::vector<FineRun> runs = run_fine(plan, {machines.begin() + begin, machines.begin() + end}, ticker);
    for (std::size_t i = begin; i < end; ++i) {
      take(plan, i, machines[i].rig.mesh.backlash, std::move(runs[i - begin]), all);
      if (i < all.points.size()) points.add(all.points[i].point);
    }
  });
  return all;
}

/// Of the runs between the points that get an interval: the share whose interval contains their backlash.
double coverage(const diagnosis::MonitoringCurve& curve, const Middle& middle) {
  int answered = 0, held = 0;
  for (std::size_t i = 0; i < middle.means.size(); ++i)
    for (std::size_t level = 0; level < middle.means[i].size(); ++level)
      for (const double mean : middle.means[i][level]) {
        const diagnosis::Estimate e = curve.invert(mean, curve.conditions.periods, curve.noise_levels[level]);
        if (e.status != diagnosis::Status::ok) continue;
        ++answered;
        held += e.lower <= middle.backlash[i] && middle.backlash[i] <= e.upper;
      }
  return answered > 0 ? static_cast<double>(held) / answered : 1;
}

/// The smallest factor with which 95 % of the intervals contain the truth, not below that of a normal
/// distribution: the same runs also set the scatter.
double calibrated_factor(diagnosis::MonitoringCurve curve, const Middle& middle) {
  for (; curve.coverage_factor < 5; curve.coverage_factor += 0.1)
    if (coverage(curve, middle) >= 0.95) break;
  return curve.coverage_factor;
}

diagnosis::CurveConditions conditions_of(const CurvePlan& plan) {
  diagnosis::CurveConditions c;
  c.rig = plan.file.rig.name;
  c.rig_digest = plan.file.digest;
  c.version = version();
  c.signal = record::channel_name(plan.apd.signal);
  c.excitation = plan.file.simulation.excitation.type;
  c.frequency = 1 / plan.apd.period;
  c.sampling_rate = plan.request.sampling_rate;
  c.apd = plan.apd.layout;
  c.periods = plan.request.periods;
  c.settling_periods = plan.apd.settling_periods;
  c.seeds = plan.request.seeds;
  c.noise = plan.file.simulation.sensors.of(plan.apd.signal).noise;
  c.output_locked = plan.file.rig.link_locked;
  c.angular = plan.file.rig.mesh.angular();
  return c;
}

}  // namespace

double nominal_sampling_rate(double interval) {
  if (!(interval > 0)) throw InvalidParameter("sampling interval", interval, "must be > 0 s");
  const double scale = std::pow(10, 3 - std::floor(std::log10(1 / interval)));
  return std::round(scale / interval) / scale;
}

diagnosis::MonitoringCurve build_curve(const rig_file::RigFile& file, const CurveRequest& request,
                                       const Progress& progress) {
  const CurvePlan plan = plan_curve(file, request);
  const long runs = 2L * plan.request.points - 1 + count_beyond(plan);
  const long calibration = (plan.request.points - 1L) * static_cast<long>(plan.noise_levels.size() + 1);
  Ticker ticker(progress, (runs + spread_runs(plan)) * plan.run_periods() + calibration,
                "building the curve");
  Cells all = make_cells(plan, ticker);
  diagnosis::MonitoringCurve curve;
  curve.conditions = conditions_of(plan);
  curve.noise_levels = plan.noise_levels;
  curve.backlash_to_angle = file.rig.backlash_angle(1);
  curve.family.emplace();
  for (Cell& cell : all.points) {
    diagnosis::CurveConditions& c = curve.conditions;
    c.motor_travel = std::max(c.motor_travel, cell.motor_travel);
    c.amplitude = std::max(c.amplitude, cell.amplitude);
    c.excitation_level = cell.excitation_level;
    curve.points.push_back(std::move(cell.point));
    curve.family->members.push_back(std::move(cell.members));
  }
  for (auto& members : all.beyond) curve.family->members.push_back(std::move(members));
  curve.finish(all.middle.cells);
  curve.coverage_factor = calibrated_factor(curve, all.middle);
  calibrate_family(plan, all.middle.runs, ticker, *curve.family);
  if (spread_runs(plan) > 0) curve.spread = learn_spread(plan, curve, ticker);
  return curve;
}

std::string check_curve(const diagnosis::MonitoringCurve& curve, const rig_file::RigFile& rig,
                        const std::string& source) {
  constexpr double kSameGeometry = 0.01;  // a base radius may be stated with three digits
  const double expected = rig.rig.backlash_angle(1);
  if (!(std::fabs(curve.backlash_to_angle / expected - 1) < kSameGeometry))
    throw BadData(source, "backlash_to_angle = " + to_text(curve.backlash_to_angle) + ": " + rig.source +
                              " has " + to_text(expected) +
                              "; the curve is of another machine, or a value is in another unit");
  if (curve.conditions.rig_digest == rig.digest) return {};
  return "the curve was made from another version of the rig file; build it again";
}

}  // namespace backlash::studies
