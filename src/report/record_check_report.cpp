// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/record_check_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "json.h"

namespace backlash::report {
namespace {

const char* word_of(record::Consequence consequence) {
  switch (consequence) {
    case record::Consequence::mended:
      return "mended";
    case record::Consequence::cut:
      return "cut";
    case record::Consequence::refused:
      return "refused";
    case record::Consequence::noted:
      break;
  }
  return "noted";
}

Json finding_json(const record::Finding& finding) {
  return {{"kind", record::id_of(finding.kind)},
          {"channel", finding.channel},
          {"from", json_number(finding.from)},
          {"to", json_number(finding.to)},
          {"count", finding.count},
          {"consequence", word_of(finding.consequence)},
          {"message", finding.message}};
}

std::string full_name(const CheckedFile::Joint& joint, const std::string& channel) {
  return joint.name.empty() ? channel : joint.name + "/" + channel;
}

Json channel_json(const record::ChannelState& state, const record::StampState& stamps) {
  return {{"rate", json_number(state.rate)},
          {"lost", stamps.lost},
          {"repeated", stamps.repeated},
          {"held", json_number(state.held)},
          {"resolution", json_number(state.resolution)},
          {"noise", json_number(state.noise)},
          {"range", {json_number(state.low), json_number(state.high)}}};
}

std::string describe(const record::StampState& stamps) {
  std::string text = fmt::format("time: {:.4g} Hz", stamps.interval > 0 ? 1 / stamps.interval : 0);
  if (stamps.jitter >= 0.01) {
    text += fmt::format(", stamps {:.2g} % of an interval uneven", 100 * stamps.jitter);
    if (stamps.of_stamps_only)
      text += stamps.evened ? "; the samples are more even, as the positions show: even stamps are used"
                            : "; the samples are more even, as the positions show";
    if (stamps.unsure > 0)
      text += fmt::format("; when they were taken is known to {:.2g} % of an interval", 100 * stamps.unsure);
  }
  return text + "\n";
}

std::string describe(const std::string& name, const record::ChannelState& state) {
  return fmt::format("{}: {:.4g} Hz, {:.4g} to {:.4g} {}, steps of {:.3g}, noise {:.2g}{}\n", name,
                     state.rate, state.low, state.high, record::channel_unit(state.channel), state.resolution,
                     state.noise, state.held > 0 ? fmt::format(", {:.3g} % held", 100 * state.held) : "");
}

constexpr std::size_t kGroups = 4000;  // choice: several for each pixel of a screen

/// Samples through which a line looks like one through all of them: of each group of neighbours the lowest
/// and the highest, and one without a number where there is one.
std::vector<std::size_t> drawn_samples(const std::vector<double>& x) {
  const std::size_t group = std::max<std::size_t>(1, x.size() / kGroups);
  std::vector<std::size_t> drawn;
  for (std::size_t begin = 0; begin < x.size(); begin += group) {
    const std::size_t end = std::min(begin + group, x.size());
    std::size_t low = begin, high = begin, gap = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isfinite(x[i])) gap = i;
      if (!(x[low] <= x[i])) low = i;
      if (!(x[high] >= x[i])) high = i;
    }
    std::vector<std::size_t> kept = {low, high};
    if (gap < end) kept.push_back(gap);
    std::sort(kept.begin(), kept.end());
    drawn.insert(drawn.end(), kept.begin(), std::unique(kept.begin(), kept.end()));
  }
  return drawn;
}

Json drawn(const std::vector<double>& t, const std::vector<double>& x, record::Channel channel, bool linear) {
  Json time = Json::array(), values = Json::array();
  for (const std::size_t i : drawn_samples(x)) {
    time.push_back(t[i]);
    values.push_back(json_number(x[i]));
  }
  return {
      {"unit", model::axis_unit(record::channel_unit(channel), linear)}, {"time", time}, {"values", values}};
}

Json series_of(const record::Record& record, bool linear) {
  Json channels = Json::object();
  for (const record::Channel channel : record::kChannels)
    if (record.has(channel))
      channels[record::channel_name(channel)] = drawn(record.time, record.column(channel), channel, linear);
  const record::Channel motor = record::Channel::motor_position, load = record::Channel::load_position;
  if (!record.has(motor) || !record.has(load)) return channels;
  std::vector<double> difference = record.column(motor);
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= record.column(load)[i];
  channels["motor - load"] = drawn(record.time, difference, motor, linear);
  return channels;
}

}  // namespace

