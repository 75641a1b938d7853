// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/estimate.h"

#include <fmt/core.h>

#include <array>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::diagnosis {
namespace {

constexpr std::array<std::pair<Status, const char*>, 6> kNames = {
    {{Status::ok, "ok"},
     {Status::below_range, "below_range"},
     {Status::above_range, "above_range"},
     {Status::out_of_domain, "out_of_domain"},
     {Status::insufficient_data, "insufficient_data"},
     {Status::ambiguous, "ambiguous"}}};

}  // namespace

const char* to_string(Status status) {
  for (const auto& [value, name] : kNames) {
    if (value == status) return name;
  }
  throw InvalidParameter("status", static_cast<double>(status), "must be an enumerator of Status");
}

std::string contradiction_text(const std::vector<ContradictedValue>& contradicted) {
  std::vector<std::string> parts;
  for (const ContradictedValue& v : contradicted)
    parts.push_back(fmt::format("declared {} {:.3g} {}, this record says {:.3g} +- {:.1g}", v.name,
                                v.declared, v.unit, v.found, v.standard_error));
  return parts.empty() ? std::string() : joined(parts) + ": run identify";
}

}  // namespace backlash::diagnosis
