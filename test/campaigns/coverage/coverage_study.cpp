// SPDX-License-Identifier: BSD-3-Clause
// How often the 95 % intervals of fitted parameters hold: draws machines, simulates a record of each, fits as
// `identify` and `trace_residual` do, and counts. Deterministic for its arguments.
//
// The effects are those of the registry, with sizes that would show clearly (TermSearch). The right effect is
// given to the fit, so that its errors are counted and not whether it is found.
#include <fmt/format.h>

#include <boost/math/distributions/binomial.hpp>
#include <boost/program_options.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/identify.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "identification/effects/found_effects.h"
#include "identification/effects/steps.h"
#include "identification/effects/traced_records.h"

namespace backlash::coverage {
namespace {

using namespace identification;
using Json = nlohmann::ordered_json;

struct Options {
  std::string servo, joint, effects = "none", out;
  std::uint64_t seed = 1;
  int machines = 20;
  double duration = 0;  // s; 0: 30 of a servo, 80 of a joint
  double noise = 1;     // times the rig file's
};

/// One kind of machine and how its records are made.
struct Kind {
  std::string name;
  rig_file::RigFile file;
  bool servo;
  double duration;  // s
};

struct Outcome {
  double truth, value, standard_error;
  double z() const { return (value - truth) / standard_error; }
};
using Outcomes = std::map<std::string, Outcome>;

/// All that the rig declares, each up to 40 % off.
model::Rig draw_machine(const model::Rig& declared, Random& random) {
  model::Rig rig = declared;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters())
    if (p.known_to(rig) && p.positive() && p.get(rig) > 0) p.set(rig, p.get(rig) * random.uniform(0.6, 1.4));
  if (!rig.mesh.rigid && random.uniform() < 0.5) rig.encoder_skew = random.uniform(0, 3e-3);
  return rig;
}

simulation::SpeedController controller(const model::Rig& rig, double rate) {
  const double inertia = rig.motor.inertia + rig.link.inertia;
  constexpr double kBandwidth = 2 * M_PI * 6;  // rad/s, choice
  return {rate, inertia * kBandwidth, inertia * kBandwidth * kBandwidth / 4, 1e6};
}

/// To and fro at random speeds, as a loop commands it, or by a random torque.
simulation::ExcitationSettings draw_motion(const Kind& kind, const model::Rig& rig, Random& random) {
  simulation::ExcitationSettings e;
  e.seed = random.bits();
  if (kind.servo && random.uniform() < 0.5) {
    e.type = "random";
    e.amplitude = 4 * rig.motor.coulomb_friction;  // N m rms
    e.start_frequency = 0.2;
    e.end_frequency = 8;
    e.line_count = 60;
    return e;
  }
  e.type = "constant_speed";
  e.controller = controller(rig, kind.servo ? kind.file.simulation.sensors.sampling_rate : 1000);
  e.hold = kind.servo ? 0.25 : 1;
  e.ramp = kind.servo ? 0.1 : 0.5;
  for (double way = 0; e.speeds.size() < 400;) {  // back towards where it began
    const double speed = (way > 0 ? -1 : 1) * random.uniform(0.05, 1);
    way += speed;
    e.speeds.push_back(speed);
  }
  return e;
}

/// Every eighth millisecond or so: what a logger without a clock of its own writes.
record::Record with_jitter(const record::Record& fast, Random& random) {
  record::Record record;
  record.name = fast.name;
  for (double at = 0; at + 10 < double(fast.size()); at += 8) {
    const auto k = std::size_t(at + random.uniform(0, 3));
    record.time.push_back(fast.time[k]);
    for (const record::Channel c : record::kChannels)
      if (fast.has(c)) record.column(c).push_back(fast.column(c)[k]);
  }
  return record;
}

record::Record record_of(const Kind& kind, const model::Rig& rig, double noise, Random& random) {
  simulation::SimulationSettings settings = kind.file.simulation;
  settings.excitation = draw_motion(kind, rig, random);
  settings.sensors.seed = random.bits();
  settings.sensors.of(record::Channel::motor_torque).noise *= noise;
  settings.solver.relative_tolerance = 1e-8;
  settings.solver.position_tolerance = 1e-11;
  settings.solver.velocity_tolerance = 1e-8;
  const bool jitter = !kind.servo && random.uniform() < 0.5;
  if (!kind.servo) settings.sensors.sampling_rate = jitter ? 1000 : 125;
  const record::Record record = simulation::simulate_record(rig, settings, kind.duration);
  return jitter ? with_jitter(record, random) : record;
}

/// What the machine's own friction allows: no sum of frictions is below 0 anywhere. Infinite of other
/// torques.
double most_friction(const model::TermType& type, const ParameterSpec& strength, const model::Body& body) {
  constexpr double kShare = 0.7;  // choice
  if (strength.unit == "N m s/rad") return kShare * body.viscous_damping;
  const bool dry = type.id.find("coulomb") != std::string::npos ||
                   type.id.find("friction") != std::string::npos || type.id == "stribeck";
  return dry && strength.unit == "N m" ? kShare * body.coulomb_friction : INFINITY;
}

/// A term of a size that would show clearly in such a motion.
ParameterValues draw_term(const model::TermType& type, const Kind& kind, const model::Rig& rig,
                          const model::MotionRange& range, Random& random) {
  ParameterValues values;
  const model::Body* body = &rig.motor;
  for (const ParameterSpec& spec : type.parameters) {
    if (!spec.choices.empty()) {
      const auto choice = kind.servo ? random.below(spec.choices.size()) : 0;
      values.set_choice(spec.name, spec.choices[choice]);
      if (spec.choices[choice] == "load") body = &rig.link;
    } else if (spec.name == type.search->strength) {
      const double size =
          std::min(type.search->typical(range), most_friction(type, spec, *body) / 3) * random.uniform(1, 3);
      values[spec.name] = spec.range.lower < 0 && random.uniform() < 0.5 ? -size : size;
    } else if (spec.name == type.search->phase) {
      values[spec.name] = random.uniform(-M_PI, M_PI);
    }
  }
  for (const model::TermShape& shape : type.search->shapes) {
    std::vector<double> grid = shape.values(range);
    std::sort(grid.begin(), grid.end());
    const auto at = [&](double share) { return grid[std::size_t(share * double(grid.size() - 1))]; };
    values[shape.name] = shape.wave      ? random.uniform(3, 30)
                         : shape.refined ? random.uniform(at(0.4), at(0.7))
                                         : grid[random.below(grid.size())];
  }
  return values;
}

/// Near the truth, as a search would hand it to the fit.
ParameterValues start_near(ParameterValues values, const model::TermType& type,
                           const model::MotionRange& range) {
  values[type.search->strength] = 0.8 * values.at(type.search->strength);
  if (!type.search->phase.empty()) values[type.search->phase] = values.at(type.search->phase) + 0.2;
  for (const model::TermShape& shape : type.search->shapes)
    if (shape.wave)
      values[shape.name] = values.at(shape.name) + 0.05 * model::order_resolution(range);
    else if (shape.refined)
      values[shape.name] = 1.1 * values.at(shape.name);
  return values;
}

Outcomes machine_outcomes(const std::map<std::string, signal::Measured>& found, const model::Rig& truth) {
  Outcomes all;
  for (const auto& [name, m] : found)
    all[name] = {rig_file::servo_parameter(name).get(truth), m.value, m.standard_error};
  return all;
}

Outcomes identified(const model::Rig& declared, const record::Record& record, const model::Rig& truth) {
  const Identification found = identify(declared, {record});
  if (!declared.mesh.rigid) return machine_outcomes(found.parameters, truth);
  Outcomes all;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters())
    if (const auto at = found.parameters.find(p.one_inertia); at != found.parameters.end())
      all[p.one_inertia] = {p.get(truth), at->second.value, at->second.standard_error};
  return all;
}

