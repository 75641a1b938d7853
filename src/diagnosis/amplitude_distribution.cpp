// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/amplitude_distribution.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"

namespace backlash::diagnosis {

ApdLayout read_apd_layout(const YamlReader& yaml) {
  ApdLayout layout;
  layout.classes = static_cast<int>(yaml.integer("classes", 2, 100'000));
  layout.lower = yaml.number("lower", Range::any());
  layout.upper = yaml.number("upper", Range::any());
  if (!(layout.lower < layout.upper)) yaml.fail("upper", "must be greater than lower");
  return layout;
}

AmplitudeDistribution::AmplitudeDistribution(const ApdLayout& layout)
    : layout_(layout), width_((layout.upper - layout.lower) / layout.classes), per_width_(1 / width_) {
  if (layout.classes < 2) throw InvalidParameter("apd.classes", layout.classes, "must be >= 2");
  if (!(layout.lower < layout.upper))
    throw InvalidParameter("apd.upper", layout.upper, "must be greater than lower");
  if (!std::isfinite(layout.lower)) throw InvalidParameter("apd.lower", layout.lower, "must be finite");
  if (!std::isfinite(width_)) throw InvalidParameter("apd.upper", layout.upper, "must be finite");
  counts_.assign(layout.classes, 0);
  for (int k = 0; k <= layout.classes; ++k) borders_.push_back(layout.lower + k * width_);
  borders_.front() = -std::numeric_limits<double>::infinity();
  borders_.back() = std::numeric_limits<double>::infinity();
}

void AmplitudeDistribution::merge(const AmplitudeDistribution& other) {
  if (!(layout_ == other.layout_))
    throw InvalidParameter("apd", "another class layout", "must be equal to merge");
  for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] += other.counts_[k];
  samples_ += other.samples_;
  below_ += other.below_;
  above_ += other.above_;
}

void AmplitudeDistribution::clear() {
  counts_.assign(counts_.size(), 0);
  samples_ = below_ = above_ = 0;
}

double AmplitudeDistribution::centre(int k) const {
  return layout_.lower + (k + 0.5) * width_;
}

std::vector<double> AmplitudeDistribution::percentages() const {
  std::vector<double> y(counts_.size(), 0);
  if (samples_ == 0) return y;
  for (std::size_t k = 0; k < y.size(); ++k) y[k] = 100.0 * double(counts_[k]) / double(samples_);
  return y;
}

double AmplitudeDistribution::standardised_moment(int order) const {
  // Invariant under scaling, so the counts themselves will do.
  const double mean = double(samples_ - below_ - above_) / double(counts_.size());
  double variance = 0, moment = 0;
  for (const std::size_t count : counts_) {
    const double d = double(count) - mean;
    variance += d * d;
    moment += order == 3 ? d * d * d : d * d * d * d;
  }
  variance /= double(counts_.size());
  moment /= double(counts_.size());
  if (!(variance > 0)) return std::numeric_limits<double>::quiet_NaN();
  return moment / (order == 3 ? variance * std::sqrt(variance) : variance * variance);
}

double AmplitudeDistribution::skewness() const {
  return standardised_moment(3);
}
double AmplitudeDistribution::kurtosis() const {
  return standardised_moment(4);
}

double RunningMoments::standard_deviation() const {
  if (count_ == 0) return 0;
  const double n = static_cast<double>(count_), mean = sum_ / n;
  return std::sqrt(std::max(0.0, squares_ / n - mean * mean));
}

}  // namespace backlash::diagnosis
