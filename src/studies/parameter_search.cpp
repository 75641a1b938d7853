// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/studies/parameter_search.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_document.h"

namespace backlash::studies {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kLayoutsOnGrid = 4;  // of a promising motion, the best ones are read on the whole grid

using Signal = std::vector<double>;  // sensor torque, `phases` times finer than the sampling, after settling
using Point = CurveFit::Point;

const diagnosis::ApdSettings& apd_of(const rig_file::RigFile& file) {
  if (!file.diagnosis.apd)
    throw InvalidParameter("diagnosis.apd", "absent", "a curve needs the layout of its APD");
  if (file.diagnosis.apd->signal != record::Channel::sensor_torque)
    throw InvalidParameter("diagnosis.apd.signal", record::channel_name(file.diagnosis.apd->signal),
                           "must be sensor_torque");
  return *file.diagnosis.apd;
}

/// Samples per period.
long period_samples(const rig_file::RigFile& file) {
  return std::lround(file.simulation.sensors.sampling_rate * apd_of(file).period);
}

Signal simulate(const rig_file::RigFile& file, const CurveTarget& target, double backlash) {
  const long period = period_samples(file) * target.phases;
  const long first = apd_of(file).settling_periods * period, count = target.periods * period;
  const double rate = file.simulation.sensors.sampling_rate * target.phases;
  simulation::Plant plant(file.rig, file.simulation.excitation, file.simulation.solver);
  plant.set_backlash(backlash);
  Signal signal;
  signal.reserve(count);
  for (long k = 0; k < count; ++k) {
    plant.advance_to(double(first + k) / rate);
    signal.push_back(plant.observe().sensor_torque);
  }
  return signal;
}

Point read(const Signal& signal, const CurveTarget& target, const diagnosis::ApdLayout& layout,
           double backlash) {
  diagnosis::AmplitudeDistribution apd(layout);
  Point point{backlash, 0, kInfinity, -kInfinity, 0, 0};
  for (const double torque : signal) point.largest_torque = std::max(point.largest_torque, std::fabs(torque));
  const std::size_t window = signal.size() / target.periods;
  for (int phase = 0; phase < target.phases; ++phase) {
    double sum = 0;
    for (int period = 0; period < target.periods; ++period) {
      apd.clear();
      for (std::size_t k = phase; k < window; k += target.phases) apd.add(signal[period * window + k]);
      sum += apd.skewness();
      const auto highest = *std::max_element(apd.counts().begin(), apd.counts().end());
      point.highest_class = std::max(point.highest_class, 100.0 * double(highest) / double(apd.samples()));
    }
    const double mean = sum / target.periods;
    point.skewness += mean / target.phases;
    point.lowest = std::min(point.lowest, mean);
    point.highest = std::max(point.highest, mean);
  }
  return point;
}

double rms_of(const std::vector<Point>& points, const CurveTarget& target) {
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += std::pow(points[i].skewness - target.skewness[i], 2);
  return std::sqrt(sum / double(points.size()));
}

void find_rise(CurveFit& fit) {
  double lowest = kInfinity;
  fit.rise = 0;
  for (const Point& point : fit.curve) {
    lowest = std::min(lowest, point.skewness);
    if (point.skewness - lowest > fit.rise || std::isnan(point.skewness)) {
      fit.rise = point.skewness - lowest;
      fit.rise_at = point.backlash;
    }
  }
}

double grid_backlash(const CurveTarget& target, int i) {
  return target.max_backlash * i / (target.points - 1);
}

/// The best reading of one motion.
struct Candidate {
  diagnosis::ApdLayout layout;
  double value = kInfinity;
};

std::vector<diagnosis::ApdLayout> layouts_of(const SearchFile& search) {
  std::vector<diagnosis::ApdLayout> layouts;
  for (int classes = search.fewest_classes; classes <= search.most_classes; ++classes)
    for (const double half_range : search.half_ranges) layouts.push_back({classes, -half_range, half_range});
  return layouts;
}

/// All layouts by their rms at the published values, the best first.
std::vector<Candidate> read_published(const SearchFile& search, const rig_file::RigFile& file) {
  std::vector<Signal> signals;
  for (const double backlash : search.target.backlash)
    signals.push_back(simulate(file, search.target, backlash));
  std::vector<Candidate> candidates;
  for (const diagnosis::ApdLayout& layout : layouts_of(search)) {
    std::vector<Point> points;
    for (std::size_t i = 0; i < signals.size(); ++i)
      points.push_back(read(signals[i], search.target, layout, search.target.backlash[i]));
    const double rms = rms_of(points, search.target);
    candidates.push_back({layout, std::isnan(rms) ? kInfinity : rms});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.value < b.value; });
  return candidates;
}