std::vector<record::Finding> CheckedFile::findings() const {
  std::vector<record::Finding> all;
  for (const Joint& joint : joints)
    for (record::Finding finding : joint.check.findings) {
      const bool of_stamps = finding.channel == "time";
      if (of_stamps && &joint != &joints.front()) continue;
      if (!of_stamps && !joint.name.empty()) {
        const bool named = finding.message.rfind(finding.channel, 0) == 0;
        finding.message = joint.name + (named ? "/" : ": ") + finding.message;
        finding.channel = full_name(joint, finding.channel);
      }
      all.push_back(std::move(finding));
    }
  return all;
}

std::string record_check_json(const CheckedFile& file, const std::vector<Serves>& serves) {
  Json channels = Json::object(), findings = Json::array(), served = Json::object(), usable = Json::array();
  for (const CheckedFile::Joint& joint : file.joints)
    for (const record::ChannelState& state : joint.check.channels)
      channels[full_name(joint, record::channel_name(state.channel))] =
          channel_json(state, joint.check.stamps);
  for (const record::Finding& finding : file.findings()) findings.push_back(finding_json(finding));
  for (const Serves& each : serves) served[each.name] = {{"ok", each.ok}, {"reason", each.reason}};
  Json stamps = nullptr;
  if (!file.joints.empty()) {
    const record::RecordCheck& check = file.joints.front().check;
    stamps = {{"interval", json_number(check.stamps.interval)},
              {"jitter", json_number(check.stamps.jitter)},
              {"samples_even", check.stamps.of_stamps_only},
              {"unsure", json_number(check.stamps.unsure)}};
    for (const record::Stretch& stretch : check.usable)
      usable.push_back({json_number(stretch.from), json_number(stretch.to)});
  }
  return dumped({{"schema_version", 1},
                 {"version", version()},
                 {"record", file.path},
                 {"stamps", stamps},
                 {"channels", channels},
                 {"findings", findings},
                 {"usable", usable},
                 {"serves", served}},
                2);
}

std::string record_check_text(const CheckedFile& file, const std::vector<Serves>& serves) {
  std::string text;
  if (!file.joints.empty()) text += describe(file.joints.front().check.stamps);
  for (const CheckedFile::Joint& joint : file.joints)
    for (const record::ChannelState& state : joint.check.channels)
      text += describe(full_name(joint, record::channel_name(state.channel)), state);
  const std::vector<record::Finding> findings = file.findings();
  text += findings.empty() ? "nothing is wrong with the recording\n" : "found:\n";
  for (const record::Finding& finding : findings)
    text += fmt::format("  {} ({}): {}\n", record::id_of(finding.kind), word_of(finding.consequence),
                        finding.message);
  text += "serves:\n";
  for (const Serves& each : serves)
    text += fmt::format("  {}: {}{}\n", each.name, each.ok ? "yes" : "no",
                        each.reason.empty() ? "" : ", " + each.reason);
  return text;
}

std::string record_check_series(const CheckedFile& file, const std::vector<record::JointRecord>& recorded,
                                bool linear) {
  Json joints = Json::array();
  for (const record::JointRecord& joint : recorded)
    joints.push_back({{"name", joint.joint}, {"channels", series_of(joint.record, linear)}});
  return dumped(
      {{"schema_version", 1}, {"joints", joints}, {"report", Json::parse(record_check_json(file, {}))}}, -1);
}

std::string with_record_check(const std::string& json, const std::vector<CheckedFile>& files) {
  Json findings = Json::array();
  for (const CheckedFile& file : files)
    for (const record::Finding& finding : file.findings()) {
      Json entry = {{"record", file.path}};
      entry.update(finding_json(finding));
      findings.push_back(std::move(entry));
    }
  Json report = Json::parse(json);
  report["record_check"] = {{"findings", findings}};
  return dumped(report, 2);
}

}  // namespace backlash::report
