// SPDX-License-Identifier: BSD-3-Clause
// The changes of a joint, each reported once. Looks at overlapping stretches of its record find the same
// change several times, more or less precisely, and no look sees a change that began before its stretch. The
// ledger knows stretches and findings, not how they were found.
//
// How often a healthy joint is called changed. A look at `length` seconds finds something by chance with the
// probability rate * length. Looks each `interval` seconds therefore get the rate of rate_of_look(), so that
// the sum over all looks is the wanted rate, however much they overlap (Bonferroni). As a change counts only
// if a second look finds it again, the true rate is lower.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::diagnosis {

struct FoundSize {
  std::string name, unit;
  double value = kNaN, standard_error = kNaN;  // of what was added at the onset
};

/// Times are seconds since 1970, as the stamps.
struct FoundChange {
  std::string effect;                        // id of an effect, name of a declared value, or "unknown"
  std::string joint;                         // of an arm; else empty
  double since = 0;                          // s
  double since_from = 0, since_to = 0;       // s, 95 % interval
  std::optional<double> until;               // s; absent: it goes on
  std::vector<FoundSize> size;               // empty where unknown
  std::vector<std::string> equivalent_to;    // effects that explain the same
  double gain = 0;                           // twice the log likelihood ratio
  double error_before = 0, error_after = 0;  // N m, rms after the onset without and with it
};

/// What a look at a stretch of the record has found.
struct ChangeLook {
  double from = 0, to = 0;             // s, the stretch
  std::vector<FoundChange> changes;    // by onset
  std::vector<std::string> different;  // effects that are there from the beginning of the stretch
  std::vector<std::string> unjudged;   // joints of an arm that it does not judge, and why
  long windows = 0;                    // of motion that could be judged
  std::vector<std::string> warnings;
};

enum class ChangeState {
  suspected,  // found by one look
  standing,
  unseen,  // the last looks do not differ from the healthy machine, as earlier ones after the onset did: it
           // has ended at a time that no look saw, or the motion no longer shows it
  ended,
  withdrawn,  // later looks at the same time found none
};

const char* to_string(ChangeState state);
std::optional<ChangeState> change_state_from(const std::string& name);

struct KnownChange {
  long id = 0;  // counted from 1 in the order in which they are reported; 0: not reported
  ChangeState state = ChangeState::suspected;
  FoundChange found;      // the sharpest so far
  double seen = 0;        // s, end of the last stretch in which it was found
  int missed = 0;         // looks in a row that should have found it
  long key = 0;           // of the ledger
  long ends = 0;          // the change that this one undoes, by id; 0: none. Not reported by itself
  bool differed = false;  // a look at the time after its onset saw the machine differ from its beginning
  int alike = 0;          // looks in a row, since then, that saw no difference
  bool reported() const { return id > 0; }
};

class ChangeLedger {
 public:
  /// Takes a look; ids of changes that are to be reported, as they are new or known better.
  std::vector<long> take(const ChangeLook& look);

  /// The clock was set: what only one look has found is forgotten.
  void restart();

  /// Continues from what was reported before a restart of the program.
  void restore(const std::vector<KnownChange>& reported);

  /// All that were reported, the oldest first; at most kMostKnown.
  std::vector<KnownChange> reported() const;
  const KnownChange& change(long id) const;

  /// Effects that the last looks had from the beginning of their stretch, while no standing change explains
  /// it: the machine is another one since an unknown time. Empty before kLooksOfDifference such looks.
  std::vector<std::string> unexplained_difference() const;

  static constexpr std::size_t kMostKnown = 200;
  static constexpr int kLooksOfDifference = 3;

 private:
  KnownChange* match(const FoundChange& found, std::vector<long>& keys_taken);
  long undone_by(const FoundChange& found) const;
  bool confirm(KnownChange& known);
  void miss(const ChangeLook& look, const std::vector<long>& keys_taken, std::vector<long>& news);
  void lose(const ChangeLook& look, std::vector<long>& news);
  void note_difference(const ChangeLook& look);

  std::vector<KnownChange> known_;
  std::vector<std::string> different_;
  int different_looks_ = 0;
  long last_id_ = 0, last_key_ = 0;
};

/// 1/h for one look at `window` seconds each `interval` seconds, of one of `joints` joints, so that all looks
/// at all joints together have `rate` [1/h].
double rate_of_look(double rate, double window, double interval, std::size_t joints);

}  // namespace backlash::diagnosis