/// As trace_residual fits an effect that it has found.
Outcomes traced(const model::Rig& declared, const record::Record& record, const model::Rig& truth,
                const std::string& id) {
  const std::vector<ServoData> data = {traced_data(record, declared)};
  SearchContext context{data,
                        data.front(),
                        motion_range(data),
                        SearchSettings(TraceSettings()),
                        [](const std::string&) {},
                        [](const Hypothesis&) {}};
  context.settings.fit = with_bands({}, declared, data);
  Hypothesis h = fit_declared(declared, context);
  Candidate candidate;
  if (id != "none") {
    const model::TermType& type = model::term_type(id);
    Effect effect;
    candidate.id = effect.candidate.id = id;
    candidate.terms = {truth.terms.back()->values};
    effect.candidate.terms = {start_near(truth.terms.back()->values, type, context.range)};
    const auto with = refitted(h, {effect}, context);
    if (!with) throw CannotIdentify("the fit fails");
    h = *with;
  }
  constexpr double kIncompleteFit = 1.5;  // as identify: beyond it a fit says that it is not complete
  if (const Misfit& m = misfit(h); std::max(m.torque, m.deflection) > kIncompleteFit)
    throw CannotIdentify(
        fmt::format("the fit says that it lacks something: torque {:.2g}, deflection {:.2g} times the noise",
                    m.torque, m.deflection));
  const FittedValues values = fitted_values(*h.fitted, h.declared->parameters.size());
  Outcomes all = machine_outcomes(values.machine, truth);
  if (id == "none") return all;
  const model::TermSearch& search = *model::term_type(id).search;
  std::vector<std::string> names = {search.strength};
  if (!search.phase.empty()) names.push_back(search.phase);
  for (const model::TermShape* shape : fitted_shapes(candidate, 0)) names.push_back(shape->name);
  for (std::size_t i = 0; i < names.size(); ++i) {
    Outcome& o = all[id + "." + names[i]];
    o = {candidate.terms[0].at(names[i]), values.effects[i].value, values.effects[i].standard_error};
    if (names[i] == search.phase) o.value = o.truth + std::remainder(o.value - o.truth, 2 * M_PI);
  }
  return all;
}

