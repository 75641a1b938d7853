// SPDX-License-Identifier: BSD-3-Clause
// Samples of one joint that come in several streams (an encoder of the motor on one topic, that of the link
// on another) as samples at the stamps of the first stream: values of the others run straight between the two
// neighbours of such a stamp. Knows stamps only, no clock. A stream that is late as a whole stays late: that
// is an encoder_skew, which is estimated from a record.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

struct JoinCounters {
  long joined = 0;
  long alone = 0;     // samples of the first stream left out: another was silent, or had a gap there
  long restarts = 0;  // stamps that went back, in any stream
};

class SampleJoiner {
 public:
  /// `streams` >= 1; a sample of the first waits for the others at most `patience` [s of stamps], > 0.
  explicit SampleJoiner(std::size_t streams, double patience = 1);

  struct Sample {
    double time = 0;  // s
    ChannelValues values;
  };

  /// NaN in `values` where a stream does not have a channel.
  void add(std::size_t stream, const Sample& sample);

  /// The next joined sample, in their order; nothing where the others have not come so far.
  std::optional<Sample> next();

  const JoinCounters& counters() const { return counters_; }

 private:
  struct Stream {
    std::deque<Sample> samples;  // of another one: the last before the oldest that waits, and all since
    double interval = 0;         // s, usual
  };
  enum class Found { yes, wait, never };
  Found interpolate(Stream& stream, double time, ChannelValues& values) const;

  std::vector<Stream> streams_;
  double patience_;
  JoinCounters counters_;
};

/// Records of one joint, with channels of their own and a common time 0, at the times of the first. Its
/// `name` and all warnings are kept; samples that are left out are reported in them. Throws BadData where
/// none is left.
Record joined(const std::vector<Record>& parts);

/// Counts the times of a record from another time 0 [s since 1970].
void set_origin(Record& record, double origin);

/// Records of several joints on one time base: that of the first, where all have a sample on either side.
/// Each says by its `origin` when its time 0 was. Records that have the same times already stay as they are.
/// The first one's warnings say what was left out. Throws BadData where nothing is left.
void share_time_base(std::vector<Record>& joints);

}  // namespace backlash::record
