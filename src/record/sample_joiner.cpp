// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/sample_joiner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::record {
namespace {

constexpr double kGap = 2.5;     // choice: usual intervals, over which nothing is interpolated
constexpr double kLearn = 0.05;  // choice: of an interval that differs from the usual one
constexpr double kLonger = 2;    // choice: times the usual one, that a gap counts at most

}  // namespace

SampleJoiner::SampleJoiner(std::size_t streams, double patience) : streams_(streams), patience_(patience) {
  if (streams < 1) throw InvalidParameter("streams", double(streams), "must be >= 1");
  if (!(patience > 0)) throw InvalidParameter("patience", patience, "must be > 0 s");
}

void SampleJoiner::add(std::size_t stream, const Sample& sample) {
  Stream& s = streams_.at(stream);
  if (!std::isfinite(sample.time)) throw InvalidParameter("time", sample.time, "must be finite");
  if (!s.samples.empty()) {
    const double interval = sample.time - s.samples.back().time;
    if (interval == 0) return;  // repeated
    if (interval < 0) {
      ++counters_.restarts;
      s.samples.clear();
      s.interval = 0;
    } else if (s.interval == 0) {
      s.interval = interval;
    } else {
      s.interval += kLearn * (std::min(interval, kLonger * s.interval) - s.interval);
    }
  }
  s.samples.push_back(sample);
  if (stream == 0 || streams_.front().samples.empty()) return;
  while (s.samples.size() > 1 && s.samples[1].time <= streams_.front().samples.front().time)
    s.samples.pop_front();
}

SampleJoiner::Found SampleJoiner::interpolate(Stream& stream, double time, ChannelValues& values) const {
  std::deque<Sample>& samples = stream.samples;
  while (samples.size() > 1 && samples[1].time <= time) samples.pop_front();
  if (samples.empty()) return Found::wait;
  const Sample& before = samples.front();
  if (before.time > time) return Found::never;
  if (samples.size() == 1 && before.time < time) return Found::wait;
  const Sample& after = before.time == time ? before : samples[1];
  const double gap = after.time - before.time;
  if (gap > kGap * stream.interval) return Found::never;
  const double part = gap > 0 ? (time - before.time) / gap : 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isnan(values[i])) values[i] = before.values[i] + part * (after.values[i] - before.values[i]);
  return Found::yes;
}

std::optional<SampleJoiner::Sample> SampleJoiner::next() {
  std::deque<Sample>& first = streams_.front().samples;
  while (!first.empty()) {
    Sample sample = first.front();
    Found all = Found::yes;
    for (std::size_t i = 1; i < streams_.size() && all != Found::never; ++i)
      all = std::max(all, interpolate(streams_[i], sample.time, sample.values));
    if (all == Found::wait && first.back().time - sample.time <= patience_) return std::nullopt;
    first.pop_front();
    if (all == Found::yes) {
      ++counters_.joined;
      return sample;
    }
    ++counters_.alone;
  }
  return std::nullopt;
}

namespace {

SampleJoiner::Sample sample_of(const Record& record, std::size_t i) {
  SampleJoiner::Sample sample{record.time[i], {}};
  sample.values.fill(kNaN);
  for (const Channel channel : kChannels)
    if (record.has(channel)) sample.values[static_cast<std::size_t>(channel)] = record.column(channel)[i];
  return sample;
}

}  // namespace

Record joined(const std::vector<Record>& parts) {
  for (const Record& part : parts)
    if (!part.clock_steps.empty())
      throw BadData(part.name,
                    fmt::format("its stamps go back by {:.4g} s at {:.6g} s: of several topics with a "
                                "clock that was set the times in common are not known",
                                part.clock_steps.front().back, part.clock_steps.front().time));
  SampleJoiner joiner(parts.size());
  Record all;
  all.name = parts.front().name;
  std::vector<std::size_t> place(parts.size(), 0);
  const auto take = [&] {
    while (const auto sample = joiner.next()) {
      all.time.push_back(sample->time);
      for (const Record& part : parts)
        for (const Channel channel : kChannels)
          if (part.has(channel))
            all.column(channel).push_back(sample->values[static_cast<std::size_t>(channel)]);
    }
  };
  for (;;) {
    std::size_t earliest = parts.size();
    for (std::size_t p = 0; p < parts.size(); ++p)
      if (place[p] < parts[p].size() &&
          (earliest == parts.size() || parts[p].time[place[p]] < parts[earliest].time[place[earliest]]))
        earliest = p;
    if (earliest == parts.size()) break;
    joiner.add(earliest, sample_of(parts[earliest], place[earliest]++));
    take();
  }
  for (const Record& part : parts)
    all.warnings.insert(all.warnings.end(), part.warnings.begin(), part.warnings.end());
  const auto left_out = parts.front().size() - all.size();
  if (all.size() == 0) throw BadData(all.name, "its topics have no time in common");
  if (left_out > 0)
    all.warnings.push_back(fmt::format("{} of {} samples left out, as another topic was silent there",
                                       left_out, parts.front().size()));
  return all;
}

void set_origin(Record& record, double origin) {
  const double later = record.origin - origin;
  if (later != 0)
    for (double& time : record.time) time += later;
  record.first_repeated_stamp += later;
  for (ClockStep& step : record.clock_steps) step.time += later;
  record.origin = origin;
}

void share_time_base(std::vector<Record>& joints) {
  if (joints.empty()) return;
  const double origin = joints.front().origin;
  Record base;
  base.name = joints.front().name;
  base.time = joints.front().time;
  std::vector<double> common = base.time;
  for (Record& joint : joints) {
    set_origin(joint, origin);
    if (joint.time == base.time) continue;
    Record here = joint;
    here.warnings.clear();
    const std::vector<std::string> warnings = std::move(joint.warnings);
    joint = joined({base, here});
    joint.warnings = warnings;
    joint.origin = origin;
    std::vector<double> both;
    std::set_intersection(common.begin(), common.end(), joint.time.begin(), joint.time.end(),
                          std::back_inserter(both));
    common = std::move(both);
  }
  if (common.empty()) throw BadData(base.name, "its joints have no time in common");
  if (common.size() == base.size()) return;
  for (Record& joint : joints) {
    std::vector<std::string> warnings = std::move(joint.warnings);
    joint = samples_at(joint, common);
    joint.origin = origin;
    joint.warnings = std::move(warnings);
  }
  joints.front().warnings.push_back(
      fmt::format("{} of {} samples ({:.3g} s) left out, as the messages of other joints begin later, end "
                  "earlier or have a gap there",
                  base.size() - common.size(), base.size(),
                  double(base.size() - common.size()) * base.sampling_interval()));
}

}  // namespace backlash::record
