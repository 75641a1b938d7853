// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/weights.h"

#include <filesystem>
#include <regex>

#include "backlash_diagnosis/base/text.h"

namespace backlash::tools {
namespace {

const char* const kForm =
    "expected MASS kg [+- ERROR] [at LEVER m], as \"2.805 kg +- 0.005\" or \"1 kg +- 1 % at 0.15 m\", or "
    "unknown; "
    "RECORD= before it says which record";

[[noreturn]] void fail(const std::string& value, const std::string& reason) {
  throw UsageError("--payload = '" + printable(value) + "': " + reason);
}

double number(const std::string& digits, const std::string& value) {
  const ParsedNumber parsed = parse_number(digits);
  if (!parsed) fail(value, "'" + printable(digits) + "': " + parsed.problem);
  return parsed.value;
}

double kilograms(const std::string& unit) {
  return unit == "g" ? 1e-3 : 1;
}

/// The place of the record in front of "=", and what is behind it; the first record without one.
std::pair<std::size_t, std::string> record_of(const std::string& value,
                                              const std::vector<std::string>& records) {
  std::optional<std::size_t> found;
  const std::size_t at = value.rfind('=');
  if (at == std::string::npos) return {0, value};
  const std::string name = value.substr(0, at);
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (records[i] == name) return {i, value.substr(at + 1)};
    if (std::filesystem::path(records[i]).filename() != name) continue;
    if (found) fail(value, "two records have this name: write the whole path");
    found = i;
  }
  if (!found) fail(value, "'" + printable(name) + "' is none of the records");
  return {*found, value.substr(at + 1)};
}

}  // namespace

Weight parse_weight(const std::string& text) {
  static const std::string kNumber = "([-+.0-9eE]+)", kAbout = R"((?:\+-|\+/-|±))";
  static const std::regex kWeight(R"(\s*)" + kNumber + R"(\s*(kg|g)?\s*(?:)" + kAbout + R"(\s*)" + kNumber +
                                  R"(\s*(kg|g|%)?)?\s*(?:at\s+)" + kNumber + R"(\s*(mm|m)\s*)?)");
  if (trimmed(text) == "unknown") return {};
  std::smatch part;
  if (!std::regex_match(text, part, kWeight)) fail(text, kForm);
  const std::string of_error = part[4], unit = part[2].matched ? part[2] : of_error == "%" ? "" : of_error;
  if (unit.empty()) fail(text, std::string("has no unit of the mass: ") + kForm);
  Weight weight;
  signal::Measured mass{number(part[1], text) * kilograms(unit), 0};
  if (!(mass.value > 0)) fail(text, "the mass must be > 0");
  if (part[3].matched) {
    const double error = number(part[3], text);
    if (!(error > 0)) fail(text, "the error must be > 0; without one the mass is exact");
    mass.standard_error =
        of_error == "%" ? 0.01 * error * mass.value : error * kilograms(of_error.empty() ? unit : of_error);
  }
  weight.mass = mass;
  if (part[5].matched) {
    weight.lever = number(part[5], text) * (part[6] == "mm" ? 1e-3 : 1);
    if (!(*weight.lever > 0)) fail(text, "the lever must be > 0");
  }
  return weight;
}

std::vector<std::optional<Weight>> weights_of(const Arguments& arguments) {
  const std::vector<std::string>& records = arguments.positionals();
  std::vector<std::optional<Weight>> weights(records.size());
  if (!arguments.has("payload")) return weights;
  for (const std::string& value : arguments.texts("payload")) {
    const auto [record, said] = record_of(value, records);
    if (weights[record]) fail(value, printable(records[record]) + " has a weight already");
    weights[record] = parse_weight(said);
  }
  return weights;
}

}  // namespace backlash::tools
