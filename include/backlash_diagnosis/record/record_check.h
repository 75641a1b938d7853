// SPDX-License-Identifier: BSD-3-Clause
// The one look at a recording before it is used, by commands and live nodes alike: what every channel is, and
// what is wrong with it. A few passes over the samples.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/record/declared_motion.h"
#include "backlash_diagnosis/record/finding.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::record {

/// What a channel is.
struct ChannelState {
  Channel channel = Channel::motor_position;
  double rate = 0;           // Hz, of new values: the sampling rate less the share that is held
  double held = 0;           // share of the samples that repeat the value before although the signal moves
  double resolution = 0;     // unit of the channel; 0: no step stands out
  double noise = 0;          // the same, standard deviation of what is white in it
  double low = 0, high = 0;  // its range
};

/// What the stamps are.
struct StampState {
  double interval = 0;          // s, median
  std::size_t lost = 0;         // samples
  std::size_t repeated = 0;     // samples, dropped by the reader
  double jitter = 0;            // standard deviation of the intervals over their median
  bool of_stamps_only = false;  // the samples are more even than the stamps, as the positions show
  bool evened = false;          // the record has their times in place of the stamps
  double unsure = 0;            // intervals, standard deviation of what is unknown of these
};

/// A step of a position, between two samples.
struct Jump {
  Channel channel = Channel::motor_position;
  double before = 0, after = 0;  // s, of the samples on either side
  signal::Measured size;         // rad
};

struct RecordCheck {
  StampState stamps;
  std::vector<ChannelState> channels;  // of those that the record has, in their order
  std::vector<Finding> findings;       // in the order of the kinds
  std::vector<Jump> jumps;
  std::vector<Stretch> usable;  // stretches without what cuts, in order; the whole record where nothing does

  /// The first that refuses the record; null: none.
  const Finding* refusal() const;
};

struct CheckedRecord {
  Record record;  // with wrapped positions unwrapped, rows of wild samples lost and even stamps where only
                  // the stamps jitter
  RecordCheck check;
};

/// Looks at a record and mends what can be. A record of fewer than kFewestToCheck samples is not looked at.
/// Throws BadData where a column is not as long as `time`.
CheckedRecord check_record(Record record, const DeclaredMotion& declared = {});
constexpr std::size_t kFewestToCheck = 64;

/// The longest usable stretch.
Stretch longest_stretch(const RecordCheck& check);

/// The record without the steps in `jumps`: the position goes on as if there had been none.
Record without_jumps(Record record, const std::vector<Jump>& jumps);

}  // namespace backlash::record
