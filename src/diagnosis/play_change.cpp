// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/play_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace backlash::diagnosis {
namespace {

constexpr int kStretches = 12,
              kLongStretches = 4;      // choice: 5 s and 15 s of the minute that a diagnoser keeps
constexpr double kStandardErrors = 6;  // theory: at ten degrees of freedom 1e-4 by chance, of some 50 looks
constexpr double kLeast = 0.1;         // of the larger play: choice, below it a baseline is worth taking
constexpr const char* kSlow = "gap_traverse";

struct Answer {
  int stretch;
  double value, error;  ///< rad, its own standard error
  double length;        ///< m, or NaN
};

struct Cut {
  int before = 0, after = 0;  ///< the last stretch before the change, the first after it
  double first = kNaN, second = kNaN, difference = 0;  ///< means; difference in standard errors
};

double mean_of(const std::vector<Answer>& all, std::size_t begin, std::size_t end) {
  double sum = 0;
  for (std::size_t i = begin; i < end; ++i) sum += all[i].value;
  return sum / double(end - begin);
}

/// The cut between answers where the means on either side differ most.
Cut best_cut(const std::vector<Answer>& all) {
  Cut best;
  for (std::size_t k = 1; k < all.size(); ++k) {
    const double first = mean_of(all, 0, k), second = mean_of(all, k, all.size());
    double squares = 0, own = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      squares += std::pow(all[i].value - (i < k ? first : second), 2);
      own += all[i].error * all[i].error / double(all.size());
    }
    const double scatter = all.size() > 2 ? squares / double(all.size() - 2) : 0;
    const double error = std::sqrt(std::max(scatter, own) * (1 / double(k) + 1 / double(all.size() - k)));
    const double difference = std::fabs(second - first) / error;
    if (difference > best.difference) best = {all[k - 1].stretch, all[k].stretch, first, second, difference};
  }
  return best;
}

bool is_change(const Cut& cut) {
  return cut.difference > kStandardErrors &&
         std::fabs(cut.second - cut.first) > kLeast * std::max(cut.first, cut.second);
}

/// By method, of the stretches on which it has one.
std::map<std::string, std::vector<Answer>> answers(const record::Record& record, int stretches,
                                                   const DiagnosisSettings& settings,
                                                   const MonitoringCurve* curve, const std::string& method) {
  std::map<std::string, std::vector<Answer>> all;
  const double begin = record.time.front(), length = (record.time.back() - begin) / stretches;
  for (int i = 0; i < stretches; ++i) {
    const double end = i + 1 == stretches ? HUGE_VAL : begin + (i + 1) * length;
    const record::Record part = record.slice(begin + i * length, end);
    if (part.time.empty()) continue;
    for (const Estimate& e : diagnose(part, settings, curve, std::nullopt, method).estimates) {
      if (e.status != Status::ok || !std::isfinite(e.angle_lower) || !std::isfinite(e.angle_upper)) continue;
      const double half = (e.angle_upper - e.angle_lower) / 2;
      all[e.method].push_back({i, e.backlash_angle,
                               std::sqrt(std::max(0.0, half * half - e.declared * e.declared)) / 2,
                               e.backlash});
    }
  }
  return all;
}

}  // namespace

std::optional<PlayChange> play_change(const record::Record& record, const DiagnosisSettings& settings,
                                      const MonitoringCurve* curve) {
  if (record.time.size() < 2) return std::nullopt;
  DiagnosisSettings quick = settings;
  quick.leave_out_waveform();
  quick.leave_out_gap_traverse();
  const double begin = record.time.front(), span = record.time.back() - begin;
  std::optional<PlayChange> found;
  double most = 0;
  bool answered = false;
  const auto look = [&](int stretches, const DiagnosisSettings& by, const std::string& method) {
    for (const auto& [name, all] : answers(record, stretches, by, curve, method)) {
      answered = answered || all.size() > 2;
      const Cut cut = best_cut(all);
      if (!is_change(cut) || cut.difference < most) continue;
      most = cut.difference;
      const double to_length = all.front().length / all.front().value;
      found = PlayChange{name,
                         begin + cut.before * span / stretches,
                         begin + (cut.after + 1) * span / stretches,
                         cut.first,
                         cut.second,
                         !std::isfinite(to_length)};
      if (!found->angular) found->before *= to_length, found->after *= to_length;
    }
  };
  look(kStretches, quick, "");
  if (!answered && settings.gap_traverse) look(kLongStretches, settings, kSlow);
  return found;
}

std::string plays_text(const PlayChange& change) {
  const char* const unit = change.angular ? "rad" : "m";
  return fmt::format("{} {:.4g} {} before, {:.4g} {} after", change.method, change.before, unit, change.after,
                     unit);
}

}  // namespace backlash::diagnosis
