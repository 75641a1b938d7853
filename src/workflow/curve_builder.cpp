#include "backlash_diagnosis/workflow/curve_builder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"

namespace backlash {
namespace {

constexpr double kRelativeNoise[] = {0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2};  // of the signal's scale
constexpr double kFinestSampling = 1e5;                                      // Hz
constexpr double kFewestPerPeriod = 16;                                      // samples
constexpr double kMostSamples = 5e7;                                         // of one run, about 1 GB

double signal_of(const Observation& o, Channel channel) {
  switch (channel) {
    case Channel::motor_torque:
      return o.motor_torque;
    case Channel::motor_position:
      return o.motor_position;
    case Channel::motor_velocity:
      return o.motor_velocity;
    case Channel::load_position:
      return o.load_position;
    case Channel::load_velocity:
      return o.load_velocity;
    case Channel::sensor_torque:
      return o.sensor_torque;
    case Channel::motor_current:
      return o.motor_current;
    case Channel::acceleration:
      return o.acceleration;
    case Channel::reference_position:
      break;
  }
  return kNaN;
}

/// What one backlash value contributes.
struct Cell {
  CurvePoint point;
  double motor_travel = 0, amplitude = 0, excitation_level = 0;
};

/// Everything that is the same for all backlash values.
struct Plan {
  const RigFile& file;
  CurveRequest request;
  ApdSettings apd;
  int phases;
  std::vector<double> noise_levels;
};

/// The exact signal, `phases` times finer than the sampling.
struct FineRun {
  std::vector<double> signal, torque, position;
};

/// Progress of all workers together; learns from it whether to stop.
class Ticker {
 public:
  Ticker(const Progress& progress, long total) : progress_(progress), total_(total) {}

  /// One more tick is done. Throws Cancelled.
  void tick() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++done_;
    if (!stop_ && progress_ && !progress_(static_cast<double>(done_) / total_, "building the curve"))
      stop_ = true;
    if (stop_) throw Cancelled();
  }
  void stop() { stop_ = true; }
  bool stopped() const { return stop_; }

