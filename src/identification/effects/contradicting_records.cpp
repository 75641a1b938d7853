// SPDX-License-Identifier: BSD-3-Clause
#include "contradicting_records.h"

#include <algorithm>

#include "found_effects.h"
#include "steps.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kMostRecords = 8;  // choice (time)

}  // namespace

std::optional<SeveralMachines> contradicting_records(const model::Rig& declared,
                                                     const std::vector<std::string>& names,
                                                     const ServoData& unseen, double left,
                                                     const SearchContext& context) {
  if (names.size() > kMostRecords || declared.coupled) return std::nullopt;
  std::vector<RecordAlone> records;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::vector<ServoData> alone = {i < context.data.size() ? context.data[i] : unseen};
    const SearchContext own{
        alone, unseen, context.range, context.settings, context.report, [](const Hypothesis&) {}};
    const auto fitted = attempted([&] { return fit_declared(declared, own); });
    if (!fitted) return std::nullopt;
    records.push_back({names[i], fitted_values(*fitted->base, fitted->declared->parameters.size()).machine,
                       std::max(misfit(*fitted).torque, misfit(*fitted).deflection)});
    if (!is_met(records.back().left, left)) return std::nullopt;
  }
  return several_machines(std::move(records), left);
}

}  // namespace backlash::identification
