// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/sample_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash::diagnosis {
namespace {

constexpr double kKeepPeriods = 3;  // at least, whatever `keep` says; a choice: two show noise, one is open
constexpr std::size_t kRecent = 1000;  // samples from which the present rate is estimated; a choice
constexpr double kForever = std::numeric_limits<double>::infinity();  // s

double get(const record::ChannelValues& values, record::Channel channel) {
  return values[static_cast<std::size_t>(channel)];
}

/// A bit for each channel that has a finite value.
unsigned present(const record::ChannelValues& values) {
  unsigned bits = 0;
  for (std::size_t i = 0; i < record::kChannelCount; ++i)
    bits |= static_cast<unsigned>(std::isfinite(values[i])) << i;
  return bits;
}

}  // namespace

SampleStream::SampleStream(const StreamSettings& settings) : settings_(settings) {
  if (!(settings.keep > 0)) throw InvalidParameter("keep", settings.keep, "must be > 0 s");
  restart();
  counters_ = StreamCounters();
}

void SampleStream::restart() {
  ++counters_.restarts;
  stamps_ = record::StampChecker();
  record_ = record::Record();
  channels_.clear();
  analyser_.reset();
  result_count_ = 0;
  grid_.reset();
  dropped_.reset();
  period_ = settings_.apd ? settings_.apd->period : 0;
  next_search_ = kFirstPeriodSearch;
}

double SampleStream::jump_limit() const {
  return settings_.of_record ? kForever : std::max(1.0, 3 * period_);
}

/// Without it there is nothing to diagnose.
record::Channel SampleStream::needed() const {
  return settings_.apd ? settings_.apd->signal : record::Channel::motor_torque;
}

/// A run has the channels of its first sample: every later one must have them, and one that has more begins a
/// new run.
SampleStream::Fit SampleStream::fit(const record::ChannelValues& values) {
  if (!channels_.empty() && present(values) == present_) return Fit::take;
  if (channels_.empty() && !settings_.of_record && !std::isfinite(get(values, needed()))) {
    counters_.last_problem = record::channel_name(needed()) + " is absent or not a number";
    return Fit::drop;
  }
  for (const record::Channel channel : channels_)
    if (!std::isfinite(get(values, channel))) {
      counters_.last_problem = record::channel_name(channel) + " is not a number";
      return Fit::drop;
    }
  if (channels_.empty()) return Fit::begin;
  for (const record::Channel channel : record::kChannels)
    if (std::isfinite(get(values, channel)) &&
        std::find(channels_.begin(), channels_.end(), channel) == channels_.end()) {
      counters_.last_problem = record::channel_name(channel) + " appeared";
      return Fit::restart;
    }
  return Fit::take;
}

/// Whether a channel that the run began with has stopped for good.
bool SampleStream::has_lost_channel(double time, const record::ChannelValues& values) const {
  return !record_.time.empty() && std::isfinite(get(values, needed())) &&
         time - record_.time.back() > jump_limit();
}

/// Whether a stamp continues the run; if not, says why.
SampleStream::Fit SampleStream::fit(double time) {
  const record::StampVerdict verdict = stamps_.next(time);
  if (verdict == record::StampVerdict::repeated) {
    counters_.last_problem = "repeated stamp";
    return Fit::drop;
  }
  if (record_.time.empty()) return Fit::begin;
  const double last = record_.time.back();
  if (verdict == record::StampVerdict::backwards)
    counters_.last_problem =
        "stamps went back from " + record::time_text(last) + " s to " + record::time_text(time) + " s";
  else if (time - last > jump_limit())
    counters_.last_problem = "stamps jumped forward by " + record::time_text(time - last) + " s";
  else
    return Fit::take;
  return Fit::restart;
}

const PeriodResult* SampleStream::add(double time, const record::ChannelValues& values) {
  const Fit channels = fit(values);
  const bool lost = channels == Fit::drop && has_lost_channel(time, values);
  if (channels == Fit::drop && !lost) {
    ++counters_.not_a_number;
    return nullptr;
  }
  const std::string problem = counters_.last_problem;
  const Fit stamp = fit(time);
  if (lost) counters_.last_problem = problem + " any more: a new run without it";
  if (stamp == Fit::drop) {
    ++counters_.repeated;
    return nullptr;
  }
  if (stamp == Fit::restart || channels == Fit::restart) {
    restart();
    stamps_.next(time);
  }
  if (record_.time.empty()) {
    start_ = time;
    for (const record::Channel channel : record::kChannels)
      if (std::isfinite(get(values, channel))) channels_.push_back(channel);
    present_ = present(values);
  }
  ++counters_.accepted;
  record_.time.push_back(time);
  for (const record::Channel channel : channels_) record_.column(channel).push_back(get(values, channel));
  if (!(period_ > 0)) find_period();
  const PeriodResult* finished = nullptr;
  if (!grid_)
    finished = start_windows();
  else if (analyser_)
    finished = analyse(time, get(values, settings_.apd->signal));
  trim();
  return finished && finished->index >= settings_.apd->settling_periods ? finished : nullptr;
}

/// Searched at fixed lengths of the run, so that the outcome does not depend on how the samples arrive.
void SampleStream::find_period() {
  if (record_.time.back() - start_ < next_search_) return;
  next_search_ += next_search_ < settings_.keep ? next_search_ : 0.25 * settings_.keep;
  period_ = excitation_period(record_, needed());
}

/// Keeps what the analyser has finished.
const PeriodResult* SampleStream::analyse(double time, double value) {
  const PeriodResult* finished = analyser_->add(time, value);
  if (!finished) return nullptr;
  if (result_count_ == results_.size())
    results_.push_back(*finished);
  else
    results_[result_count_] = *finished;  // what was forgotten leaves its place in the heap
  ++result_count_;
  return finished;
}