model::MotionRange usual_range(const Kind& kind, const model::Rig& rig, Random random) {
  const std::vector<ServoData> data = {servo_data(record_of(kind, rig, 1, random), rig)};
  return motion_range(data);
}

/// Outcomes by "what fitted it", or why there are none.
std::map<std::string, Outcomes> one_machine(const Kind& kind, const std::string& id, double noise,
                                            std::uint64_t seed, std::uint32_t number) {
  Random random(seed, number);
  const model::Rig declared = model::load_side(kind.file.rig);
  model::Rig truth = draw_machine(declared, random);
  if (id != "none") {
    const model::TermType& type = model::term_type(id);
    Random range_random(random.bits());
    truth.terms.push_back(
        model::make_term(id, draw_term(type, kind, truth, usual_range(kind, truth, range_random), random)));
  }
  const record::Record record = record_of(kind, truth, noise, random);
  std::map<std::string, Outcomes> all;
  if (id == "none") all["identify"] = identified(declared, record, truth);
  all["trace_residual"] = traced(declared, record, truth, id);
  return all;
}

/// Exact 95 % interval of a share (Clopper and Pearson).
std::pair<double, double> share_interval(int held, int all) {
  using Binomial = boost::math::binomial_distribution<>;
  return {Binomial::find_lower_bound_on_p(all, held, 0.025),
          Binomial::find_upper_bound_on_p(all, held, 0.025)};
}

Json summary(const std::vector<Outcome>& all) {
  int held = 0;
  std::vector<double> z, size, error;
  for (const Outcome& o : all) {
    held += std::fabs(o.z()) < signal::kNormalQuantile975;
    z.push_back(o.z());
    size.push_back(std::fabs(o.z()));
    error.push_back(o.standard_error / std::fabs(o.truth));
  }
  const auto [low, high] = share_interval(held, int(all.size()));
  return {{"machines", all.size()},
          {"held", double(held) / double(all.size())},
          {"interval", {low, high}},
          {"median_z", signal::median(z)},
          {"median_size_of_z", signal::median(size)},
          {"largest_z", *std::max_element(size.begin(), size.end())},
          {"relative_standard_error", signal::median(error)}};
}

