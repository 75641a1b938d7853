// SPDX-License-Identifier: BSD-3-Clause
// What was measured: time series with a common time base, as columns. SI units, rotary (N m, rad) or, for a
// linear axis, force and length (N, m).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace backlash::record {

/// The channels a record may have. `motor_*` and `sensor_torque` are seen from the load side of the reduction
/// (angle divided by the ratio, torque multiplied by it) unless the rig file says `motor_side: true`.
enum class Channel {
  motor_torque,  // N m, torque that the motor applies (a current in A is allowed where the rig file says so)
  motor_position,      // rad
  motor_velocity,      // rad/s
  load_position,       // rad
  load_velocity,       // rad/s
  sensor_torque,       // N m, torque in the input coupling
  reference_position,  // rad
  motor_current,       // A, of the motor
  acceleration,   // rad/s^2 (linear axis: m/s^2), of the load gear or whatever part carries the accelerometer
  output_torque,  // N m, in the output coupling, behind the gear; > 0 drives the load forward; never
                  // motor-side
};
constexpr std::size_t kChannelCount = 10;
extern const std::array<Channel, kChannelCount> kChannels;

/// Column name of a channel in a CSV, the same as its enumerator.
const std::string& channel_name(Channel channel);

/// Unit of a channel on a rotary axis, for messages.
const char* channel_unit(Channel channel);

/// Inverse of channel_name; throws InvalidParameter for a name that is no channel.
Channel channel_from_name(const std::string& name);

/// The channels in which backlash can be seen: a record needs at least one of them.
extern const std::array<Channel, 8> kBacklashChannels;

/// One sample of all channels; NaN where there is none.
using ChannelValues = std::array<double, kChannelCount>;

/// from <= time < to, s
struct Stretch {
  double from = 0, to = 0;
  double duration() const { return to - from; }
};

/// Where the stamps of a file went back; times count on from there, after a gap.
struct ClockStep {
  double time = 0, back = 0;  ///< s, of the first sample after it, and by how much
};

/// A record: `time` in seconds, strictly increasing, and one column of the same length per channel present.
class Record {
 public:
  std::string name;                   ///< where it came from: file name or topic, for messages
  std::vector<double> time;           ///< s
  std::vector<std::string> warnings;  ///< what the reader saw and mended: repeated stamps dropped, gaps
  double origin = 0;                  ///< s since 1970 of time 0; 0 where `time` is as in the file
  std::size_t repeated_stamps = 0;    ///< samples that the reader dropped, as their stamp was that before
  double first_repeated_stamp = 0;    ///< s, valid where repeated_stamps > 0
  std::vector<ClockStep> clock_steps;
  /// s, standard deviation of when the samples were taken about `time`; NaN: nobody looked
  /// (record/even_grid.h).
  double unsure_time = std::numeric_limits<double>::quiet_NaN();

  /// s, where the recording began of which this is a slice; NaN: it is whole.
  double whole_from = std::numeric_limits<double>::quiet_NaN();

  std::size_t size() const { return time.size(); }

  /// s, from the beginning of the recording to the first sample.
  double start() const { return std::isnan(whole_from) || time.empty() ? 0 : time.front() - whole_from; }

  bool has(Channel channel) const { return !column(channel).empty(); }

  /// Values of a channel; empty when the record does not have it.
  const std::vector<double>& column(Channel channel) const {
    return columns_[static_cast<std::size_t>(channel)];
  }
  std::vector<double>& column(Channel channel) { return columns_[static_cast<std::size_t>(channel)]; }

  /// Whether it has one of kBacklashChannels.
  bool can_show_backlash() const;

  /// Median distance between samples [s]; 0 with fewer than two samples.
  double sampling_interval() const;

  /// Drops the first `count` samples, in place.
  void forget(std::size_t count);

  /// Samples with from <= time < to.
  Record slice(double from, double to) const&;
  Record slice(double from, double to) &&;  ///< the same without a copy

 private:
  std::pair<std::ptrdiff_t, std::ptrdiff_t> places(double from,
                                                   double to) const;  // first, one after the last

  std::array<std::vector<double>, kChannelCount> columns_;
};

/// The samples of these times [s], which must all be there, in order.
Record samples_at(const Record& record, const std::vector<double>& times);

}  // namespace backlash::record