 private:
  const Progress& progress_;
  long total_, done_ = 0;
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
};

long periods_of(const Plan& plan) {
  return static_cast<long>(plan.apd.settling_periods) + plan.request.periods;
}

double fine_samples(const Plan& plan) {
  return periods_of(plan) * plan.apd.period * plan.request.sampling_rate * plan.phases + plan.phases;
}

FineRun run_fine(const Plan& plan, double backlash, Ticker& ticker) {
  Plant plant(plan.file.rig, plan.file.simulation.excitation, plan.file.simulation.solver);
  plant.set_backlash(backlash);
  const double rate = plan.request.sampling_rate * plan.phases;
  const long count = std::lround(fine_samples(plan)), ticks = periods_of(plan);
  FineRun run;
  for (long k = 0; k < count; ++k) {
    plant.advance_to(k / rate);
    const Observation o = plant.observe();
    run.signal.push_back(signal_of(o, plan.apd.signal));
    run.torque.push_back(o.motor_torque);
    run.position.push_back(o.motor_position);
    if ((k + 1) * ticks / count > k * ticks / count) ticker.tick();
  }
  return run;
}

/// Skewness of each period of one seed at one noise level.
std::vector<double> sample_run(const Plan& plan, const FineRun& run, int seed, double noise,
                               CurvePoint& point) {
  SensorsSettings sensors = plan.file.simulation.sensors;
  sensors.seed += static_cast<std::uint64_t>(seed);
  sensors.of(plan.apd.signal).noise = noise;
  SensorModel sensor(sensors);
  PeriodAnalyser analyser(plan.apd.period, plan.apd.layout);
  std::vector<double> skewness, values;
  for (std::size_t i = seed % plan.phases, k = 0; i < run.signal.size(); i += plan.phases, ++k) {
    const double value = sensor.measure(plan.apd.signal, run.signal[i]);
    values.push_back(value);
    const PeriodResult* period = analyser.add(k / plan.request.sampling_rate, value);
    if (period && period->index >= plan.apd.settling_periods) skewness.push_back(period->apd.skewness());
  }
  point.signal_level = median_magnitude(std::move(values));
  return skewness;
}

/// Mean over all, scatter inside the runs, scatter of the runs' means beyond that.
SkewnessCell summarise(const std::vector<std::vector<double>>& runs) {
  RunningMoments all, means;
  double within = 0;
  std::size_t freedom = 0;
  for (const auto& run : runs) {
    RunningMoments own;
    for (double s : run) {
      all.add(s);
      own.add(s);
    }
    means.add(own.mean());
    within += own.standard_deviation() * own.standard_deviation() * own.count();
    freedom += own.count() - 1;
  }
  SkewnessCell cell;
  cell.mean = all.mean();
  cell.within = freedom > 0 ? std::sqrt(within / freedom) : 0;
  const double n = runs.front().size(), m = runs.size();
  const double variance = m > 1 ? means.standard_deviation() * means.standard_deviation() * m / (m - 1) : 0;
  cell.between = std::sqrt(std::max(0.0, variance - cell.within * cell.within / n));
  return cell;
}

Cell make_cell(const Plan& plan, double backlash, Ticker& ticker) {
  const FineRun run = run_fine(plan, backlash, ticker);
  Cell cell;
  cell.point.backlash = backlash;
  for (const double noise : plan.noise_levels) {
    std::vector<std::vector<double>> skewness;
    CurvePoint scratch;
    for (int seed = 0; seed < plan.request.seeds; ++seed)
      skewness.push_back(sample_run(plan, run, seed, noise, scratch));
    if (noise == plan.file.simulation.sensors.of(plan.apd.signal).noise)
      cell.point.signal_level = scratch.signal_level;
    cell.point.cells.push_back(summarise(skewness));
    if (std::isnan(cell.point.cells.back().mean))
      throw InvalidParameter("diagnosis.apd", plan.apd.layout.upper,
                             "the classes hold no sample of the signal");
  }
  cell.motor_travel = travel_of(run.position);
  for (double torque : run.torque) cell.amplitude = std::max(cell.amplitude, std::fabs(torque));
  cell.excitation_level = median_magnitude(run.torque);
  return cell;
}

void check(const CurveRequest& request) {
  if (request.points < 2) throw InvalidParameter("points", request.points, "must be >= 2");
  if (!(request.max_backlash > 0 && std::isfinite(request.max_backlash)))
    throw InvalidParameter("max_backlash", request.max_backlash, "must be > 0 and finite");
  if (request.periods < 1) throw InvalidParameter("periods", request.periods, "must be >= 1");
  if (request.seeds < 1) throw InvalidParameter("seeds", request.seeds, "must be >= 1");
  if (!(request.sampling_rate > 0 && std::isfinite(request.sampling_rate)))
    throw InvalidParameter("sample_rate", request.sampling_rate, "must be > 0 Hz and finite");
}

double largest_torque(const ExcitationSettings& excitation) {
  double largest = excitation.amplitude;
  for (const SineLine& line : excitation.lines) largest += line.amplitude;
  return largest;
}

void check_signal(const RigFile& file, Channel signal) {
  if (file.rig.input_coupling.rigid && signal == Channel::sensor_torque)
    throw InvalidParameter("diagnosis.apd.signal", "sensor_torque",
                           "the rig's input coupling is rigid: no sensor");
  if (std::isnan(file.rig.torque_constant) && signal == Channel::motor_current)
    throw InvalidParameter("diagnosis.apd.signal", "motor_current",
                           "needs gear_train.motor.torque_constant (N m/A)");
}

/// What noise is counted by, in the unit of the signal: for a torque the largest that the motor applies, for
/// another signal its own rms value at the largest backlash.
double signal_scale(Plan plan) {
  if (std::string(channel_unit(plan.apd.signal)) == channel_unit(Channel::motor_torque))
    return largest_torque(plan.file.simulation.excitation);
  plan.request.periods = 1;
  const Progress nobody;
  Ticker quiet(nobody, 1);
  double squares = 0;
  const FineRun run = run_fine(plan, plan.request.max_backlash, quiet);
  for (const double value : run.signal) squares += value * value;
  return std::sqrt(squares / run.signal.size());
}

Plan make_plan(const RigFile& file, CurveRequest request) {
  if (!file.diagnosis.apd)
    throw InvalidParameter("diagnosis.apd", "absent", "a curve needs the layout of its APD");
  if (request.sampling_rate == 0) request.sampling_rate = file.simulation.sensors.sampling_rate;
  check(request);
  Plan plan{file, request, *file.diagnosis.apd, 1, {}};
  const double period = file.simulation.excitation.create()->period();
  if (!(period > 0))
    throw InvalidParameter("excitation.type", file.simulation.excitation.type,
                           "a curve needs a periodic excitation");
  if (!(plan.apd.period > 0)) plan.apd.period = period;
  check_signal(file, plan.apd.signal);
  if (!(request.sampling_rate * plan.apd.period >= kFewestPerPeriod))
    throw InvalidParameter("sample_rate", request.sampling_rate,
                           "must give at least 16 samples per period of " + to_text(plan.apd.period) + " s");
  plan.phases = std::clamp(static_cast<int>(kFinestSampling / request.sampling_rate), 1, request.seeds);
  if (!(fine_samples(plan) <= kMostSamples))
    throw InvalidParameter("periods", request.periods, "too many samples at this sampling rate");
  const double declared = file.simulation.sensors.of(plan.apd.signal).noise;
  const double scale = signal_scale(plan);
  for (const double share : kRelativeNoise) plan.noise_levels.push_back(share * scale);
  plan.noise_levels.push_back(declared);
  std::sort(plan.noise_levels.begin(), plan.noise_levels.end());
  plan.noise_levels.erase(std::unique(plan.noise_levels.begin(), plan.noise_levels.end()),
                          plan.noise_levels.end());
  return plan;
}

/// Cells of all grid points, worked on by all processors.
std::vector<Cell> make_cells(const Plan& plan, const Progress& progress) {
  const int count = plan.request.points;
  std::vector<Cell> cells(count);
  Ticker ticker(progress, count * periods_of(plan));
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (int i = next++; i < count && !ticker.stopped(); i = next++) try {
        cells[i] = make_cell(plan, plan.request.max_backlash * i / (count - 1), ticker);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        ticker.stop();
      }
  };
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
  return cells;
}

}  // namespace