Candidate judge(const SearchFile& search, const rig_file::RigFile& file) {
  std::vector<Candidate> candidates = read_published(search, file);
  if (!(candidates.front().value <= search.promising)) return candidates.front();
  candidates.resize(std::min(candidates.size(), kLayoutsOnGrid));
  std::vector<CurveFit> fits(candidates.size());
  for (int i = 0; i < search.target.points; ++i) {
    const double backlash = grid_backlash(search.target, i);
    const Signal signal = simulate(file, search.target, backlash);
    for (std::size_t c = 0; c < candidates.size(); ++c)
      fits[c].curve.push_back(read(signal, search.target, candidates[c].layout, backlash));
  }
  Candidate best;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    find_rise(fits[c]);
    const double value = std::min(candidates[c].value + fits[c].rise, search.promising);
    if (value < best.value) best = {candidates[c].layout, value};
  }
  return best;
}

/// One coordinate per parameter from those of the search, which has none for a fixed parameter (here 0.5).
std::vector<double> all_coordinates(const SearchFile& search, const std::vector<double>& x) {
  std::vector<double> all;
  auto next = x.begin();
  for (const FreeParameter& p : search.parameters) all.push_back(p.fixed() ? 0.5 : *next++);
  return all;
}

std::vector<std::string> values_at(const SearchFile& search, const std::vector<double>& x) {
  const std::vector<double> all = all_coordinates(search, x);
  std::vector<std::string> values;
  for (std::size_t i = 0; i < all.size(); ++i) values.push_back(search.parameters[i].value(all[i]));
  return values;
}

std::string comment_of(const FreeParameter& p) {
  const std::string how = p.fixed() ? "set"
                          : p.choices.empty()
                              ? "searched between " + to_text(p.lower) + " and " + to_text(p.upper)
                              : "searched among " + joined(p.choices);
  return p.comment + " [" + how + "]";
}

rig_file::RigDocument rig_with(const SearchFile& search, const std::vector<double>& x) {
  rig_file::RigDocument rig(search.rig_text, search.source + ": rig");
  const std::vector<std::string> values = values_at(search, x);
  for (std::size_t i = 0; i < values.size(); ++i)
    rig.set(search.parameters[i].key, values[i], comment_of(search.parameters[i]));
  return rig;
}

void set_layout(rig_file::RigDocument& rig, const diagnosis::ApdLayout& layout) {
  const std::string how = "[searched]";
  rig.set("diagnosis.apd.classes", std::to_string(layout.classes), how);
  rig.set("diagnosis.apd.lower", to_text(layout.lower), "N m " + how);
  rig.set("diagnosis.apd.upper", to_text(layout.upper), "N m " + how);
}

FreeParameter read_parameter(const YamlReader& yaml) {
  FreeParameter p;
  p.key = yaml.text("key");
  p.comment = yaml.text("comment");
  if (yaml.has("choices")) {
    p.choices = yaml.texts("choices");
    if (p.choices.empty()) yaml.fail("choices", "must not be empty");
    return p;
  }
  p.logarithmic = yaml.choice("scale", {"linear", "log"}) == "log";
  p.lower = yaml.number("lower", p.logarithmic ? Range::positive() : Range::any());
  p.upper = yaml.number("upper", Range::any());
  if (!(p.lower < p.upper)) yaml.fail("upper", "must be greater than lower");
  return p;
}

CurveTarget read_target(const YamlReader& yaml) {
  CurveTarget target;
  target.backlash = yaml.numbers("backlash", Range::not_negative());
  target.skewness = yaml.numbers("skewness", Range::any());
  if (target.backlash.empty() || target.backlash.size() != target.skewness.size())
    yaml.fail("skewness", "must have one value per backlash, and at least one");
  target.max_backlash = yaml.number("max_backlash", Range::positive());
  target.points = static_cast<int>(yaml.integer("points", 2, 1000));
  target.periods = static_cast<int>(yaml.integer("periods", 1, 1000));
  target.phases = static_cast<int>(yaml.integer("phases", 1, 100));
  return target;
}