void print(const std::string& who, const std::string& name, const Json& s) {
  std::printf("%-44s %4d %6.1f %% (%3.0f to %3.0f) %7.2f %7.2f %7.1f %9.2g\n", (who + " " + name).c_str(),
              s["machines"].get<int>(), 100 * s["held"].get<double>(), 100 * s["interval"][0].get<double>(),
              100 * s["interval"][1].get<double>(), s["median_z"].get<double>(),
              s["median_size_of_z"].get<double>(), s["largest_z"].get<double>(),
              s["relative_standard_error"].get<double>());
}

std::vector<std::string> effects_of(const std::string& list) {
  std::vector<std::string> ids;
  if (list == "all") {
    ids = {"none"};
    for (const model::TermType& type : model::term_types())
      if (type.search && type.id != "backlash") ids.push_back(type.id);
  } else {
    std::istringstream stream(list);
    for (std::string id; std::getline(stream, id, ',');) ids.push_back(id);
  }
  return ids;
}

void study(const Kind& kind, const Options& options, Json& json) {
  std::printf(
      "\n%s: what fitted it, parameter          machines  held       (95 %%)   median z  |z|  largest  "
      "se/value\n",
      kind.name.c_str());
  for (const std::string& id : effects_of(options.effects)) {
    std::map<std::pair<std::string, std::string>, std::vector<Outcome>> all;
    int failed = 0;
    for (int i = 0; i < options.machines; ++i) try {
        for (const auto& [who, outcomes] :
             one_machine(kind, id, options.noise, options.seed, std::uint32_t(i)))
          for (const auto& [name, o] : outcomes) all[{who, name}].push_back(o);
      } catch (const Error& error) {
        ++failed;
        std::cerr << kind.name << ' ' << id << ' ' << i << ": " << error.what() << '\n';
      }
    for (const auto& [key, outcomes] : all) {
      const Json s = summary(outcomes);
      print(key.first + (id == "none" ? "" : " +" + id), key.second, s);
      Json row = s;
      for (const Outcome& o : outcomes) row["outcomes"].push_back({o.truth, o.value, o.standard_error});
      json[kind.name][id][key.first][key.second] = row;
    }
    if (failed > 0) std::printf("%s +%s: %d could not be fitted\n", kind.name.c_str(), id.c_str(), failed);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace backlash::coverage

int main(int argc, char** argv) {
  using namespace backlash::coverage;
  namespace po = boost::program_options;
  Options options;
  po::options_description all("coverage_study [--servo RIG.yaml] [--joint RIG.yaml] [options]");
  auto add = all.add_options();
  add("help,h", "this text");
  add("servo", po::value(&options.servo), "machine with two inertias, 30 s at its rate");
  add("joint", po::value(&options.joint),
      "machine with one inertia, 80 s at 125 Hz, half of them with jitter");
  add("effects", po::value(&options.effects), "ids with commas, none, or all (which has none in it)");
  add("machines", po::value(&options.machines), "of each effect; default 20");
  add("seed", po::value(&options.seed), "default 1");
  add("duration", po::value(&options.duration), "of a record [s]");
  add("noise", po::value(&options.noise), "times the rig file's noise of the torque");
  add("json", po::value(&options.out), "all outcomes");
  try {
    po::variables_map given;
    po::store(po::parse_command_line(argc, argv, all), given);
    po::notify(given);
    if (given.count("help") != 0) {
      std::cout << all;
      return 0;
    }
    Json json;
    const auto run = [&](const std::string& path, const std::string& name, bool servo, double duration) {
      if (path.empty()) return;
      study({name, backlash::rig_file::load_rig_file(path), servo,
             options.duration > 0 ? options.duration : duration},
            options, json);
    };
    run(options.servo, "servo", true, 30);
    run(options.joint, "joint", false, 80);
    if (!options.out.empty()) std::ofstream(options.out) << json.dump(1) << '\n';
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "coverage_study: " << error.what() << '\n';
    return 64;
  }
}
