// SPDX-License-Identifier: BSD-3-Clause
// Monitoring curves as files.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/monitoring_curve.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {
namespace {

constexpr long kSchema = 2;  // 1 knew nothing of what the rig file leaves open

void emit_conditions(YAML::Emitter& out, const CurveConditions& c) {
  out << YAML::Key << "conditions" << YAML::Value << YAML::BeginMap;
  const auto text = [&out](const char* key, const std::string& value) {
    out << YAML::Key << key << YAML::Value << YAML::DoubleQuoted << value;
  };
  const auto number = [&out](const char* key, double value, const char* unit) {
    out << YAML::Key << key << YAML::Value << to_text(value) << YAML::Comment(unit);
  };
  const auto integer = [&out](const char* key, int value, const char* unit) {
    out << YAML::Key << key << YAML::Value << value << YAML::Comment(unit);
  };
  text("rig", c.rig);
  text("rig_digest", c.rig_digest);
  text("version", c.version);
  text("signal", c.signal);
  text("excitation", c.excitation);
  number("amplitude", c.amplitude, "N m");
  number("excitation_level", c.excitation_level, "N m, median magnitude");
  number("frequency", c.frequency, "Hz");
  number("sampling_rate", c.sampling_rate, "Hz");
  out << YAML::Key << "apd" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "classes"
      << YAML::Value << c.apd.classes << YAML::Key << "lower" << YAML::Value << to_text(c.apd.lower)
      << YAML::Key << "upper" << YAML::Value << to_text(c.apd.upper) << YAML::EndMap;
  integer("periods", c.periods, "per seed");
  integer("settling_periods", c.settling_periods, "discarded");
  integer("seeds", c.seeds, "runs with other noise and sampling phase");
  number("noise", c.noise, "declared standard deviation, unit of the signal");
  number("motor_travel", c.motor_travel, "rad, largest on the curve");
  out << YAML::Key << "output_locked" << YAML::Value << c.output_locked;
  out << YAML::Key << "angular" << YAML::Value << c.angular << YAML::EndMap;
}

void emit_row(YAML::Emitter& out, const char* key, const std::vector<double>& values) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (double v : values) out << to_text(v);
  out << YAML::EndSeq;
}

void emit_point(YAML::Emitter& out, const MonitoringCurve& curve, const CurvePoint& point) {
  std::vector<double> mean, between, within;
  for (const SkewnessCell& cell : point.cells) {
    mean.push_back(cell.mean);
    between.push_back(cell.between);
    within.push_back(cell.within);
  }
  const SkewnessCell& nominal = curve.nominal(point);
  out << YAML::BeginMap;
  out << YAML::Key << "backlash" << YAML::Value << to_text(point.backlash);
  out << YAML::Key << "half_gap" << YAML::Value << to_text(point.backlash / 2);
  out << YAML::Key << "skewness" << YAML::Value << to_text(nominal.mean);
  out << YAML::Key << "scatter" << YAML::Value << to_text(std::hypot(nominal.between, nominal.within));
  out << YAML::Key << "monotonic" << YAML::Value << point.monotonic;
  out << YAML::Key << "signal_level" << YAML::Value << to_text(point.signal_level);
  emit_row(out, "mean", mean);
  emit_row(out, "between", between);
  emit_row(out, "within", within);
  out << YAML::EndMap;
}

