// SPDX-License-Identifier: BSD-3-Clause
// The parts of check_record: each looks at one thing, says what it found and mends what it may.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/record_check.h"

namespace backlash::record {

/// What the parts share.
struct RecordLook {
  Record& record;
  const DeclaredMotion& declared;
  RecordCheck& out;
  double interval = 0;          // s, median
  std::vector<Stretch> cuts{};  // what no estimate may use; of no length: may not reach across

  void say(FindingKind kind, const std::string& channel, double from, double to, std::size_t count,
           Consequence consequence, std::string message) const {
    out.findings.push_back({kind, channel, from, to, count, std::move(message), consequence});
  }
};

bool all_finite(const std::vector<double>& x);

/// "3 samples", "1 sample"
std::string counted(std::size_t count, const std::string& noun);

bool is_torque(Channel channel);

constexpr std::array<Channel, 2> kEncoders = {Channel::motor_position, Channel::load_position};

/// Lost samples, repeated stamps, steps of the clock.
void check_stamps(RecordLook& look);

/// Makes stamps even where they alone jitter: after all that would look like late samples is gone or cut.
void check_jitter(RecordLook& look);

/// Samples of two sources in turn; positions that were taken modulo a turn, which are unwrapped.
void check_turns(RecordLook& look);

/// Single samples of a position that are off by far and back at once, and of a torque that the motor does not
/// feel: they count as lost.
void check_wild(RecordLook& look);

/// Steps of positions that no speed makes.
void check_steps(RecordLook& look);

/// Samples from `begin` to before `end` stand still `while_what`: said once, and cut.
void cut_frozen(RecordLook& look, Channel channel, std::size_t begin, std::size_t end,
                const std::string& while_what);
constexpr std::size_t kLongRun = 20;  // choice: samples of one value

/// Channels without numbers, with one value throughout, or that repeat another channel.
void check_dead(RecordLook& look);

/// Stretches in which a channel stands still while what it measures moves; sets `held` and `rate`.
void check_repeats(RecordLook& look);

/// Signs, units and columns in each other's place.
void check_sense(RecordLook& look);

}  // namespace backlash::record
