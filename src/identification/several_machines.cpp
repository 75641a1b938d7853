// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/several_machines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/measured_text.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kMostValues = 4;  // choice: in a sentence; reports have all

/// How far two values differ, in their errors; 0 where that is little of the value.
double difference(const signal::Measured& a, const signal::Measured& b, const SeveralSettings& settings) {
  const double apart = std::fabs(a.value - b.value);
  if (!(apart > settings.least_change * std::max(std::fabs(a.value), std::fabs(b.value)))) return 0;
  const double error = std::hypot(a.standard_error, b.standard_error);
  return error > 0 ? apart / error : 0;
}

/// The largest between any two records; 0 for a value that one of them does not determine.
double largest_difference(const std::string& name, const std::vector<RecordAlone>& records,
                          const SeveralSettings& settings) {
  double largest = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto here = records[i].values.find(name);
    if (here == records[i].values.end()) return 0;
    for (std::size_t k = 0; k < i; ++k)
      largest = std::max(largest, difference(here->second, records[k].values.at(name), settings));
  }
  return largest;
}

}  // namespace

bool is_met(double left, double together, const SeveralSettings& settings) {
  return left < std::max(settings.at_noise, settings.much_less * together);
}

std::optional<SeveralMachines> several_machines(std::vector<RecordAlone> records, double together,
                                                const SeveralSettings& settings) {
  std::vector<std::pair<double, std::string>> differing;
  for (const RecordAlone& r : records)
    if (!is_met(r.left, together, settings)) return std::nullopt;
  for (const auto& [name, value] : records.front().values) {
    const double errors = largest_difference(name, records, settings);
    if (errors >= settings.least_z) differing.emplace_back(-errors, name);
  }
  if (differing.empty()) return std::nullopt;
  std::sort(differing.begin(), differing.end());
  SeveralMachines found{std::move(records), together, {}};
  for (const auto& [errors, name] : differing) found.names.push_back(name);
  return found;
}

void allow_for_several(const SeveralMachines& several, std::map<std::string, signal::Measured>& parameters) {
  for (auto& [name, measured] : parameters)
    for (const RecordAlone& r : several.records)
      if (const auto at = r.values.find(name); at != r.values.end())
        measured.standard_error =
            std::max(measured.standard_error, std::fabs(at->second.value - measured.value));
}

std::string description(const SeveralMachines& several, const std::map<std::string, std::string>& units,
                        bool linear) {
  double left = 0;
  for (const RecordAlone& r : several.records) left = std::max(left, r.left);
  std::string text = fmt::format(
      "The records contradict each other: each by itself is met by the declared model (at most {:.3g} times "
      "the noise is left, of all together {:.3g} times), with other values: ",
      left, several.together);
  for (std::size_t i = 0; i < std::min(kMostValues, several.names.size()); ++i) {
    const std::string& name = several.names[i];
    text += (i == 0 ? "" : "; ") + name;
    for (const RecordAlone& r : several.records)
      text += fmt::format("{}{} in {}", &r == &several.records.front() ? " " : ", ",
                          signal::with_error(r.values.at(name)), r.record);
    text += " (" + model::axis_unit(units.at(name), linear) + ")";
  }
  return text +
         ". They are of different machines, of one that has changed between them, or of one with an effect "
         "that none of them shows by itself";
}

}  // namespace backlash::identification
