// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/sample_stream.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

constexpr double kKeepPeriods = 3;  // at least, whatever `keep` says

constexpr std::size_t kRecent = 1000;  // samples from which the present rate is told

double get(const ChannelValues& values, Channel channel) {
  return values[static_cast<std::size_t>(channel)];
}

/// A bit for each channel that has a finite value.
unsigned present(const ChannelValues& values) {
  unsigned bits = 0;
  for (std::size_t i = 0; i < kChannelCount; ++i)
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
  stamps_ = StampChecker();
  record_ = Record();
  channels_.clear();
  analyser_.reset();
  grid_.reset();
  dropped_.reset();
  period_ = settings_.apd ? settings_.apd->period : 0;
  next_search_ = kFirstPeriodSearch;
}

double SampleStream::jump_limit() const {
  return std::max(1.0, 3 * period_);
}

/// Without it there is nothing to diagnose.
Channel SampleStream::needed() const {
  return settings_.apd ? settings_.apd->signal : Channel::motor_torque;
}

/// A run has the channels of its first sample: every later one must have them, and one that has more begins a
/// new run.
SampleStream::Fit SampleStream::fit(const ChannelValues& values) {
  if (!channels_.empty() && present(values) == present_) return Fit::take;
  if (channels_.empty() && !std::isfinite(get(values, needed()))) {
    counters_.last_problem = channel_name(needed()) + " is absent or not a number";
    return Fit::drop;
  }
  for (const Channel channel : channels_)
    if (!std::isfinite(get(values, channel))) {
      counters_.last_problem = channel_name(channel) + " is not a number";
      return Fit::drop;
    }
  if (channels_.empty()) return Fit::begin;
  for (const Channel channel : kChannels)
    if (std::isfinite(get(values, channel)) &&
        std::find(channels_.begin(), channels_.end(), channel) == channels_.end()) {
      counters_.last_problem = channel_name(channel) + " appeared";
      return Fit::restart;
    }
  return Fit::take;
}

/// Whether the run waits in vain for a channel that only its beginning had.
bool SampleStream::has_lost_channel(double time, const ChannelValues& values) const {
  return !record_.time.empty() && std::isfinite(get(values, needed())) &&
         time - record_.time.back() > jump_limit();
}

/// Whether a stamp continues the run; if not, says why.
SampleStream::Fit SampleStream::fit(double time) {
  const StampVerdict verdict = stamps_.next(time);
  if (verdict == StampVerdict::repeated) {
    counters_.last_problem = "repeated stamp";
    return Fit::drop;
  }
  if (record_.time.empty()) return Fit::begin;
  const double last = record_.time.back();
  if (verdict == StampVerdict::backwards)
    counters_.last_problem = "stamps went back from " + time_text(last) + " s to " + time_text(time) + " s";
  else if (time - last > jump_limit())
    counters_.last_problem = "stamps jumped forward by " + time_text(time - last) + " s";
  else
    return Fit::take;
  return Fit::restart;
}

const PeriodResult* SampleStream::add(double time, const ChannelValues& values) {
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
    for (const Channel channel : kChannels)
      if (std::isfinite(get(values, channel))) channels_.push_back(channel);
    present_ = present(values);
  }
  ++counters_.accepted;
  record_.time.push_back(time);
  for (const Channel channel : channels_) record_.column(channel).push_back(get(values, channel));
  if (!(period_ > 0)) find_period();
  const PeriodResult* finished = nullptr;
  if (!grid_)
    finished = start_windows();
  else if (analyser_)
    finished = analyser_->add(time, get(values, settings_.apd->signal));
  trim();
  return finished && finished->index >= settings_.apd->settling_periods ? finished : nullptr;
}

/// Searched at fixed lengths of the run, so that the outcome does not depend on how the samples arrive.
void SampleStream::find_period() {
  if (record_.time.back() - start_ < next_search_) return;
  next_search_ += next_search_ < settings_.keep ? next_search_ : 0.25 * settings_.keep;
  period_ = excitation_period(record_, settings_.apd ? settings_.apd->signal : Channel::motor_torque);
}

const PeriodResult* SampleStream::start_windows() {
  if (!(period_ > 0)) return nullptr;
  grid_ = window_grid(record_.time, period_);
  dropped_.reset();  // windows count from the first sample kept
  const PeriodResult* finished = nullptr;
  if (!grid_ || !settings_.apd) return finished;
  analyser_.emplace(period_, settings_.apd->layout);
  const auto& signal = record_.column(settings_.apd->signal);
  for (std::size_t i = 0; i < record_.size(); ++i) finished = analyser_->add(record_.time[i], signal[i]);
  return finished;
}

void SampleStream::trim() {
  // In large steps, so that the cost per sample stays constant.
  const double keep = std::max(settings_.keep, kKeepPeriods * period_), last = record_.time.back();
  if (last - record_.time.front() < 1.25 * keep) return;
  const auto first = std::lower_bound(record_.time.begin(), record_.time.end(), last - keep);
  dropped_ = *(first - 1);
  record_.forget(static_cast<std::size_t>(first - record_.time.begin()));
}

double SampleStream::sampling_interval() const {
  const std::size_t count = std::min(kRecent, record_.size());
  return median_interval({record_.time.end() - static_cast<std::ptrdiff_t>(count), record_.time.end()});
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

Record SampleStream::latest(long count) const {
  if (!settings_.apd && (count == 0 || !grid_)) return record_;  // nothing that needs whole periods
  if (!grid_) {
    if (!(run_period(record_, *settings_.apd) > 0)) return record_;
    return whole_periods(record_, *settings_.apd, count)
        .value_or(Record());  // found sooner than at the next search
  }
  Windows cut = windows();
  if (count > 0) cut.begin = std::max(cut.begin, cut.end - count);
  return record_.slice(grid_->start(cut.begin), grid_->start(cut.end));
}

}  // namespace backlash