void emit_family(YAML::Emitter& out, const ApdFamily& family) {
  out << YAML::Key << "family" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "segments" << YAML::Value << YAML::BeginSeq;
  for (const FamilySegment& segment : family.segments) {
    out << YAML::BeginMap << YAML::Key << "floor" << YAML::Value << to_text(segment.floor);
    emit_row(out, "threshold", segment.threshold);
    emit_row(out, "misfit", segment.misfit);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::Key << "members" << YAML::Value << YAML::BeginSeq;
  for (const auto& phases : family.members) {
    std::vector<double> values;  // all phases in one row
    for (const Quantiles& member : phases) values.insert(values.end(), member.begin(), member.end());
    out << YAML::BeginMap;
    emit_row(out, "quantiles", values);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
}

void emit_widening(YAML::Emitter& out, const char* key, const DeclaredSpread::Widening& w) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
  const auto row = [&out](const char* name, const std::vector<double>& values) {
    out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (const double v : values) out << to_text(v);
    out << YAML::EndSeq;
  };
  row("below", w.below);
  row("above", w.above);
  out << YAML::Key << "bound" << YAML::Value << to_text(w.bound) << YAML::EndMap;
}

void emit_spread(YAML::Emitter& out, const DeclaredSpread& spread) {
  out << YAML::Key << "spread" << YAML::Value
      << YAML::Comment("of answers on machines that the rig file allows, unit of backlash") << YAML::BeginMap;
  out << YAML::Key << "machines" << YAML::Value << spread.machines;
  out << YAML::Key << "limit" << YAML::Value << YAML::DoubleQuoted << spread.limit;
  emit_widening(out, "apd_skewness", spread.skewness);
  emit_widening(out, "apd_shape", spread.shape);
  out << YAML::EndMap;
}

CurveConditions read_conditions(const YamlReader& yaml) {
  CurveConditions c;
  c.rig = yaml.text("rig");
  c.rig_digest = yaml.text("rig_digest");
  c.version = yaml.text("version");
  std::vector<std::string> channels;
  for (const record::Channel channel : record::kChannels) channels.push_back(record::channel_name(channel));
  c.signal = yaml.choice("signal", channels);
  c.excitation = yaml.text("excitation");
  c.amplitude = yaml.number("amplitude", Range::not_negative());
  c.excitation_level = yaml.number("excitation_level", Range::not_negative());
  c.frequency = yaml.number("frequency", Range::not_negative());
  c.sampling_rate = yaml.number("sampling_rate", Range::positive());
  c.apd = read_apd_layout(yaml.map("apd"));
  c.periods = static_cast<int>(yaml.integer("periods", 1, 1'000'000));
  c.settling_periods = static_cast<int>(yaml.integer("settling_periods", 0, 1'000'000));
  c.seeds = static_cast<int>(yaml.integer("seeds", 1, 1'000'000));
  c.noise = yaml.number("noise", Range::not_negative());
  c.motor_travel = yaml.number("motor_travel", Range::not_negative());
  c.output_locked = yaml.boolean("output_locked");
  c.angular = yaml.boolean("angular");
  return c;
}

CurvePoint read_point(const YamlReader& yaml, std::size_t levels) {
  CurvePoint point;
  point.backlash = yaml.number("backlash", Range::not_negative());
  // Repeated for readers, who may also have edited them.
  for (const char* derived : {"half_gap", "skewness", "scatter"}) (void)yaml.number(derived, Range::any());
  if (std::fabs(yaml.number("half_gap", Range::any()) - point.backlash / 2) > 1e-6 * point.backlash)
    yaml.fail("half_gap", "must be half of backlash");
  point.monotonic = yaml.boolean("monotonic");
  point.signal_level = yaml.number("signal_level", Range::not_negative());
  const auto mean = yaml.numbers("mean", Range::any());
  const auto between = yaml.numbers("between", Range::not_negative());
  const auto within = yaml.numbers("within", Range::not_negative());
  if (mean.size() != levels || between.size() != levels || within.size() != levels)
    yaml.fail("mean", "mean, between and within need one value per noise level");
  for (std::size_t i = 0; i < levels; ++i) point.cells.push_back({mean[i], between[i], within[i]});
  return point;
}

std::vector<Quantiles> read_member(const YamlReader& yaml) {
  const std::vector<double> values = yaml.numbers("quantiles", Range::any());
  if (values.empty() || values.size() % kQuantiles != 0)
    yaml.fail("quantiles", "needs " + std::to_string(kQuantiles) + " values per phase");
  std::vector<Quantiles> phases;
  for (auto begin = values.begin(); begin != values.end(); begin += kQuantiles) {
    phases.emplace_back(begin, begin + kQuantiles);
    if (!std::is_sorted(begin, begin + kQuantiles))
      yaml.fail("quantiles", "must not decrease within a phase");
  }
  return phases;
}

ApdFamily read_family(const YamlReader& yaml, std::size_t points, std::size_t levels) {
  ApdFamily family;
  for (const YamlReader& segment : yaml.maps("segments")) {
    FamilySegment s;
    s.floor = segment.number("floor", Range::not_negative());
    s.threshold = segment.numbers("threshold", Range::not_negative());
    s.misfit = segment.numbers("misfit", Range::not_negative());
    if (s.threshold.size() != levels || s.misfit.size() != levels)
      segment.fail("threshold", "threshold and misfit need one value per noise level");
    family.segments.push_back(std::move(s));
  }
  for (const YamlReader& member : yaml.maps("members")) {
    family.members.push_back(read_member(member));
    if (family.members.back().size() != family.members.front().size())
      member.fail("quantiles", "every member needs the same number of phases");
  }
  if (family.members.size() < points)
    yaml.fail("members", "needs one member per point of the curve, or more");
  if (family.segments.size() + 1 != points) yaml.fail("segments", "needs one segment between two points");
  return family;
}

DeclaredSpread::Widening read_widening(const YamlReader& yaml, std::size_t points) {
  DeclaredSpread::Widening w;
  for (const auto& [key, values] : {std::pair{"below", &w.below}, std::pair{"above", &w.above}}) {
    *values = yaml.numbers(key, Range::not_negative());
    if (values->size() != points) yaml.fail(key, "needs one value per point of the curve");
  }
  w.bound = yaml.number("bound", Range::not_negative());
  return w;
}

DeclaredSpread read_spread(const YamlReader& yaml, std::size_t points) {
  DeclaredSpread spread;
  spread.machines = static_cast<int>(yaml.integer("machines", 1, 1'000'000));
  spread.limit = yaml.text("limit");
  spread.skewness = read_widening(yaml.map("apd_skewness"), points);
  spread.shape = read_widening(yaml.map("apd_shape"), points);
  return spread;
}

}  // namespace

