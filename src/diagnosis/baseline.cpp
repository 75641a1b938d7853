// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/baseline.h"

#include <yaml-cpp/yaml.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::diagnosis {
namespace {

constexpr int kSchema = 1;

void emit(YAML::Emitter& out, const char* value_key, const char* interval_key, double value, double lower,
          double upper, const char* unit) {
  if (std::isnan(value)) return;
  out << YAML::Key << value_key << YAML::Value << to_text(value) << YAML::Comment(unit);
  out << YAML::Key << interval_key << YAML::Value << YAML::Flow << YAML::BeginSeq << to_text(lower)
      << to_text(upper) << YAML::EndSeq;
}

void read(const YamlReader& yaml, const char* value_key, const char* interval_key, double& value,
          double& lower, double& upper) {
  value = yaml.number(value_key, Range::any());
  const std::vector<double> interval = yaml.numbers(interval_key, Range::any());
  if (interval.size() != 2) yaml.fail(interval_key, "must be two numbers");
  lower = interval[0];
  upper = interval[1];
  if (!(lower <= value && value <= upper)) yaml.fail(interval_key, std::string("must hold ") + value_key);
}

}  // namespace

Baseline baseline_of(const Diagnosis& diagnosis, const std::string& rig, const std::string& rig_digest) {
  const Verdict& verdict = diagnosis.verdict;
  if (!verdict.dissenters.empty())
    throw BadData(rig, "no baseline, the estimates contradict each other: " + verdict.message);
  // An open or missing interval does not say how sure the baseline is.
  if (!std::isfinite(verdict.backlash_angle) || !std::isfinite(verdict.angle_lower) ||
      !std::isfinite(verdict.angle_upper))
    throw BadData(rig, "no baseline, there is no value with an interval: " + verdict.message);
  Baseline baseline;
  baseline.rig = rig;
  baseline.rig_digest = rig_digest;
  for (const int i : verdict.members)
    if (diagnosis.estimates[i].status == Status::ok)
      baseline.methods.push_back(diagnosis.estimates[i].method);
  baseline.backlash = verdict.backlash;
  baseline.lower = verdict.lower;
  baseline.upper = verdict.upper;
  baseline.backlash_angle = verdict.backlash_angle;
  baseline.angle_lower = verdict.angle_lower;
  baseline.angle_upper = verdict.angle_upper;
  if (diagnosis.apd) baseline.skewness = diagnosis.apd->skewness;
  return baseline;
}

std::string to_yaml(const Baseline& b) {
  YAML::Emitter out;
  out << YAML::Comment("Baseline: the healthy machine, from which growth of the backlash is counted.")
      << YAML::Newline;
  out << YAML::BeginMap << YAML::Key << "schema_version" << YAML::Value << kSchema;
  out << YAML::Key << "rig" << YAML::Value << YAML::DoubleQuoted << b.rig;
  out << YAML::Key << "rig_digest" << YAML::Value << YAML::DoubleQuoted << b.rig_digest;
  out << YAML::Key << "methods" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& method : b.methods) out << YAML::DoubleQuoted << method;
  out << YAML::EndSeq;
  emit(out, "backlash", "interval", b.backlash, b.lower, b.upper,
       "m, total free play along the line of action");
  emit(out, "backlash_angle", "angle_interval", b.backlash_angle, b.angle_lower, b.angle_upper,
       "rad, the same on the axis of motor_position");
  if (!std::isnan(b.skewness))
    out << YAML::Key << "skewness" << YAML::Value << to_text(b.skewness)
        << YAML::Comment("of the class values of the APD");
  out << YAML::EndMap << YAML::Newline;
  return out.c_str();
}

Baseline baseline_from_yaml(const YamlReader& yaml) {
  Baseline b;
  yaml.integer("schema_version", kSchema, kSchema);
  b.rig = yaml.text("rig");
  b.rig_digest = yaml.text("rig_digest");
  b.methods = yaml.texts("methods");
  if (b.methods.empty()) yaml.fail("methods", "needs at least one method");
  if (yaml.has("backlash") || yaml.has("interval"))
    read(yaml, "backlash", "interval", b.backlash, b.lower, b.upper);
  read(yaml, "backlash_angle", "angle_interval", b.backlash_angle, b.angle_lower, b.angle_upper);
  if (yaml.has("skewness")) b.skewness = yaml.number("skewness", Range::any());
  yaml.finish();
  return b;
}

Baseline read_baseline(const std::string& path) {
  return baseline_from_yaml(YamlReader::from_file(path));
}

void write_baseline(const Baseline& baseline, const std::string& path) {
  write_file(path, to_yaml(baseline));
}

std::string check_baseline(const Baseline& baseline, const std::string& rig, const std::string& rig_digest,
                           const std::string& source) {
  if (baseline.rig != rig)
    throw BadData(source, "the baseline is of the rig '" + printable(baseline.rig) + "', not of '" +
                              printable(rig) + "'");
  if (baseline.rig_digest == rig_digest) return {};
  return "the baseline " + printable(source, 4096) + " was taken with another version of the rig file";
}

}  // namespace backlash::diagnosis
