// SPDX-License-Identifier: BSD-3-Clause
// Sine torque whose frequency goes up in steps, whole cycles at each: every step begins and ends at the bias,
// so that the torque is continuous.
#include <cmath>
#include <vector>

#include "backlash_diagnosis/simulation/excitation.h"
#include "checks.h"

namespace backlash::simulation {
namespace {

constexpr int kMostSteps = 100'000, kMostCycles = 1'000'000;  // choice: against slips of the pen
constexpr double kRounding = 1e-6;  // choice: of a step; decimal fractions are not exact

class SteppedSine : public Excitation {
 public:
  SteppedSine(double amplitude, std::vector<double> frequencies, int cycles, double bias)
      : amplitude_(amplitude), bias_(bias), frequencies_(std::move(frequencies)) {
    for (const double f : frequencies_) starts_.push_back(starts_.back() + cycles / f);
  }

  double torque(double t, long segment) const override {
    const std::size_t k = step(segment);
    const double s = t - double(turns(segment)) * period() - starts_[k];
    return bias_ + amplitude_ * std::sin(2 * M_PI * frequencies_[k] * s);
  }
  double segment_end(long segment) const override {
    return double(turns(segment)) * period() + starts_[step(segment) + 1];
  }
  double shortest_period(long segment) const override { return 1 / frequencies_[step(segment)]; }
  double period() const override { return starts_.back(); }

 private:
  long count() const { return static_cast<long>(frequencies_.size()); }
  long turns(long segment) const { return segment / count(); }
  std::size_t step(long segment) const { return static_cast<std::size_t>(segment % count()); }

  double amplitude_, bias_;
  std::vector<double> frequencies_;   // Hz
  std::vector<double> starts_ = {0};  // s, of each step; the last is the end
};

}  // namespace

std::unique_ptr<Excitation> stepped_sine_excitation(double amplitude, double start, double end, double step,
                                                    int cycles, double bias) {
  require("amplitude", amplitude, Range::any());
  require("start_frequency", start, Range::positive());
  require("end_frequency", end, Range::positive());
  require("step_frequency", step, Range::positive());
  require("cycles", cycles, Range::between(1, kMostCycles));
  require("bias", bias, Range::any());
  if (end < start) throw InvalidParameter("excitation.end_frequency", end, "must be >= start_frequency");
  const double steps = std::floor((end - start) / step + kRounding);
  if (steps >= kMostSteps)
    throw InvalidParameter("excitation.step_frequency", step,
                           "gives more than " + std::to_string(kMostSteps) + " frequencies");
  std::vector<double> frequencies;
  for (int k = 0; k <= steps; ++k) frequencies.push_back(start + k * step);
  return std::make_unique<SteppedSine>(amplitude, std::move(frequencies), cycles, bias);
}

}  // namespace backlash::simulation
