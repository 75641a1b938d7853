// SPDX-License-Identifier: BSD-3-Clause
// The newest samples of one joint as they arrive, for who looks at them again and again. Knows stamps only,
// no clock: replayed at any rate it keeps the same.
//
// A rest or a gap is kept as it is. Where the clock goes back, or jumps further than a gap may be, all that
// was kept is forgotten: no stretch of a record ever holds two runs of a clock.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

struct RingSettings {
  std::vector<Channel> channels;  // that are kept; a sample without one of them is left out
  double window = 300;            // s that are kept, > 0
  double longest_gap = 600;       // s, of a stamp after the one before; more begins a new run
  double late = 1;                // s that a stamp may be too old without being another run
};

struct RingCounters {
  long taken = 0;
  long not_a_number = 0;  // a channel that is kept is missing or not finite
  long repeated = 0;      // the stamp of the one before
  long late = 0;          // out of order
  long restarts = 0;      // runs that ended by a jump of the clock
  std::string last_jump;  // of the clock, in words
};

class SampleRing {
 public:
  explicit SampleRing(RingSettings settings);

  /// False where the sample is left out. Throws InvalidParameter for a stamp that is not finite.
  bool add(double time, const ChannelValues& values);

  /// Keeps more or less from the next sample on.
  void set_window(double window) { settings_.window = window; }
  void clear();

  bool empty() const { return record_.time.empty(); }
  double begin() const { return record_.time.front(); }  ///< s; not where it is empty
  double end() const { return record_.time.back(); }
  double length() const { return empty() ? 0 : end() - begin(); }
  /// A copy of what is kept.
  Record kept() const { return record_.slice(begin(), end() + 1); }
  const RingCounters& counters() const { return counters_; }

 private:
  void forget();

  RingSettings settings_;
  Record record_;
  RingCounters counters_;
};

}  // namespace backlash::record
