#include "backlash_diagnosis/diagnosis/sample_stream.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

constexpr double kFirstSearch = 0.25;  // s of samples before the first search for a period, then twice as long each time

double get(const ChannelValues& values, Channel channel) { return values[static_cast<std::size_t>(channel)]; }

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
  period_ = settings_.apd ? settings_.apd->period : 0;
  interval_ = origin_ = 0;
  next_search_ = kFirstSearch;
}

double SampleStream::jump_limit() const { return std::max(1.0, 3 * period_); }

/// The first sample of a run tells which channels there are; every later one must have them.
bool SampleStream::acceptable(const ChannelValues& values) {
  const Channel needed = settings_.apd ? settings_.apd->signal : Channel::motor_torque;
  if (channels_.empty()) {
    if (std::isnan(get(values, needed))) {
      counters_.last_problem = channel_name(needed) + " is absent or not a number";
      return false;
    }
    for (Channel channel : kChannels)
      if (!std::isnan(get(values, channel))) channels_.push_back(channel);
    return true;
  }
  for (Channel channel : channels_)
    if (std::isnan(get(values, channel))) {
      counters_.last_problem = channel_name(channel) + " is not a number";
      return false;
    }
  return true;
}

const PeriodResult* SampleStream::add(double time, const ChannelValues& values) {
  if (!acceptable(values)) {
    ++counters_.not_a_number;
    return nullptr;
  }
  StampVerdict verdict = stamps_.next(time);
  if (verdict == StampVerdict::repeated) {
    ++counters_.repeated;
    counters_.last_problem = "repeated stamp";
    return nullptr;
  }
  const bool jumped = !record_.time.empty() && time - record_.time.back() > jump_limit();
  if (verdict == StampVerdict::backwards || jumped) {
    counters_.last_problem = jumped ? "stamps jumped forward by " + time_text(time - record_.time.back()) + " s"
                                    : "stamps went back from " + time_text(record_.time.back()) + " s to " +
                                          time_text(time) + " s";
    restart();
    acceptable(values);
    stamps_.next(time);
  }
  ++counters_.accepted;
  record_.time.push_back(time);
  for (Channel channel : channels_) record_.column(channel).push_back(get(values, channel));
  if (record_.size() == 2) {
    interval_ = record_.time[1] - record_.time[0];
    origin_ = record_.time[0] - 0.5 * interval_;
    if (period_ > 0) start_windows();
    return nullptr;
  }
  if (!(period_ > 0)) {
    find_period();
    return nullptr;
  }
  trim();
  if (!analyser_) return nullptr;
  const PeriodResult* period = analyser_->add(time, get(values, settings_.apd->signal));
  return period && period->index >= settings_.apd->settling_periods ? period : nullptr;
}

/// Searched at fixed lengths of the run, so that the outcome does not depend on how the samples arrive.
void SampleStream::find_period() {
  if (record_.time.back() - record_.time.front() < next_search_) return;
  next_search_ *= 2;
  period_ = excitation_period(record_, settings_.apd ? settings_.apd->signal : Channel::motor_torque);
  if (period_ > 0) start_windows();
  trim();
}

void SampleStream::start_windows() {
  if (!settings_.apd) return;
  analyser_.emplace(period_, settings_.apd->layout);
  const auto& signal = record_.column(settings_.apd->signal);
  for (std::size_t i = 0; i < record_.size(); ++i) analyser_->add(record_.time[i], signal[i]);
}

void SampleStream::trim() {
  // In large steps, so that the cost per sample stays constant.
  if (record_.time.back() - record_.time.front() < 1.25 * settings_.keep) return;
  record_ = record_.slice(record_.time.back() - settings_.keep, record_.time.back() + interval_);
}

long SampleStream::completed_windows() const {
  if (!(period_ > 0) || record_.size() < 2) return 0;
  return static_cast<long>(std::floor((record_.time.back() + interval_ - origin_) / period_));
}

long SampleStream::periods() const {
  if (!(period_ > 0) || record_.size() < 2) return 0;
  const long settling = settings_.apd ? settings_.apd->settling_periods : 0;
  const auto first_kept = static_cast<long>(std::ceil((record_.time.front() - 0.75 * interval_ - origin_) / period_));
  return std::max(0L, completed_windows() - std::max(settling, first_kept));
}

Record SampleStream::latest(long count) const {
  const bool uncut = !settings_.apd && count == 0;  // nothing that needs whole periods
  if (uncut || !(period_ > 0) || record_.size() < 2) return record_;
  const long available = periods();
  const long wanted = count > 0 ? std::min(count, available) : available;
  const double end = origin_ + completed_windows() * period_;
  return record_.slice(end - wanted * period_, end);
}

}  // namespace backlash
