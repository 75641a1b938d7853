// SPDX-License-Identifier: BSD-3-Clause
#include "several_json.h"

#include "backlash_diagnosis/model/axis_unit.h"

namespace backlash::findings {

report::Json several_json(const std::optional<identification::SeveralMachines>& several,
                          const std::map<std::string, std::string>& units, bool linear) {
  if (!several) return nullptr;
  report::Json json = {{"together", report::json_number(several->together)},
                       {"differ", several->names},
                       {"records", report::Json::array()}};
  for (const identification::RecordAlone& r : several->records) {
    report::Json record = {
        {"record", r.record}, {"left", report::json_number(r.left)}, {"parameters", report::Json::object()}};
    for (const auto& [name, m] : r.values)
      record["parameters"][name] = {{"value", report::json_number(m.value)},
                                    {"unit", model::axis_unit(units.at(name), linear)},
                                    {"standard_error", report::json_number(m.standard_error)}};
    json["records"].push_back(std::move(record));
  }
  return json;
}

}  // namespace backlash::findings