double nominal_sampling_rate(double interval) {
  if (!(interval > 0)) throw InvalidParameter("sampling interval", interval, "must be > 0 s");
  const double scale = std::pow(10, 3 - std::floor(std::log10(1 / interval)));
  return std::round(scale / interval) / scale;
}

MonitoringCurve build_curve(const RigFile& file, const CurveRequest& request, const Progress& progress) {
  const Plan plan = make_plan(file, request);
  MonitoringCurve curve;
  CurveConditions& c = curve.conditions;
  c.rig = file.rig.name;
  c.rig_digest = file.digest;
  c.version = BACKLASH_DIAGNOSIS_VERSION;
  c.signal = channel_name(plan.apd.signal);
  c.excitation = file.simulation.excitation.type;
  c.frequency = 1 / plan.apd.period;
  c.sampling_rate = plan.request.sampling_rate;
  c.apd = plan.apd.layout;
  c.periods = plan.request.periods;
  c.settling_periods = plan.apd.settling_periods;
  c.seeds = plan.request.seeds;
  c.noise = file.simulation.sensors.of(plan.apd.signal).noise;
  c.output_locked = file.rig.link_locked;
  c.angular = file.rig.mesh.angular();
  curve.noise_levels = plan.noise_levels;
  curve.backlash_to_angle = file.rig.backlash_angle(1);
  for (Cell& cell : make_cells(plan, progress)) {
    c.motor_travel = std::max(c.motor_travel, cell.motor_travel);
    c.amplitude = std::max(c.amplitude, cell.amplitude);
    c.excitation_level = cell.excitation_level;
    curve.points.push_back(std::move(cell.point));
  }
  curve.finish();
  return curve;
}

}  // namespace backlash