const PeriodResult* SampleStream::start_windows() {
  if (!(period_ > 0)) return nullptr;
  grid_ = window_grid(record_.time, period_);
  dropped_.reset();  // windows count from the first sample kept
  const PeriodResult* finished = nullptr;
  if (!grid_ || !settings_.apd || !record_.has(settings_.apd->signal)) return finished;
  analyser_.emplace(period_, settings_.apd->layout);
  const auto& signal = record_.column(settings_.apd->signal);
  for (std::size_t i = 0; i < record_.size(); ++i) finished = analyse(record_.time[i], signal[i]);
  return finished;
}

void SampleStream::trim() {
  // In large steps, so that the cost per sample stays constant.
  const double keep = std::max(settings_.keep, kKeepPeriods * period_), last = record_.time.back();
  if (last - record_.time.front() < 1.25 * keep) return;
  const auto first = std::lower_bound(record_.time.begin(), record_.time.end(), last - keep);
  dropped_ = *(first - 1);
  record_.forget(static_cast<std::size_t>(first - record_.time.begin()));
  forget_results();
}

void SampleStream::forget_results() {
  const long begin = windows().begin;
  const auto end = results_.begin() + static_cast<std::ptrdiff_t>(result_count_);
  const auto first = std::find_if(results_.begin(), end,
                                  [begin](const PeriodResult& result) { return result.index >= begin; });
  result_count_ -= static_cast<std::size_t>(first - results_.begin());
  std::rotate(results_.begin(), first, results_.end());
}

double SampleStream::sampling_interval() const {
  const std::size_t count = std::min(kRecent, record_.size());
  return record::median_interval(
      {record_.time.end() - static_cast<std::ptrdiff_t>(count), record_.time.end()});
}

SampleStream::Windows SampleStream::windows() const {
  if (!grid_) return {0, 0};
  const long settling = settings_.apd ? settings_.apd->settling_periods : 0;
  const long untrimmed = dropped_ ? grid_->index(*dropped_) + 1 : 0;
  const long end = grid_->completed(record_.time.back());
  return {std::min(end, std::max(settling, untrimmed)), end};
}

long SampleStream::periods() const {
  return windows().end - windows().begin;
}

/// Those of the windows [begin, end). The last window may count as whole while the analyser still waits for a
/// sample that jitter could bring.
std::vector<PeriodResult> SampleStream::results(const Windows& cut) const {
  std::vector<PeriodResult> chosen;
  for (std::size_t i = 0; i < result_count_; ++i)
    if (const long index = results_[i].index; index >= cut.begin && index < cut.end)
      chosen.push_back(results_[i]);
  if (!analyser_ || (result_count_ > 0 && results_[result_count_ - 1].index >= cut.end - 1)) return chosen;
  PeriodAnalyser ended = *analyser_;
  const PeriodResult* last = ended.finish();
  if (last && last->index >= cut.begin && last->index < cut.end) chosen.push_back(*last);
  return chosen;
}

SampleStream::Windows SampleStream::latest_windows(long count) const {
  Windows cut = windows();
  if (count > 0) cut.begin = std::max(cut.begin, cut.end - count);
  return cut;
}

PeriodWindow SampleStream::latest(long count) const& {
  if (!settings_.apd && (count == 0 || !grid_)) return {record_, period_, periods(), {}};
  if (!grid_) return searched_now(count);
  const Windows cut = latest_windows(count);
  return {record_.slice(grid_->start(cut.begin), grid_->start(cut.end)), period_, cut.end - cut.begin,
          results(cut)};
}

PeriodWindow SampleStream::latest(long count) && {
  if (!settings_.apd || !grid_) return latest(count);
  const Windows cut = latest_windows(count);
  std::vector<PeriodResult> whole = results(cut);
  return {std::move(record_).slice(grid_->start(cut.begin), grid_->start(cut.end)), period_,
          cut.end - cut.begin, std::move(whole)};
}

/// A period may show before the next search is due.
PeriodWindow SampleStream::searched_now(long count) const {
  StreamSettings settings = settings_;
  settings.of_record = true;
  settings.keep = kForever;
  settings.apd->period = period_ > 0 ? period_ : excitation_period(record_, settings.apd->signal);
  if (!(settings.apd->period > 0)) return {record_, 0, 0, {}};
  SampleStream again(settings);
  again.add(record_);
  return again.grid_ ? std::move(again).latest(count)
                     : PeriodWindow{record::Record(), settings.apd->period, 0, {}};
}

void SampleStream::add(const record::Record& record) {
  record::ChannelValues values;
  values.fill(kNaN);
  std::vector<record::Channel> there;
  const bool all_stay = settings_.keep == kForever;
  if (all_stay) record_.time.reserve(record.size());
  for (const record::Channel channel : record::kChannels) {
    if (!record.has(channel)) continue;
    there.push_back(channel);
    if (all_stay) record_.column(channel).reserve(record.size());
  }
  for (std::size_t i = 0; i < record.size(); ++i) {
    for (const record::Channel channel : there)
      values[static_cast<std::size_t>(channel)] = record.column(channel)[i];
    add(record.time[i], values);
  }
}

PeriodWindow cut_periods(const record::Record& record, const std::optional<ApdSettings>& apd, long last) {
  StreamSettings settings;
  settings.apd = apd;
  settings.keep = kForever;
  settings.of_record = true;
  SampleStream stream(settings);
  stream.add(record);
  PeriodWindow window = std::move(stream).latest(last);
  window.record.name = record.name;
  window.record.warnings = record.warnings;
  return window;
}

}  // namespace backlash::diagnosis
