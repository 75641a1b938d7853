// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/model/centre_distance.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::model {
namespace {

constexpr double kSteepest = 89 * M_PI / 180;

void require(const char* name, double value, const Range& range) {
  if (!range.contains(value)) throw InvalidParameter(name, value, range.text());
}

/// Centre-distance change per stop setting.
double lever(const HingedBracket& b) {
  require("pivot_to_stop", b.pivot_to_stop, Range::positive());
  require("pivot_to_pinion", b.pivot_to_pinion, Range::positive());
  require("angle", b.angle, Range::between(-kSteepest, kSteepest));
  return b.pivot_to_pinion / b.pivot_to_stop * std::cos(b.angle);
}

}  // namespace

double centre_distance_change(const HingedBracket& bracket, double stop) {
  return stop * lever(bracket);
}

double stop_setting_for(const HingedBracket& bracket, double centre_distance_change) {
  return centre_distance_change / lever(bracket);
}

double small_change_pitch_circle_backlash(double centre_distance_change, double pressure_angle) {
  return 2 * centre_distance_change * std::tan(pressure_angle);
}

double small_change_backlash(double centre_distance_change, double pressure_angle) {
  return small_change_pitch_circle_backlash(centre_distance_change, pressure_angle) *
         std::cos(pressure_angle);
}

double resolution_on_pitch_circle(int teeth, double module, double step) {
  require("teeth", teeth, Range::positive());
  require("module", module, Range::positive());
  require("step", step, Range::positive());
  return 0.5 * teeth * module * step;
}

}  // namespace backlash::model
