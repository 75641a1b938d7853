// SPDX-License-Identifier: BSD-3-Clause
// Amplitude probability distribution (APD): which share of the time a signal spends in each amplitude class.
//
//   class k covers [lower + k w, lower + (k+1) w),   w = (upper - lower) / classes,   k = 0 .. classes - 1
//   y_k = 100 N_k / N                          percent; N counts all samples, also those outside the range
//   skewness = 1/M sum ((y_k - mean) / s)^3    s with divisor M = classes (population standard deviation)
//   kurtosis = 1/M sum ((y_k - mean) / s)^4
//
// The moments are those of the class values y_k, not of the signal. They depend on the number of classes and
// on the range, which are therefore part of every curve's conditions. Sarkar, Ellis and Moore (1997), Eq. 14
// and Section 9.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::diagnosis {

struct ApdLayout {
  int classes = 0;              // >= 2
  double lower = 0, upper = 0;  // unit of the signal, lower < upper
  bool operator==(const ApdLayout& o) const {
    return classes == o.classes && lower == o.lower && upper == o.upper;
  }
};

ApdLayout read_apd_layout(const YamlReader& yaml);

class AmplitudeDistribution {
 public:
  /// Throws InvalidParameter for a layout outside its range.
  explicit AmplitudeDistribution(const ApdLayout& layout);

  /// One sample; a NaN counts as outside (above).
  void add(double value) {
    ++samples_;
    if (value < layout_.lower) {
      ++below_;
      return;
    }
    if (!(value < layout_.upper)) {
      ++above_;
      return;
    }
    auto k = static_cast<std::size_t>((value - layout_.lower) * per_width_);
    k -= value < borders_[k];  // the product may be rounded over a border
    k += value >= borders_[k + 1];
    ++counts_[k];
  }
  void merge(const AmplitudeDistribution& other);  ///< adds its samples; the layouts must be equal
  void clear();

  const ApdLayout& layout() const { return layout_; }
  const std::vector<std::size_t>& counts() const { return counts_; }
  std::size_t samples() const { return samples_; }
  std::size_t below() const { return below_; }  ///< samples under the range
  std::size_t above() const { return above_; }  ///< samples at or over its upper end
  double centre(int k) const;                   ///< middle of class k

  std::vector<double> percentages() const;  ///< y_k; all 0 without samples
  double skewness() const;                  ///< NaN where all classes are equal
  double kurtosis() const;                  ///< NaN where all classes are equal

 private:
  double standardised_moment(int order) const;

  ApdLayout layout_;
  double width_, per_width_;
  std::vector<double> borders_;  // between class k - 1 and k; the outermost are infinite
  std::vector<std::size_t> counts_;
  std::size_t samples_ = 0, below_ = 0, above_ = 0;
};

/// Mean and standard deviation of a signal, sample by sample, by sums of the differences from the first
/// sample: no division per sample, and nothing is lost to an offset.
class RunningMoments {
 public:
  void add(double value) {
    if (count_++ == 0) first_ = value;
    const double d = value - first_;
    sum_ += d;
    squares_ += d * d;
  }
  std::size_t count() const { return count_; }
  double mean() const { return count_ ? first_ + sum_ / static_cast<double>(count_) : 0; }
  double standard_deviation() const;  ///< population, 0 without samples

 private:
  std::size_t count_ = 0;
  double first_ = 0, sum_ = 0, squares_ = 0;
};

}  // namespace backlash::diagnosis
