#include "backlash_diagnosis/diagnosis/verdict.h"

#include <cmath>
#include <limits>
#include <sstream>

namespace backlash {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_bound(const Estimate& e) {
  return e.status == Status::above_range && std::isfinite(e.angle_lower);
}

/// Upper end of the interval; infinite for a lower bound.
double upper(const Estimate& e) {
  return std::isnan(e.angle_upper) ? kInfinity : e.angle_upper;
}

double width(const Estimate& e) {
  return std::isnan(e.angle_lower) ? kInfinity : upper(e) - e.angle_lower;
}

bool overlap(const Estimate& a, const Estimate& b) {
  return a.angle_lower <= upper(b) && b.angle_lower <= upper(a);
}

/// Compares the others with the chosen estimate.
std::string agreement(const std::vector<Estimate>& estimates, int chosen) {
  std::string against;
  int sound = 0;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    if (estimates[i].status != Status::ok && !is_bound(estimates[i])) continue;
    ++sound;
    if (overlap(estimates[i], estimates[chosen])) continue;
    against += (against.empty() ? "" : ", ") + estimates[i].method;
  }
  if (!against.empty()) return "disagree: " + against;
  return sound == 1 ? "single" : "agree";
}

Grade grade_of(double value, const Limits& limits) {
  if (value >= limits.stop) return Grade::stop;
  if (value >= limits.service) return Grade::service;
  return value >= limits.watch ? Grade::watch : Grade::good;
}

/// Index of the sound estimate with the narrowest interval, else of one that at least gives a lower bound,
/// else -1.
int choose(const std::vector<Estimate>& estimates) {
  int best = -1;
  for (std::size_t i = 0; i < estimates.size(); ++i)
    if (estimates[i].status == Status::ok && (best < 0 || width(estimates[i]) < width(estimates[best])))
      best = static_cast<int>(i);
  for (std::size_t i = 0; i < estimates.size() && best < 0; ++i)
    if (is_bound(estimates[i])) best = static_cast<int>(i);
  return best;
}

}  // namespace

const char* to_string(Grade grade) {
  switch (grade) {
    case Grade::good:
      return "good";
    case Grade::watch:
      return "watch";
    case Grade::service:
      return "service";
    case Grade::stop:
      return "stop";
    case Grade::cannot_tell:
      break;
  }
  return "cannot_tell";
}

Limits read_limits(const YamlReader& yaml) {
  Limits limits;
  limits.angular = yaml.has("backlash_angle");
  const YamlReader values = yaml.map(limits.angular ? "backlash_angle" : "backlash");
  limits.watch = values.number("watch", Range::positive());
  limits.service = values.number("service", Range::positive());
  limits.stop = values.number("stop", Range::positive());
  if (!(limits.watch <= limits.service && limits.service <= limits.stop))
    values.fail("service", "limits must not decrease from watch over service to stop");
  return limits;
}

Verdict combine(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits,
                const std::optional<Baseline>& baseline) {
  Verdict verdict;
  verdict.estimate = choose(estimates);
  if (verdict.estimate < 0) {
    verdict.agreement = "none";
    verdict.message = "cannot tell";
    for (const Estimate& e : estimates)
      verdict.message += "; " + e.method + ": " + to_string(e.status) + " (" + e.message + ")";
    return verdict;
  }
  const Estimate& chosen = estimates[verdict.estimate];
  const bool bound_only = chosen.status != Status::ok;
  verdict.agreement = bound_only ? "single" : agreement(estimates, verdict.estimate);
  const bool angular = limits ? limits->angular : std::isnan(chosen.backlash) && std::isnan(chosen.lower);
  const double value = angular ? (bound_only ? chosen.angle_lower : chosen.backlash_angle)
                               : (bound_only ? chosen.lower : chosen.backlash);
  if (baseline) verdict.growth = value - (angular ? baseline->backlash_angle : baseline->backlash);
  const double graded = baseline && std::isfinite(verdict.growth) ? verdict.growth : value;
  if (!std::isfinite(graded))
    verdict.grade = Grade::cannot_tell;
  else if (limits)
    verdict.grade = grade_of(graded, *limits);
  else
    verdict.grade = bound_only ? Grade::cannot_tell : Grade::good;
  if (bound_only && verdict.grade == Grade::good) verdict.grade = Grade::cannot_tell;
  std::ostringstream text;
  text.precision(4);
  text << to_string(verdict.grade) << ": backlash " << (bound_only ? "at least " : "") << value
       << (angular ? " rad" : " m") << " by " << chosen.method;
  if (std::isfinite(verdict.growth)) text << ", grown by " << verdict.growth << " since the baseline";
  if (verdict.agreement != "single") text << "; " << verdict.agreement;
  verdict.message = text.str();
  return verdict;
}

}  // namespace backlash
