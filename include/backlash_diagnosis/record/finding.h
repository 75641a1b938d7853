// SPDX-License-Identifier: BSD-3-Clause
// What a record shows by itself to be wrong with it, before anything is estimated.
#pragma once

#include <cstddef>
#include <string>

namespace backlash::record {

enum class FindingKind {
  lost_samples,     // stamps are missing that the others lead one to expect
  repeated_stamps,  // the same stamp twice
  clock_step,       // the clock jumped: the stamps pass time that the motion does not, or the reverse
  held_samples,     // values repeat from sample to sample although what they measure moves
  frozen,           // one value for a long time although what it measures moves
  dead,             // one value throughout, or the values of another channel
  wrapped,          // a position that was taken modulo a turn
  jump,             // a step of a position that no speed makes
  drift,            // the two positions come apart slowly
  not_finite,       // no number
  swapped,          // two columns in each other's place
  sign,             // counts the other way
  scale,            // other units than the record says
  two_publishers,   // samples of two sources in turn
};

/// "lost_samples"
const std::string& id_of(FindingKind kind);

/// What follows for whoever uses the record.
enum class Consequence {
  noted,    // nothing: it is only said
  mended,   // mended() takes it out
  cut,      // no estimate may reach across it, or use what lies within
  refused,  // nothing may be estimated
};

struct Finding {
  FindingKind kind = FindingKind::lost_samples;
  std::string channel;      // "motor_position", of an arm "JOINT/motor_position"; "time" for stamps
  double from = 0, to = 0;  // s: the first and the last place
  std::size_t count = 1;    // of them
  std::string message;      // what was seen, what it means, what to do
  Consequence consequence = Consequence::noted;
};

}  // namespace backlash::record
