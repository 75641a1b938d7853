// SPDX-License-Identifier: BSD-3-Clause
#include "signature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/axis_unit.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kMostNames = 3;  // choice

/// Of the signal; beside an effect that is smaller itself, of that.
bool worth_saying(const Remainder& r, double part, const ExplainableSettings& settings) {
  const bool far = r.rms > settings.far * r.floor;
  const double of_signal = (far ? settings.worth_saying_far : settings.worth_saying) * r.signal;
  const double least =
      r.explained > 0 ? std::min(of_signal, settings.part_of_explained * r.explained) : of_signal;
  return r.signal > 0 && part * r.rms >= least;
}

bool beyond_noise(const Remainder& r, const ExplainableSettings& settings) {
  return r.rms > settings.clear * r.floor && worth_saying(r, 1, settings);
}

/// Well above the noise of the sensors the whole remainder is the model's lack, of which the states need show
/// but a part; else only what they show can be distinguished from noise.
bool explainable(const Remainder& r, const ExplainableSettings& settings) {
  const double part = beyond_noise(r, settings) ? 1 : std::sqrt(r.explainable.value);
  return r.explainable.value >= settings.near_zero && r.explainable.lower > 0 &&
         r.explainable.value > r.explainable.chance && worth_saying(r, part, settings);
}

/// So much of the signal, and so far beyond the noise, that nobody would call it noise of the torque.
bool too_much(const Remainder& r, const ExplainableSettings& settings) {
  const double least = r.rms > settings.very_far * r.floor ? settings.much_very_far : settings.much;
  return r.rms > settings.beyond * r.floor && r.rms > least * r.signal;
}

/// A hundredth of the signal, and too much for noise of any colour: it comes and goes; or two encoders differ
/// by it, whose noise is white; or it is as large as what an effect does.
bool no_noise(const ChannelRemainder& c, const ExplainableSettings& settings) {
  const Remainder& r = c.left;
  return beyond_noise(r, settings) && r.rms >= settings.worth_saying * r.signal &&
         (r.unevenness > settings.uneven || c.channel == "deflection" || too_much(r, settings));
}

std::string followed_states(const Remainder& r, const ExplainableSettings& settings) {
  std::string text;
  for (std::size_t i = 0; i < std::min(kMostNames, r.follows.size()); ++i)
    if (r.follows[i].share.value >= settings.worth_naming)
      text += fmt::format("{} {} ({:.0f} % of its variance)", text.empty() ? "" : ",", r.follows[i].name,
                          100 * r.follows[i].share.value);
  return text;
}

Unexplained described(const ChannelRemainder& c, bool linear, const ExplainableSettings& settings) {
  const Remainder& r = c.left;
  Unexplained u{c.channel,
                fmt::format("{:.3g} {} rms{}, {:.1f} times the noise floor; ", r.rms,
                            model::axis_unit(c.channel == "deflection" ? "rad" : "N m", linear), c.where,
                            r.rms / r.floor),
                {r.explainable.value, r.explainable.lower, r.explainable.upper}};
  const std::string states = followed_states(r, settings);
  if (r.follows.empty())
    u.signature += "the records are too short to say what it follows";
  else if (!explainable(r, settings))
    u.signature += r.unevenness > settings.uneven
                       ? "follows no state of the machine, but comes and goes, which noise does not"
                   : c.channel == "deflection"
                       ? "follows no state of the machine, but encoders have no such noise: what has "
                         "happened before matters"
                       : "follows no state of the machine: a torque from outside, an effect that varies in "
                         "time, or noise of another kind";
  else
    u.signature +=
        fmt::format("follows{}; {:.0f} % of its variance could be explained by the state of the machine",
                    states.empty() ? " no single state" : states, 100 * r.explainable.value);
  return u;
}

}  // namespace

double explainable_part(const Remainder& r) {
  return r.signal > 0 ? std::sqrt(r.explainable.value) * r.rms / r.signal : 0;
}

std::optional<Unexplained> signature(const std::vector<ChannelRemainder>& all, bool linear,
                                     const ExplainableSettings& settings) {
  const ChannelRemainder *most = nullptr, *uneven = nullptr;
  for (const ChannelRemainder& c : all) {
    if (explainable(c.left, settings) && (!most || explainable_part(c.left) > explainable_part(most->left)))
      most = &c;
    if (no_noise(c, settings) && (!uneven || c.left.unevenness > uneven->left.unevenness)) uneven = &c;
  }
  if (!most) most = uneven;
  return most ? std::make_optional(described(*most, linear, settings)) : std::nullopt;
}

std::vector<std::string> noise_notes(const std::vector<ChannelRemainder>& all,
                                     const ExplainableSettings& settings) {
  std::vector<std::string> notes;
  for (const ChannelRemainder& c : all)
    if (beyond_noise(c.left, settings) && !explainable(c.left, settings) && !no_noise(c, settings))
      notes.push_back(fmt::format(
          "what is left of {}{} is {:.1f} times what the noise of the sensors leaves, and follows no state "
          "of "
          "the machine ({:.2g} % of its variance): noise of another kind, or an effect that depends on none",
          c.channel, c.where, c.left.rms / c.left.floor, 100 * c.left.explainable.value));
  return notes;
}

}  // namespace backlash::identification
