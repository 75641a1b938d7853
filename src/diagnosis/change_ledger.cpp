// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/change_ledger.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"

namespace backlash::diagnosis {
namespace {

constexpr double kSameEvent = 5;  // s between onsets of what is one change. As in the search for changes
constexpr double kEdge = 30;      // s at either end of a stretch in which a look may miss one. Choice: three
                                  // times the margin of the search, and what an onset is uncertain by
constexpr int kMostMissed = 3;    // looks in a row, then a change is withdrawn, or no longer seen. Choice
constexpr double kSharper = 0.9;  // - of an interval that is worth a report. Choice
constexpr double kUndone = 3;     // standard errors within which a size is undone. Choice

const std::pair<ChangeState, const char*> kStates[] = {{ChangeState::suspected, "suspected"},
                                                       {ChangeState::standing, "standing"},
                                                       {ChangeState::unseen, "unseen"},
                                                       {ChangeState::ended, "ended"},
                                                       {ChangeState::withdrawn, "withdrawn"}};

bool same_event(const FoundChange& a, const FoundChange& b) {
  return a.joint == b.joint && a.since_from - kSameEvent <= b.since_to &&
         b.since_from - kSameEvent <= a.since_to;
}

const FoundSize* size_of(const FoundChange& change, const std::string& name) {
  for (const FoundSize& s : change.size)
    if (s.name == name) return &s;
  return nullptr;
}

double first_error(const FoundChange& change) {
  return change.size.empty() ? 0 : change.size.front().standard_error;
}

/// Whether it says more than what is known: worth a message.
bool says_more(const FoundChange& found, const FoundChange& known) {
  return found.effect != known.effect || found.until.has_value() != known.until.has_value() ||
         found.since_to - found.since_from < kSharper * (known.since_to - known.since_from) ||
         first_error(found) < kSharper * first_error(known);
}

/// Whether the stretch shows this change, or another one of its joint, from its beginning.
bool shows(const ChangeLook& look, const FoundChange& change) {
  return std::any_of(look.different.begin(), look.different.end(), [&](const std::string& d) {
    return d.find(change.joint) != std::string::npos || d.find(change.effect) != std::string::npos;
  });
}

bool judged(const ChangeLook& look, const std::string& joint) {
  const auto of = [&](const std::string& u) { return !joint.empty() && u.find(joint) == 0; };
  return look.windows > 0 && std::none_of(look.unjudged.begin(), look.unjudged.end(), of);
}

bool near(double a, double b, const FoundSize& x, const FoundSize& y) {
  return std::fabs(a - b) <= kUndone * std::hypot(x.standard_error, y.standard_error);
}

/// Whether the second takes away what the first added: the opposite size, or of a sine the opposite phase.
bool undoes(const FoundChange& first, const FoundChange& second) {
  if (first.effect != second.effect || first.joint != second.joint || first.size.empty() ||
      second.size.empty())
    return false;
  const FoundSize &a = first.size.front(), &b = second.size.front();
  const FoundSize *phase = size_of(first, "phase"), *other = size_of(second, "phase");
  if (!phase || !other) return near(a.value, -b.value, a, b);
  const double apart = std::fabs(std::remainder(phase->value - other->value, 2 * M_PI));
  return near(a.value, b.value, a, b) && near(apart, M_PI, *phase, *other);
}

}  // namespace

const char* to_string(ChangeState state) {
  for (const auto& [known, name] : kStates)
    if (known == state) return name;
  return "";
}

std::optional<ChangeState> change_state_from(const std::string& name) {
  for (const auto& [state, known] : kStates)
    if (known == name) return state;
  return std::nullopt;
}

double rate_of_look(double rate, double window, double interval, std::size_t joints) {
  for (const auto& [name, value] : {std::pair("false_alarms", rate),
                                    {"window", window},
                                    {"check_interval", interval},
                                    {"joints", double(joints)}})
    if (!(value > 0)) throw InvalidParameter(name, value, "must be > 0");
  return rate * std::min(1.0, interval / window) / double(joints);
}

/// The known change that this one repeats, if no other of the same look does; null: a new one.
KnownChange* ChangeLedger::match(const FoundChange& found, std::vector<long>& keys_taken) {
  KnownChange* best = nullptr;
  for (KnownChange& k : known_) {
    const bool free = std::find(keys_taken.begin(), keys_taken.end(), k.key) == keys_taken.end();
    if (!free || k.state == ChangeState::withdrawn || !same_event(k.found, found)) continue;
    if (!best || (k.found.effect == found.effect && best->found.effect != found.effect)) best = &k;
  }
  if (best) keys_taken.push_back(best->key);
  return best;
}

/// Whether it ends where the other begins: a look that no longer saw the onset finds the end as a change.
bool ends_with(const KnownChange& known, const FoundChange& found) {
  return known.state == ChangeState::ended && known.found.until &&
         *known.found.until > found.since_from - kSameEvent &&
         *known.found.until < found.since_to + kSameEvent;
}

long ChangeLedger::undone_by(const FoundChange& found) const {
  for (auto k = known_.rbegin(); k != known_.rend(); ++k)
    if (k->id > 0 && (k->state == ChangeState::standing || ends_with(*k, found)) &&
        k->found.since_to < found.since_from && undoes(k->found, found))
      return k->id;
  return 0;
}

/// A second look has found it. False where it was no news.
bool ChangeLedger::confirm(KnownChange& known) {
  if (known.state != ChangeState::suspected) return false;
  known.state = known.found.until ? ChangeState::ended : ChangeState::standing;
  known.ends = undone_by(known.found);
  if (known.ends == 0) {
    known.id = ++last_id_;
    return true;
  }
  bool news = false;
  for (KnownChange& k : known_)
    if (k.id > 0 && k.id == known.ends && k.state == ChangeState::standing) {
      k.state = ChangeState::ended;
      k.found.until = known.found.since;
      news = true;
    }
  known.state = ChangeState::ended;
  return news;
}

std::vector<long> ChangeLedger::take(const ChangeLook& look) {
  std::vector<long> keys_taken, news;
  for (const FoundChange& found : look.changes) {
    KnownChange* known = match(found, keys_taken);
    if (!known) {
      known_.push_back({0, ChangeState::suspected, found, look.to, 0, ++last_key_, 0});
      keys_taken.push_back(last_key_);
      continue;
    }
    known->seen = look.to;
    known->missed = 0;
    const bool more = says_more(found, known->found);
    const bool ends = found.until && !known->found.until && known->ends == 0;
    if (known->state == ChangeState::suspected || found.gain > known->found.gain || ends) {
      const std::optional<double> until = found.until ? found.until : known->found.until;
      known->found = found;
      known->found.until = until;
      if (confirm(*known) || (more && known->ends == 0))
        news.push_back(known->ends != 0 ? known->ends : known->id);
      if (ends && known->state == ChangeState::standing) known->state = ChangeState::ended;
    }
  }
  miss(look, keys_taken, news);
  lose(look, news);
  note_difference(look);
  return news;
}

/// Changes that this look should have found and did not.
void ChangeLedger::miss(const ChangeLook& look, const std::vector<long>& keys_taken,
                        std::vector<long>& news) {
  for (KnownChange& k : known_) {
    const bool inside = k.found.since_from > look.from + kEdge && k.found.since_to < look.to - kEdge;
    const bool open = k.state == ChangeState::suspected || k.state == ChangeState::standing;
    if (!open || !inside || std::find(keys_taken.begin(), keys_taken.end(), k.key) != keys_taken.end())
      continue;
    if (k.state == ChangeState::standing && ++k.missed < kMostMissed) continue;
    if (k.state == ChangeState::standing) news.push_back(k.id);
    k.state = ChangeState::withdrawn;
  }
  const auto forgotten = [&](const KnownChange& k) {
    return (k.state == ChangeState::withdrawn && k.missed == 0) ||
           (k.state == ChangeState::suspected && k.found.since_to < look.from);
  };
  known_.erase(std::remove_if(known_.begin(), known_.end(), forgotten), known_.end());
  if (known_.size() > kMostKnown)
    known_.erase(known_.begin(), known_.end() - static_cast<std::ptrdiff_t>(kMostKnown));
}

/// Changes before this look's time: while they last, it differs from its beginning. A change that no look
/// ever saw like that is too small for it: its absence then says nothing.
void ChangeLedger::lose(const ChangeLook& look, std::vector<long>& news) {
  const auto another = [&](const KnownChange& k) {  // stands, and may be what the look sees
    return std::any_of(known_.begin(), known_.end(), [&](const KnownChange& o) {
      return o.key != k.key && o.state == ChangeState::standing && o.found.joint == k.found.joint;
    });
  };
  for (KnownChange& k : known_) {
    const bool open = k.state == ChangeState::standing || k.state == ChangeState::unseen;
    if (!open || k.found.since_to > look.from || !judged(look, k.found.joint)) continue;
    const ChangeState was = k.state;
    if (k.state == ChangeState::unseen && another(k)) continue;
    if (shows(look, k.found)) {
      k.differed = true;
      k.alike = 0;
      k.seen = look.to;
      k.state = ChangeState::standing;
    } else if (k.differed && look.different.empty() && look.changes.empty() && ++k.alike >= kMostMissed) {
      k.state = ChangeState::unseen;
    }
    if (k.state != was) news.push_back(k.id);
  }
}

void ChangeLedger::note_difference(const ChangeLook& look) {
  const auto standing = [](const KnownChange& k) { return k.state == ChangeState::standing && k.ends == 0; };
  const bool explained = std::any_of(known_.begin(), known_.end(), standing);
  different_ = explained ? std::vector<std::string>() : look.different;
  different_looks_ = different_.empty() ? 0 : different_looks_ + 1;
}

std::vector<std::string> ChangeLedger::unexplained_difference() const {
  return different_looks_ >= kLooksOfDifference ? different_ : std::vector<std::string>();
}

void ChangeLedger::restart() {
  known_.erase(std::remove_if(known_.begin(), known_.end(),
                              [](const KnownChange& k) { return k.state == ChangeState::suspected; }),
               known_.end());
  different_looks_ = 0;
}

void ChangeLedger::restore(const std::vector<KnownChange>& reported) {
  for (const KnownChange& k : reported) {
    known_.push_back(k);
    known_.back().key = ++last_key_;
    last_id_ = std::max(last_id_, k.id);
  }
}

std::vector<KnownChange> ChangeLedger::reported() const {
  std::vector<KnownChange> all;
  std::copy_if(known_.begin(), known_.end(), std::back_inserter(all),
               [](const KnownChange& k) { return k.reported(); });
  return all;
}

const KnownChange& ChangeLedger::change(long id) const {
  for (const KnownChange& k : known_)
    if (k.id == id) return k;
  throw InvalidParameter("id", double(id), "is of no change that is known");
}

}  // namespace backlash::diagnosis
