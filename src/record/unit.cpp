// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/unit.h"

#include <algorithm>
#include <array>
#include <vector>

#include "backlash_diagnosis/base/text.h"

namespace backlash::record {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr double kGravity = 9.80665;  // m/s^2, standard gravity (ISO 80000-3)

using Q = Quantity;
constexpr bool kAngular = true, kLinear = false, kDivides = true;

// The first name of a unit is the one that lists show; those behind it in the same unit are other spellings.
constexpr Unit kUnits[] = {
    {"s", Q::time, kLinear, 1, false},
    {"sec", Q::time, kLinear, 1, false},
    {"ms", Q::time, kLinear, 1e3, kDivides},
    {"us", Q::time, kLinear, 1e6, kDivides},
    {"\u00b5s", Q::time, kLinear, 1e6, kDivides},
    {"\u03bcs", Q::time, kLinear, 1e6, kDivides},
    {"ns", Q::time, kLinear, 1e9, kDivides},
    {"min", Q::time, kLinear, 60, false},
    {"h", Q::time, kLinear, 3600, false},
    {"hh:mm:ss", Q::time, kAngular, 1,
     false},  // distinguished from s by `angular`, which means nothing else here
    {"rad", Q::position, kAngular, 1, false},
    {"mrad", Q::position, kAngular, 1e3, kDivides},
    {"deg", Q::position, kAngular, kDegree, false},
    {"\u00b0", Q::position, kAngular, kDegree, false},
    {"rev", Q::position, kAngular, 2 * kPi, false},
    {"turn", Q::position, kAngular, 2 * kPi, false},
    {"arcmin", Q::position, kAngular, kDegree / 60, false},
    {"arcsec", Q::position, kAngular, kDegree / 3600, false},
    {"m", Q::position, kLinear, 1, false},
    {"mm", Q::position, kLinear, 1e3, kDivides},
    {"um", Q::position, kLinear, 1e6, kDivides},
    {"\u00b5m", Q::position, kLinear, 1e6, kDivides},
    {"\u03bcm", Q::position, kLinear, 1e6, kDivides},
    {"rad/s", Q::velocity, kAngular, 1, false},
    {"deg/s", Q::velocity, kAngular, kDegree, false},
    {"\u00b0/s", Q::velocity, kAngular, kDegree, false},
    {"rpm", Q::velocity, kAngular, kPi / 30, false},
    {"1/min", Q::velocity, kAngular, kPi / 30, false},
    {"Hz", Q::velocity, kAngular, 2 * kPi, false},  // turns per second
    {"rev/s", Q::velocity, kAngular, 2 * kPi, false},
    {"m/s", Q::velocity, kLinear, 1, false},
    {"mm/s", Q::velocity, kLinear, 1e3, kDivides},
    {"rad/s^2", Q::acceleration, kAngular, 1, false},
    {"rad/s\u00b2", Q::acceleration, kAngular, 1, false},
    {"deg/s^2", Q::acceleration, kAngular, kDegree, false},
    {"\u00b0/s\u00b2", Q::acceleration, kAngular, kDegree, false},
    {"m/s^2", Q::acceleration, kLinear, 1, false},
    {"m/s\u00b2", Q::acceleration, kLinear, 1, false},
    {"g", Q::acceleration, kLinear, kGravity, false},
    {"N m", Q::effort, kAngular, 1, false},
    {"Nm", Q::effort, kAngular, 1, false},
    {"N*m", Q::effort, kAngular, 1, false},
    {"N\u00b7m", Q::effort, kAngular, 1, false},
    {"mNm", Q::effort, kAngular, 1e3, kDivides},
    {"Ncm", Q::effort, kAngular, 1e2, kDivides},
    {"kNm", Q::effort, kAngular, 1e3, false},
    {"N", Q::effort, kLinear, 1, false},
    {"kN", Q::effort, kLinear, 1e3, false},
    {"A", Q::current, kLinear, 1, false},
    {"mA", Q::current, kLinear, 1e3, kDivides},
    {"raw", Q::raw, kLinear, 1, false},
    {"V", Q::raw, kLinear, 1, false},
    {"mV", Q::raw, kLinear, 1e3, kDivides},
    {"%", Q::raw, kLinear, 1e2, kDivides},  // of a rated value, which is the scale
};

Quantity quantity_of(Channel channel) {
  switch (channel) {
    case Channel::motor_position:
    case Channel::load_position:
    case Channel::reference_position:
      return Q::position;
    case Channel::motor_velocity:
    case Channel::load_velocity:
      return Q::velocity;
    case Channel::motor_current:
      return Q::current;
    case Channel::acceleration:
      return Q::acceleration;
    case Channel::motor_torque:
    case Channel::sensor_torque:
    case Channel::output_torque:
      break;
  }
  return Q::effort;
}

const char* words(Quantity quantity, bool angular) {
  switch (quantity) {
    case Q::time:
      return "a time";
    case Q::position:
      return angular ? "an angle" : "a length";
    case Q::velocity:
      return angular ? "an angular velocity" : "a velocity";
    case Q::acceleration:
      return angular ? "an angular acceleration" : "an acceleration";
    case Q::effort:
      return angular ? "a torque" : "a force";
    case Q::current:
      return "a current";
    case Q::raw:
      break;
  }
  return "raw";
}

bool fits(const Unit& unit, Quantity quantity, bool linear) {
  return unit.quantity == quantity && (quantity == Q::current || unit.angular != linear);
}

template <typename Wanted>
std::string list_of(const Wanted& wanted) {
  std::vector<std::string> names;
  for (const Unit& unit : kUnits)
    if (wanted(unit)) names.emplace_back(unit.name);
  return backlash::joined(names);
}

}  // namespace

bool Unit::same_as(const Unit& other) const {
  return quantity == other.quantity && angular == other.angular && factor == other.factor &&
         divides == other.divides;
}

const Unit* find_unit(std::string_view name) {
  const auto* const found =
      std::find_if(std::begin(kUnits), std::end(kUnits), [&](const Unit& unit) { return name == unit.name; });
  return found == std::end(kUnits) ? nullptr : found;
}

std::string known_units() {
  return list_of([](const Unit&) { return true; });
}

std::string known_units(Channel channel, bool linear) {
  return list_of([&](const Unit& unit) { return fits(unit, quantity_of(channel), linear); });
}

std::string misfit(const Unit& unit, Channel channel, bool linear, bool scaled) {
  const Quantity quantity = quantity_of(channel);
  if (fits(unit, quantity, linear)) return "";
  const bool by_scale = unit.quantity == Q::raw || unit.quantity == quantity ||
                        (unit.quantity == Q::current && channel == Channel::motor_torque);
  if (by_scale && scaled) return "";
  std::string reason = unit.quantity == Q::raw
                           ? "needs a scale"
                           : std::string(words(unit.quantity, unit.angular)) + ", expected " +
                                 words(quantity, !linear) + (linear ? " of a linear axis" : "") + " (" +
                                 known_units(channel, linear) + ")";
  if (by_scale && unit.quantity != Q::raw) reason += " or a scale that makes it one";
  return reason;
}

Label label_of(std::string_view text) {
  text = trimmed(text);
  if (text.empty() || (text.back() != ']' && text.back() != ')')) return {text, {}, false};
  const auto open = text.rfind(text.back() == ']' ? '[' : '(');
  if (open == std::string_view::npos) return {text, {}, false};
  return {trimmed(text.substr(0, open)), trimmed(text.substr(open + 1, text.size() - open - 2)), true};
}

}  // namespace backlash::record
