// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "backlash_diagnosis/findings/trace_report.h"
#include "backlash_diagnosis/signal/measured_text.h"

namespace backlash::findings {
namespace {

/// Whether a parameter of an effect's step, "order" or "order_2", is an order.
bool is_order(const identification::FoundEffect& effect, const std::string& parameter) {
  const auto& search = model::term_type(effect.id).search;
  if (!search) return false;
  for (const model::TermShape& shape : search->shapes)
    if (shape.wave && (parameter == shape.name || parameter.rfind(shape.name + "_", 0) == 0)) return true;
  return false;
}

}  // namespace

std::vector<std::string> drive_notes(const identification::Trace& trace, const rig_file::Drive& drive) {
  std::vector<std::string> notes;
  if (trace.augmented.linear) return notes;
  for (const identification::FoundEffect& effect : trace.steps)
    for (const identification::EffectParameter& p : effect.parameters) {
      if (!is_order(effect, p.name)) continue;
      const std::string part = rig_file::part_of_order(drive, p.measured.value, p.measured.standard_error);
      if (!part.empty())
        notes.push_back(
            fmt::format("{}, {} {}: {}", effect.id, p.name, signal::with_error(p.measured), part));
    }
  return notes;
}

}  // namespace backlash::findings
