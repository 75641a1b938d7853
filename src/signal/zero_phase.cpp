// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/zero_phase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "backlash_diagnosis/base/error.h"

namespace backlash::signal {
namespace {

/// A section b (1 + z^-1)^2 / (1 + a1 z^-1 + a2 z^-2), gain 1 at rest.
struct Section {
  double gain, a1, a2;
};

using Filter = std::array<Section, 2>;  // order 4

constexpr std::size_t kLanes = 8;  // signals that are filtered together

/// Bilinear transform of the Butterworth poles at 5/8 pi and 7/8 pi.
Filter butterworth(double interval, double cutoff) {
  Filter filter;
  const double w = std::tan(M_PI * cutoff * interval);
  for (std::size_t i = 0; i < filter.size(); ++i) {
    const double damping = -2 * std::cos(M_PI * (5 + 2.0 * double(i)) / 8);
    const double norm = 1 + damping * w + w * w;
    filter[i] = {w * w / norm, 2 * (w * w - 1) / norm, (1 - damping * w + w * w) / norm};
  }
  return filter;
}

/// Signals side by side, value by value: a section waits for its own last value, and meanwhile does the
/// others.
template <std::size_t Lanes>
using Values = std::array<double, Lanes>;

template <std::size_t Lanes>
class Running {
 public:
  /// As if `first` had been applied forever.
  Running(const Section& section, const Values<Lanes>& first) : section_(section) {
    for (std::size_t i = 0; i < Lanes; ++i) {
      s2_[i] = (section.gain - section.a2) * first[i];
      s1_[i] = (2 * section.gain - section.a1) * first[i] + s2_[i];
    }
  }

  void next(Values<Lanes>& x) {
    for (std::size_t i = 0; i < Lanes; ++i) {
      const double y = section_.gain * x[i] + s1_[i];
      s1_[i] = 2 * section_.gain * x[i] - section_.a1 * y + s2_[i];
      s2_[i] = section_.gain * x[i] - section_.a2 * y;
      x[i] = y;
    }
  }

 private:
  Section section_;
  Values<Lanes> s1_, s2_;
};

template <std::size_t Lanes>
void run(const Filter& filter, std::vector<Values<Lanes>>& values) {
  Running<Lanes> first(filter[0], values.front()), second(filter[1], values.front());
  for (Values<Lanes>& x : values) {
    first.next(x);
    second.next(x);
  }
}

template <std::size_t Lanes>
void run_both_ways(const Filter& filter, std::vector<Values<Lanes>>& values) {
  for (int pass = 0; pass < 2; ++pass) {
    run(filter, values);
    std::reverse(values.begin(), values.end());
  }
}

/// Continued at both ends by point reflection.
template <std::size_t Lanes>
class Padded {
 public:
  void filter(const Filter& filter, Eigen::Index most_pad, Eigen::Ref<Eigen::MatrixXd> columns) {
    const Eigen::Index n = columns.rows(), pad = std::min(n - 1, most_pad);
    values_.resize(static_cast<std::size_t>(n + 2 * pad));
    const auto at = [&](Eigen::Index k) -> Values<Lanes>& { return values_[static_cast<std::size_t>(k)]; };
    for (std::size_t i = 0; i < Lanes; ++i) {
      const Eigen::Ref<const Eigen::VectorXd> column = columns.col(static_cast<Eigen::Index>(i));
      for (Eigen::Index k = 0; k < n; ++k) at(pad + k)[i] = column[k];
      for (Eigen::Index k = 1; k <= pad; ++k) {
        at(pad - k)[i] = 2 * column[0] - column[k];
        at(pad + n - 1 + k)[i] = 2 * column[n - 1] - column[n - 1 - k];
      }
    }
    run_both_ways(filter, values_);
    for (std::size_t i = 0; i < Lanes; ++i)
      for (Eigen::Index k = 0; k < n; ++k) columns.col(static_cast<Eigen::Index>(i))[k] = at(pad + k)[i];
  }

 private:
  std::vector<Values<Lanes>> values_;
};

void require_interval(double interval) {
  if (!(interval > 0) || !std::isfinite(interval))
    throw InvalidParameter("interval", interval, "must be > 0 s");
}

}  // namespace

std::vector<double> low_pass(const std::vector<double>& values, double interval, double cutoff) {
  std::vector<double> out = values;
  low_pass_columns(Eigen::Map<Eigen::MatrixXd>(out.data(), static_cast<Eigen::Index>(out.size()), 1),
                   interval, cutoff);
  return out;
}

void low_pass_columns(Eigen::Ref<Eigen::MatrixXd> columns, double interval, double cutoff) {
  require_interval(interval);
  if (!(cutoff > 0 && cutoff < 0.5 / interval))
    throw InvalidParameter("cutoff", cutoff, "must be > 0 and below half of the sampling rate");
  if (columns.rows() < 2) return;
  const Filter filter = butterworth(interval, cutoff);
  const auto pad = static_cast<Eigen::Index>(std::ceil(3 / (2 * M_PI * cutoff * interval) * 4));
  // Kept: new memory each time would take as long as the filter.
  static thread_local Padded<kLanes> several;
  static thread_local Padded<1> one;
  Eigen::Index k = 0;
  constexpr auto lanes = static_cast<Eigen::Index>(kLanes);
  for (; k + lanes <= columns.cols(); k += lanes) several.filter(filter, pad, columns.middleCols(k, lanes));
  for (; k < columns.cols(); ++k) one.filter(filter, pad, columns.middleCols(k, 1));
}

std::vector<double> derivative(const std::vector<double>& values, double interval) {
  require_interval(interval);
  const std::size_t n = values.size();
  if (n < 3) throw InvalidParameter("derivative", double(n), "needs at least three values");
  std::vector<double> rate(n);
  for (std::size_t k = 1; k + 1 < n; ++k) rate[k] = (values[k + 1] - values[k - 1]) / (2 * interval);
  rate[0] = (-3 * values[0] + 4 * values[1] - values[2]) / (2 * interval);
  rate[n - 1] = (3 * values[n - 1] - 4 * values[n - 2] + values[n - 3]) / (2 * interval);
  return rate;
}

std::vector<double> delayed(const std::vector<double>& values, double samples) {
  const long n = static_cast<long>(values.size());
  const double whole = std::floor(-samples), t = -samples - whole;
  const auto between = [t](double a, double b, double c, double d) {
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  };
  const auto shift = static_cast<long>(whole);
  const long begin = std::clamp(1 - shift, 0L, n), end = std::clamp(n - 2 - shift, begin, n);
  std::vector<double> out(values.size());
  const auto near_an_end = [&](long k) {
    const auto at = [&](long j) { return values[std::clamp(k + shift + j, 0L, n - 1)]; };
    out[k] = between(at(-1), at(0), at(1), at(2));
  };
  for (long k = 0; k < begin; ++k) near_an_end(k);
  for (long k = begin; k < end; ++k) {
    const double* const x = &values[k + shift];
    out[k] = between(x[-1], x[0], x[1], x[2]);
  }
  for (long k = end; k < n; ++k) near_an_end(k);
  return out;
}

}  // namespace backlash::signal
