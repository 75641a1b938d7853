// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/record_check_report.h"

#include <fmt/format.h>

#include "backlash_diagnosis/base/version.h"
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
      text += stamps.evened ? "; the samples are even, as the positions show: even stamps are used"
                            : "; the samples are even, as the positions show";
  }
  return text + "\n";
}

std::string describe(const std::string& name, const record::ChannelState& state) {
  return fmt::format("{}: {:.4g} Hz, {:.4g} to {:.4g} {}, steps of {:.3g}, noise {:.2g}{}\n", name,
                     state.rate, state.low, state.high, record::channel_unit(state.channel), state.resolution,
                     state.noise, state.held > 0 ? fmt::format(", {:.3g} % held", 100 * state.held) : "");
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
              {"samples_even", check.stamps.of_stamps_only}};
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
