// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace backlash::rig_file {
namespace {

constexpr int kMultiples = 6;        // choice: harmonics, a motor's torque ripple among them
constexpr double kWithin = 2;        // theory: standard errors of 95 %
constexpr double kExact = 1e-3;      // choice: of the order, as far as an encoder's scale may be off
constexpr long kMostTeeth = 2000;    // choice
constexpr double kSameRatio = 1e-3;  // choice: printed ratios are rounded
constexpr double kLobes = 2;         // theory: of the usual wave generator

double ratio_of(const std::vector<Drive::Stage>& stages) {
  double ratio = 1;
  for (const Drive::Stage& stage : stages) ratio *= double(stage.driven) / double(stage.driving);
  return ratio;
}

/// The multiple of the part that the order is; 0: none.
int multiple(const TurningPart& part, double order, double standard_error) {
  const int m = int(std::lround(order / part.order));
  const double within = kWithin * standard_error + kExact * order;
  return m >= 1 && m <= kMultiples && std::fabs(order - m * part.order) <= within ? m : 0;
}

}  // namespace

Drive read_drive(const YamlReader& yaml, double otherwise) {
  Drive drive;
  if (yaml.has("stages"))
    for (const YamlReader& stage : yaml.maps("stages"))
      drive.stages.push_back(
          {stage.integer("driving", 1, kMostTeeth), stage.integer("driven", 1, kMostTeeth)});
  const double teeth = drive.stages.empty() ? otherwise : ratio_of(drive.stages);
  drive.reduction_ratio = yaml.number_or("reduction_ratio", teeth, Range::positive());
  if (!drive.stages.empty() && std::fabs(teeth / drive.reduction_ratio - 1) > kSameRatio)
    yaml.fail("reduction_ratio", fmt::format("the teeth of the stages make it {:.6g}", teeth));
  drive.pole_pairs = yaml.integer_or("pole_pairs", 0, 1, kMostTeeth);
  drive.wave_generator = yaml.boolean_or("wave_generator", false);
  return drive;
}

std::vector<TurningPart> turning_parts(const Drive& drive) {
  if (!(drive.reduction_ratio > 0)) return {};
  std::vector<TurningPart> parts = {{"once per turn of the load", 1},
                                    {"once per motor turn", drive.reduction_ratio}};
  if (drive.pole_pairs > 0)
    parts.push_back({"once per pole pair of the motor", drive.reduction_ratio * double(drive.pole_pairs)});
  if (drive.wave_generator)
    parts.push_back({"twice per turn of the wave generator", kLobes * drive.reduction_ratio});
  double turns = drive.reduction_ratio;
  for (std::size_t i = 0; i < drive.stages.size(); ++i) {
    const Drive::Stage& stage = drive.stages[i];
    parts.push_back({fmt::format("once per tooth of stage {}", i + 1), turns * double(stage.driving)});
    turns *= double(stage.driving) / double(stage.driven);
    if (i + 1 < drive.stages.size())
      parts.push_back({fmt::format("once per turn of the shaft behind stage {}", i + 1), turns});
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const TurningPart& a, const TurningPart& b) { return a.order < b.order; });
  return parts;
}

std::string part_of_order(const Drive& drive, double order, double standard_error) {
  std::string is, is_not;
  for (const TurningPart& part : turning_parts(drive)) {
    const int m = multiple(part, order, standard_error);
    std::string& to = m > 0 ? is : is_not;
    to += fmt::format("{}{}, {:.6g}", to.empty() ? "" : m > 0 ? " or " : "; ", part.name, part.order);
    if (m > 1) to += fmt::format(" (multiple {})", m);
  }
  if (is.empty() && is_not.empty()) return "";
  if (is.empty()) is = "no part of the drive that the rig file states";
  return is_not.empty() ? is
                        : fmt::format("{}; not, nor up to {} times as often: {}", is, kMultiples, is_not);
}

}  // namespace backlash::rig_file
