// SPDX-License-Identifier: BSD-3-Clause
#include "channel_changes.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/text.h"

namespace backlash::changes {
namespace {

/// "37 s"
std::string whole_seconds(double time) {
  return to_text(std::round(time)) + " s";
}

double rounded(double x) {
  return std::round(10 * x) / 10;
}

/// Where the record is louder than the healthy machine. Of two inertias another task alone may do that, up to
/// a limit: their teeth cross the gap more often or harder.
void report_loud(const ChangeSearch& search, const LoudStretch& loud, std::vector<std::string> nearest,
                 bool of_two, const ChangeSettings& settings, Changes& out) {
  Change unknown = search.unknown(loud);
  if (!loud.from_beginning && (!of_two || loud.times >= settings.unknown_of_two)) {
    unknown.alike = std::move(nearest);
    out.changes.push_back(unknown);
    return;
  }
  const std::string since =
                        loud.from_beginning ? "from its beginning" : "since " + whole_seconds(unknown.since),
                    until = unknown.until ? " to " + whole_seconds(*unknown.until) : "";
  out.cannot_tell =
      since + until + " the record follows no effect, " + to_text(rounded(std::sqrt(loud.times))) +
      " times as far from it as the healthy records; if its task is another one, commission with "
      "motion of this kind";
}

/// Where it is louder than in the rest, but less than that.
void report_louder(const ChangeSearch& search, Changes& out) {
  const std::optional<LoudStretch> louder = search.louder();
  if (!louder) return;
  const Change unknown = search.unknown(*louder);
  const std::string until = unknown.until ? " to " + whole_seconds(*unknown.until) : "";
  out.cannot_tell =
      "since " + whole_seconds(unknown.since) + until + " the record is " +
      to_text(rounded(std::sqrt(louder->times))) +
      " times as far from the healthy ones, farther than in the rest of it in motion alike, and "
      "follows no effect";
}

void report_unexplained(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                        const ChangeSettings& settings, Changes& out) {
  const std::optional<LoudStretch> loud = search.loud(found);
  double explained = 0;
  std::vector<std::string> nearest;
  for (const FoundChange& f : found) {
    explained += f.score.gain;
    nearest.push_back(f.effect.id);
  }
  if (search.like_fault()) nearest.emplace_back(kLocalFault);
  if (loud && loud->excess > explained) {
    out.changes.clear();
    report_loud(search, search.loud({}).value_or(*loud), nearest, of_two, settings, out);
  } else if (loud) {
    out.warnings.push_back("since " + whole_seconds(search.unknown(*loud).since) +
                           " the record follows no effect, beside " + joined(nearest));
  } else if (search.like_fault()) {
    out.cannot_tell = "the record differs from the healthy ones in a way that no effect explains (nearest: " +
                      joined(nearest) + "): commission with more motion of this kind";
  } else if (found.empty()) {
    report_louder(search, out);
  }
}

}  // namespace

Changes reported_changes(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                         bool linear, const ChangeSettings& settings) {
  Changes out;
  out.windows = search.windows();
  out.threshold = search.threshold(1);
  out.noise = search.model().noise;
  for (const ChangeEffect& e : search.model().further) out.healthy_terms.push_back(e.name());
  for (const FoundChange& f : found) out.changes.push_back(search.change_of(f, found, linear));
  report_unexplained(search, found, of_two, settings, out);
  take_out_short(settings, out);
  for (const std::string& name : search.different()) add_different(name, out);
  return out;
}

void add_different(const std::string& name, Changes& out) {
  out.different.push_back(name);
  out.warnings.push_back("from its beginning the record differs from the healthy ones by " + name +
                         ": it did not change within the record");
}

void take_out_short(const ChangeSettings& settings, Changes& out) {
  const double shortest = double(settings.least_windows) * settings.window;
  const auto is_short = [&](const Change& c) { return c.until && *c.until - c.since < shortest; };
  for (const Change& c : out.changes)
    if (is_short(c) && out.cannot_tell.empty())
      out.cannot_tell =
          "from " + whole_seconds(c.since) + " to " + whole_seconds(*c.until) +
          " the record differs from the healthy ones, too short to say by what (nearest: " + c.effect + ")";
  out.changes.erase(std::remove_if(out.changes.begin(), out.changes.end(), is_short), out.changes.end());
}

}  // namespace backlash::changes