std::string MonitoringCurve::to_yaml() const {
  YAML::Emitter out;
  out << YAML::Comment("Monitoring curve: skewness of the class values of the APD against backlash.")
      << YAML::Newline;
  out << YAML::Comment("backlash: total free play along the line of action [m]; half_gap is half of it.");
  out << YAML::BeginMap << YAML::Key << "schema_version" << YAML::Value << kSchema;
  emit_conditions(out, conditions);
  out << YAML::Key << "backlash_to_angle" << YAML::Value << to_text(backlash_to_angle)
      << YAML::Comment("rad at the axis of motor_position per unit of backlash");
  out << YAML::Key << "coverage_factor" << YAML::Value << to_text(coverage_factor)
      << YAML::Comment("standard deviations that hold 95 % of simulated records");
  emit_row(out, "noise_levels", noise_levels);
  out << YAML::Key << "points" << YAML::Value << YAML::BeginSeq;
  for (const CurvePoint& point : points) emit_point(out, *this, point);
  out << YAML::EndSeq;
  if (spread) emit_spread(out, *spread);
  if (family) emit_family(out, *family);
  out << YAML::EndMap << YAML::Newline;
  return out.c_str();
}

MonitoringCurve MonitoringCurve::from_yaml(const YamlReader& yaml) {
  MonitoringCurve curve;
  curve.conditions = read_conditions(yaml.map("conditions"));  // first: a rig file says that it is no curve
  if (yaml.integer("schema_version", 1, kSchema) < kSchema)
    yaml.fail("schema_version", "is that of an earlier version's curve; build_curve draws it anew");
  curve.backlash_to_angle = yaml.number("backlash_to_angle", Range::positive());
  curve.coverage_factor = yaml.number("coverage_factor", Range::positive());
  curve.noise_levels = yaml.numbers("noise_levels", Range::not_negative());
  if (curve.noise_levels.empty()) yaml.fail("noise_levels", "needs at least one level");
  for (std::size_t i = 1; i < curve.noise_levels.size(); ++i)
    if (!(curve.noise_levels[i] > curve.noise_levels[i - 1])) yaml.fail("noise_levels", "must increase");
  const auto& levels = curve.noise_levels;
  if (std::find(levels.begin(), levels.end(), curve.conditions.noise) == levels.end())
    yaml.map("conditions").fail("noise", "must be one of noise_levels");
  for (const YamlReader& point : yaml.maps("points"))
    curve.points.push_back(read_point(point, curve.noise_levels.size()));
  if (curve.points.size() < 2) yaml.fail("points", "a curve needs at least two points");
  for (std::size_t i = 1; i < curve.points.size(); ++i)
    if (!(curve.points[i].backlash > curve.points[i - 1].backlash))
      yaml.fail("points", "backlash must increase");
  if (const auto family = yaml.optional_map("family"))
    curve.family = read_family(*family, curve.points.size(), curve.noise_levels.size());
  if (const auto spread = yaml.optional_map("spread"))
    curve.spread = read_spread(*spread, curve.points.size());
  yaml.finish();
  return curve;
}

MonitoringCurve read_curve(const std::string& path) {
  return MonitoringCurve::from_yaml(YamlReader::from_file(path));
}

void write_curve(const MonitoringCurve& curve, const std::string& path) {
  write_file(path, curve.to_yaml());
}

}  // namespace backlash::diagnosis
