// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/record_check.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "check_parts.h"

namespace backlash::record {
namespace {

/// What lies between the cuts.
std::vector<Stretch> between(const Record& record, std::vector<Stretch> cuts) {
  std::sort(cuts.begin(), cuts.end(), [](const Stretch& a, const Stretch& b) { return a.from < b.from; });
  std::vector<Stretch> usable;
  double from = record.time.front();
  for (const Stretch& cut : cuts) {
    if (cut.from > from) usable.push_back({from, cut.from});
    from = std::max(from, cut.to);
  }
  if (from <= record.time.back()) usable.push_back({from, std::nextafter(record.time.back(), INFINITY)});
  return usable;
}

}  // namespace

bool all_finite(const std::vector<double>& x) {
  return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

const std::string& id_of(FindingKind kind) {
  static const std::array<std::string, 14> ids = {
      "lost_samples", "repeated_stamps", "clock_step", "held_samples", "frozen", "dead",  "wrapped",
      "jump",         "drift",           "not_finite", "swapped",      "sign",   "scale", "two_publishers"};
  return ids.at(static_cast<std::size_t>(kind));
}

const Finding* RecordCheck::refusal() const {
  const auto found = std::find_if(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.consequence == Consequence::refused;
  });
  return found == findings.end() ? nullptr : &*found;
}

CheckedRecord check_record(Record record, const DeclaredMotion& declared) {
  CheckedRecord checked{std::move(record), {}};
  Record& r = checked.record;
  for (const Channel channel : kChannels)
    if (r.has(channel) && r.column(channel).size() != r.size())
      throw BadData(r.name, channel_name(channel) + " has " + std::to_string(r.column(channel).size()) +
                                " values, time has " + std::to_string(r.size()));
  if (r.size() < kFewestToCheck) {
    if (r.size() > 0) checked.check.usable = between(r, {});
    return checked;
  }
  RecordLook look{r, declared, checked.check, r.sampling_interval(), {}};
  check_stamps(look);
  check_dead(look);
  if (checked.check.refusal() == nullptr) check_wild(look);
  if (checked.check.refusal() == nullptr) check_turns(look);
  if (checked.check.refusal() == nullptr) check_steps(look);
  check_jitter(look);
  check_repeats(look);
  checked.check.usable = between(r, look.cuts);
  if (checked.check.refusal() == nullptr && !checked.check.usable.empty()) check_sense(look);
  std::stable_sort(checked.check.findings.begin(), checked.check.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.kind < b.kind; });
  return checked;
}

Stretch longest_stretch(const RecordCheck& check) {
  const auto longest =
      std::max_element(check.usable.begin(), check.usable.end(),
                       [](const Stretch& a, const Stretch& b) { return a.duration() < b.duration(); });
  return longest == check.usable.end() ? Stretch{} : *longest;
}

Record without_jumps(Record record, const std::vector<Jump>& jumps) {
  for (const Jump& jump : jumps) {
    std::vector<double>& x = record.column(jump.channel);
    for (std::size_t i = 0; i < x.size(); ++i)
      if (record.time[i] >= jump.after) x[i] -= jump.size.value;
  }
  return record;
}

}  // namespace backlash::record