void read_layouts(const YamlReader& yaml, SearchFile& search) {
  search.fewest_classes = static_cast<int>(yaml.integer("fewest_classes", 2, 10'000));
  search.most_classes = static_cast<int>(yaml.integer("most_classes", search.fewest_classes, 10'000));
  search.half_ranges = yaml.numbers("half_ranges", Range::positive());
  if (search.half_ranges.empty()) yaml.fail("half_ranges", "must not be empty");
}

void read_budget(const YamlReader& yaml, SearchFile& search) {
  search.minimise.seed = static_cast<std::uint64_t>(yaml.integer("seed", 0, 1L << 53));
  search.minimise.population = static_cast<int>(yaml.integer("population", 4, 10'000));
  search.minimise.budget = static_cast<int>(yaml.integer("budget", search.minimise.population, 10'000'000));
  search.minimise.goal = yaml.number("goal", Range::not_negative());
  search.promising = yaml.number("promising", Range::positive());
}

std::string beside(const std::string& path, const std::string& file) {
  const std::size_t slash = path.rfind('/');
  return file.front() == '/' || slash == std::string::npos ? file : path.substr(0, slash + 1) + file;
}

}  // namespace

std::string FreeParameter::value(double u) const {
  if (!choices.empty())
    return choices[std::min(static_cast<std::size_t>(u * double(choices.size())), choices.size() - 1)];
  return fmt::format("{:.4g}",
                     logarithmic ? lower * std::pow(upper / lower, u) : lower + u * (upper - lower));
}

SearchFile load_search_file(const std::string& path) {
  const YamlReader yaml = YamlReader::from_file(path);
  SearchFile search;
  search.source = path;
  yaml.integer("schema_version", 1, 1);
  search.rig_source = beside(path, yaml.text("rig"));
  search.rig_text = rig_file::load_rig_file(search.rig_source).text;
  read_budget(yaml.map("search"), search);
  search.target = read_target(yaml.map("target"));
  for (const YamlReader& p : yaml.maps("parameters")) search.parameters.push_back(read_parameter(p));
  if (search.parameters.empty()) yaml.fail("parameters", "must not be empty");
  read_layouts(yaml.map("layouts"), search);
  yaml.finish();
  return search;
}

void set_parameter(SearchFile& search, const std::string& key, const std::string& value) {
  auto place = std::find_if(search.parameters.begin(), search.parameters.end(),
                            [&](const FreeParameter& p) { return p.key == key; });
  if (place == search.parameters.end())
    place = search.parameters.insert(place, FreeParameter{key, "", 0, 0, false, {}});
  place->comment = "not as in the search file";
  const std::size_t dots = value.find("..");
  place->choices.clear();
  if (dots == std::string::npos) {
    place->choices = {value};
    return;
  }
  const ParsedNumber lower = parse_number(value.substr(0, dots)),
                     upper = parse_number(value.substr(dots + 2));
  if (!lower || !upper || !(lower.value > 0 && lower.value < upper.value))
    throw InvalidParameter(key, value, "must be a value or LOWER..UPPER with 0 < LOWER < UPPER");
  place->lower = lower.value;
  place->upper = upper.value;
  place->logarithmic = true;
}

CurveFit fit_of(const rig_file::RigFile& file, const CurveTarget& target) {
  const diagnosis::ApdLayout& layout = apd_of(file).layout;
  CurveFit fit;
  for (const double backlash : target.backlash)
    fit.published.push_back(read(simulate(file, target, backlash), target, layout, backlash));
  for (int i = 0; i < target.points; ++i) {
    const double backlash = grid_backlash(target, i);
    fit.curve.push_back(read(simulate(file, target, backlash), target, layout, backlash));
  }
  fit.rms = rms_of(fit.published, target);
  find_rise(fit);
  return fit;
}

SearchResult search_parameters(const SearchFile& search, const Progress& progress) {
  const auto judged = [&](const std::vector<double>& x) { return judge(search, rig_with(search, x).read()); };
  const auto objective = [&](const std::vector<double>& x) {
    try {
      return judged(x).value;
    } catch (const IntegrationError&) {
      return kInfinity;  // a rig that cannot be simulated meets no curve
    }
  };
  const auto dimensions = std::count_if(search.parameters.begin(), search.parameters.end(),
                                        [](const FreeParameter& p) { return !p.fixed(); });
  const MinimiseResult found = minimise(objective, dimensions, search.minimise, progress);
  SearchResult result;
  rig_file::RigDocument best = rig_with(search, found.x);
  best.drop_head();  // it describes the rig that the search began with
  set_layout(best, judged(found.x).layout);
  result.rig_text = best.text();
  result.values = values_at(search, found.x);
  const std::vector<double> all = all_coordinates(search, found.x);
  for (std::size_t i = 0; i < all.size(); ++i)
    result.at_bound.push_back(search.parameters[i].choices.empty() && std::fabs(all[i] - 0.5) > 0.49);
  result.fit = fit_of(best.read(), search.target);
  result.evaluations = found.evaluations;
  result.history = found.history;
  return result;
}

}  // namespace backlash::studies
