// SPDX-License-Identifier: BSD-3-Clause
// Excitations whose torque is one formula of time, and that from outside.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/simulation/excitation.h"
#include "checks.h"

namespace backlash::simulation {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Greatest common divisor [Hz] by Euclid's algorithm; remainders below 1e-6 Hz count as none.
double common_divisor(double a, double b) {
  if (a < b) std::swap(a, b);
  while (b > 1e-6) a = std::exchange(b, std::fabs(std::remainder(a, b)));
  return a;
}

class Constant : public Excitation {
 public:
  explicit Constant(double torque) : torque_(torque) {}
  double torque(double, long) const override { return torque_; }
  double segment_end(long) const override { return kNever; }

 private:
  double torque_;
};

class External : public Excitation {
 public:
  double torque(double, long) const override { return torque_; }
  double segment_end(long) const override { return kNever; }
  bool set_torque(double torque) override {
    require("torque", torque, Range::any());
    torque_ = torque;
    return true;
  }

 private:
  double torque_ = 0;
};

class Square : public Excitation {
 public:
  Square(double amplitude, double frequency, double bias)
      : amplitude_(amplitude), frequency_(frequency), bias_(bias) {}
  double torque(double, long segment) const override {
    return bias_ + (segment % 2 == 0 ? amplitude_ : -amplitude_);
  }
  double segment_end(long segment) const override { return double(segment + 1) / (2 * frequency_); }
  double period() const override { return 1 / frequency_; }

 private:
  double amplitude_, frequency_, bias_;
};

class MultiSine : public Excitation {
 public:
  MultiSine(std::vector<SineLine> lines, double bias) : lines_(std::move(lines)), bias_(bias) {}
  double torque(double t, long) const override {
    double sum = bias_;
    for (const SineLine& line : lines_)
      sum += line.amplitude * std::sin(2 * M_PI * line.frequency * t + line.phase);
    return sum;
  }
  double segment_end(long) const override { return kNever; }
  double shortest_period(long) const override {
    double highest = 0;
    for (const SineLine& line : lines_) highest = std::max(highest, line.frequency);
    return 1 / highest;
  }
  double period() const override {
    if (lines_.size() == 1) return 1 / lines_.front().frequency;
    double common = 0;
    for (const SineLine& line : lines_) common = common_divisor(common, line.frequency);
    return common >= 1e-3 ? 1 / common : 0;
  }

 private:
  std::vector<SineLine> lines_;
  double bias_;
};

class RandomTorque : public MultiSine {
 public:
  using MultiSine::MultiSine;
  double period() const override { return 0; }
};

class Chirp : public Excitation {
 public:
  Chirp(double amplitude, double start, double end, double duration, double bias)
      : amplitude_(amplitude),
        start_(start),
        rate_((end - start) / duration),
        duration_(duration),
        shortest_(1 / std::max(start, end)),
        bias_(bias) {}
  double torque(double t, long segment) const override {
    const double s = t - double(segment) * duration_;
    return bias_ + amplitude_ * std::sin(2 * M_PI * (start_ + 0.5 * rate_ * s) * s);
  }
  double segment_end(long segment) const override { return double(segment + 1) * duration_; }
  double shortest_period(long) const override { return shortest_; }
  double period() const override { return duration_; }

 private:
  double amplitude_, start_, rate_, duration_, shortest_, bias_;
};

}  // namespace

std::unique_ptr<Excitation> constant_excitation(double torque) {
  require("torque", torque, Range::any());
  return std::make_unique<Constant>(torque);
}

std::unique_ptr<Excitation> square_excitation(double amplitude, double frequency, double bias) {
  require("amplitude", amplitude, Range::any());
  require("frequency", frequency, Range::positive());
  require("bias", bias, Range::any());
  return std::make_unique<Square>(amplitude, frequency, bias);
}

std::unique_ptr<Excitation> sine_excitation(double amplitude, double frequency, double bias) {
  return multi_sine_excitation({{amplitude, frequency, 0}}, bias);
}

std::unique_ptr<Excitation> chirp_excitation(double amplitude, double start, double end, double duration,
                                             double bias) {
  require("amplitude", amplitude, Range::any());
  require("start_frequency", start, Range::positive());
  require("end_frequency", end, Range::positive());
  require("duration", duration, Range::positive());
  require("bias", bias, Range::any());
  return std::make_unique<Chirp>(amplitude, start, end, duration, bias);
}

std::unique_ptr<Excitation> multi_sine_excitation(std::vector<SineLine> lines, double bias) {
  for (const SineLine& line : lines) {
    require("amplitude", line.amplitude, Range::any());
    require("frequency", line.frequency, Range::positive());
    require("phase", line.phase, Range::any());
  }
  require("bias", bias, Range::any());
  return std::make_unique<MultiSine>(std::move(lines), bias);
}

std::unique_ptr<Excitation> random_excitation(double rms, double lower, double upper, int lines,
                                              std::uint64_t seed, double bias) {
  require("rms", rms, Range::not_negative());
  require("lower_frequency", lower, Range::positive());
  require("upper_frequency", upper, Range::positive());
  require("lines", lines, Range::between(kFewestLines, kMostLines));
  require("bias", bias, Range::any());
  if (!(upper > lower))
    throw InvalidParameter("excitation.upper_frequency", upper, "must be > lower_frequency");
  Random random(seed);
  std::vector<SineLine> sines;
  for (int k = 0; k < lines; ++k) {
    const double frequency = lower + (upper - lower) * (k + random.uniform()) / lines;
    sines.push_back({rms * std::sqrt(2.0 / lines), frequency, 2 * M_PI * random.uniform()});
  }
  return std::make_unique<RandomTorque>(std::move(sines), bias);
}

std::unique_ptr<Excitation> external_excitation() {
  return std::make_unique<External>();
}

}  // namespace backlash::simulation
