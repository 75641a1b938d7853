// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/amplitude_distribution.h"

namespace backlash::diagnosis {
namespace {

const double kInfinity = std::numeric_limits<double>::infinity();

/// A distribution over [0, classes) with the given number of samples per class.
AmplitudeDistribution with_counts(const std::vector<int>& counts) {
  AmplitudeDistribution apd({static_cast<int>(counts.size()), 0, static_cast<double>(counts.size())});
  for (std::size_t k = 0; k < counts.size(); ++k)
    for (int i = 0; i < counts[k]; ++i) apd.add(k + 0.5);
  return apd;
}

std::size_t class_of(const ApdLayout& layout, double value) {
  AmplitudeDistribution apd(layout);
  apd.add(value);
  for (std::size_t k = 0; k < apd.counts().size(); ++k)
    if (apd.counts()[k] == 1) return k;
  return apd.counts().size();
}

// Printed to four decimals.
constexpr double kPrinted = 0.5e-4;

const std::vector<int> kTwoPeaks = {0, 0, 0, 4, 40, 4, 4, 40, 8, 0, 0, 0};
const std::vector<int> kSpread = {2, 4, 8, 12, 16, 14, 14, 14, 8, 5, 2, 1};

TEST(AmplitudeDistribution, MomentsOfTheWorkedExample) {
  EXPECT_NEAR(with_counts(kTwoPeaks).skewness(), 1.6785, kPrinted);
  EXPECT_NEAR(with_counts(kTwoPeaks).kurtosis(), 3.9867, kPrinted);
  EXPECT_NEAR(with_counts(kSpread).skewness(), 0.0142, kPrinted);
  EXPECT_NEAR(with_counts(kSpread).kurtosis(), 1.4438, kPrinted);
}

TEST(AmplitudeDistribution, MomentsDependOnTheClassLayout) {
  std::vector<int> appended = kTwoPeaks;
  appended.resize(20, 0);
  EXPECT_NEAR(with_counts(appended).skewness(), 2.5200, kPrinted);
  EXPECT_NEAR(with_counts({0, 4, 44, 44, 8, 0}).skewness(), 0.6480, kPrinted);
}

TEST(AmplitudeDistribution, MomentsDoNotDependOnScaleAndOrder) {
  std::vector<int> scaled, reversed(kTwoPeaks.rbegin(), kTwoPeaks.rend());
  for (const int count : kTwoPeaks) scaled.push_back(7 * count);
  const double skewness = with_counts(kTwoPeaks).skewness(), kurtosis = with_counts(kTwoPeaks).kurtosis();
  // 1e-12: rounding of a dozen sums of squares and cubes.
  for (const auto& counts : {scaled, reversed}) {
    EXPECT_NEAR(with_counts(counts).skewness(), skewness, 1e-12);
    EXPECT_NEAR(with_counts(counts).kurtosis(), kurtosis, 1e-12);
  }
}

TEST(AmplitudeDistribution, BoundsOfSkewness) {
  for (const int m : {3, 5, 12, 25, 60, 1000}) {
    std::vector<int> one(m, 0), two(m, 0);
    one[m / 2] = 13;
    two[0] = two[m - 1] = 13;
    // 1e-12 of the value: rounding.
    EXPECT_NEAR(with_counts(one).skewness(), (m - 2) / std::sqrt(m - 1.0), 1e-12 * m) << m;
    EXPECT_NEAR(with_counts(two).skewness(), (m - 4) / std::sqrt(2.0 * (m - 2)), 1e-12 * m) << m;
  }
}

TEST(AmplitudeDistribution, NoMomentsWhereAllClassesAreEqual) {
  EXPECT_TRUE(std::isnan(with_counts({0, 0, 0}).skewness()));
  EXPECT_TRUE(std::isnan(with_counts({5, 5, 5}).skewness()));
  EXPECT_TRUE(std::isnan(with_counts({5, 5, 5}).kurtosis()));
}

TEST(AmplitudeDistribution, SamplesOutsideTheRangeCountInThePercentagesOnly) {
  AmplitudeDistribution apd({2, -1, 1});
  for (const double value : {-0.5, 0.5, 0.5, -1.5, 1.0, 2.0, kInfinity, -kInfinity}) apd.add(value);
  apd.add(std::nan(""));
  EXPECT_EQ(apd.samples(), 9u);
  EXPECT_EQ(apd.below(), 2u);
  EXPECT_EQ(apd.above(), 4u);  // the upper end does not belong to the range; NaN counts as above
  EXPECT_DOUBLE_EQ(apd.percentages()[0], 100.0 / 9);
  EXPECT_DOUBLE_EQ(apd.percentages()[1], 200.0 / 9);
}

TEST(AmplitudeDistribution, NoSamplesNoPercentages) {
  EXPECT_EQ(AmplitudeDistribution({3, 0, 1}).percentages(), (std::vector<double>{0, 0, 0}));
}

TEST(AmplitudeDistribution, BordersBelongToTheClassAbove) {
  for (const ApdLayout& layout : {ApdLayout{60, -0.4, 0.4}, ApdLayout{50, -0.2, 0.2}, ApdLayout{7, -1, 1},
                                  ApdLayout{100, -3, 5}, ApdLayout{3, 0, 1}}) {
    const double width = (layout.upper - layout.lower) / layout.classes;
    for (int k = 0; k < layout.classes; ++k) {
      const double border = layout.lower + k * width;
      EXPECT_EQ(class_of(layout, border), static_cast<std::size_t>(k)) << layout.classes;
      const double under = std::nextafter(border, -kInfinity);
      if (k == 0) continue;
      EXPECT_EQ(class_of(layout, under), static_cast<std::size_t>(k - 1)) << layout.classes;
    }
    const auto last = static_cast<std::size_t>(layout.classes - 1);
    EXPECT_EQ(class_of(layout, std::nextafter(layout.upper, -kInfinity)), last);
  }
}

TEST(AmplitudeDistribution, CentresLieInTheMiddle) {
  const AmplitudeDistribution apd({4, -1, 1});
  EXPECT_DOUBLE_EQ(apd.centre(0), -0.75);
  EXPECT_DOUBLE_EQ(apd.centre(3), 0.75);
}

TEST(AmplitudeDistribution, SineFollowsTheArcsineLaw) {
  const int classes = 20, samples = 100000;
  AmplitudeDistribution apd({classes, -1, 1});
  for (int i = 0; i < samples; ++i) apd.add(std::sin(2 * M_PI * (i + 0.5) / samples));
  const auto y = apd.percentages();
  const auto law = [](double x) { return 0.5 + std::asin(std::min(1.0, x)) / M_PI; };
  for (int k = 0; k < classes; ++k) {
    const double share = law(-1 + 2.0 * (k + 1) / classes) - law(-1 + 2.0 * k / classes);
    // Each class is crossed on one rising and one falling stretch; each may gain or lose a sample at either
    // end.
    EXPECT_NEAR(y[k], 100 * share, 100 * 4.0 / samples) << k;
  }
}

TEST(AmplitudeDistribution, TriangleIsUniform) {
  const int classes = 16, samples = 64000;
  AmplitudeDistribution apd({classes, -1, 1});
  for (int i = 0; i < samples; ++i) apd.add(4 * std::fabs((i + 0.5) / samples - 0.5) - 1);
  for (const double y : apd.percentages())
    EXPECT_NEAR(y, 100.0 / classes, 100 * 4.0 / samples);  // as for the sine
}

TEST(AmplitudeDistribution, MergeIsTheSameAsAddingAll) {
  AmplitudeDistribution first({5, 0, 1}), second({5, 0, 1}), all({5, 0, 1});
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const double value = random.uniform(-0.2, 1.2);
    (i % 3 ? first : second).add(value);
    all.add(value);
  }
  first.merge(second);
  EXPECT_EQ(first.counts(), all.counts());
  EXPECT_EQ(first.samples(), all.samples());
  EXPECT_EQ(first.below(), all.below());
  EXPECT_EQ(first.above(), all.above());
  EXPECT_THROW(first.merge(AmplitudeDistribution({6, 0, 1})), InvalidParameter);
  first.clear();
  EXPECT_EQ(first.samples() + first.below() + first.above(), 0u);
  EXPECT_EQ(first.counts(), std::vector<std::size_t>(5, 0));
}

TEST(AmplitudeDistribution, RefusesLayoutsOutsideTheirRange) {
  for (const ApdLayout& layout :
       {ApdLayout{1, 0, 1}, ApdLayout{0, 0, 1}, ApdLayout{-3, 0, 1}, ApdLayout{5, 1, 1}, ApdLayout{5, 1, 0},
        ApdLayout{5, -kInfinity, 1}, ApdLayout{5, 0, kInfinity}, ApdLayout{5, std::nan(""), 1},
        ApdLayout{5, 0, std::nan("")}})
    EXPECT_THROW(AmplitudeDistribution{layout}, InvalidParameter) << layout.classes << ' ' << layout.lower;
}

TEST(ApdLayout, ReadsAndNamesTheKey) {
  const auto read = [](const std::string& text) {
    return read_apd_layout(YamlReader::from_text(text, "rig.yaml"));
  };
  EXPECT_EQ(read("{classes: 60, lower: -0.4, upper: 0.4}"), (ApdLayout{60, -0.4, 0.4}));
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"{classes: 1, lower: 0, upper: 1}", "classes"},
      {"{classes: 2.5, lower: 0, upper: 1}", "classes"},
      {"{lower: 0, upper: 1}", "classes"},
      {"{classes: 5, lower: 1, upper: 1}", "upper"},
      {"{classes: 5, lower: 0, upper: .inf}", "upper"},
      {"{classes: 5, lower: low, upper: 1}", "lower"},
      {"{classes: 5, upper: 1}", "lower"}};
  for (const auto& [text, key] : cases) try {
      read(text);
      ADD_FAILURE() << text << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
}

TEST(RunningMoments, AgreeWithTwoPasses) {
  RunningMoments moments;
  EXPECT_EQ(moments.standard_deviation(), 0);
  Random random(2);
  std::vector<double> values(5000);
  double sum = 0, squares = 0;
  // A large mean is where the naive formula fails.
  for (double& v : values) sum += v = 1e6 + 3 * random.normal();
  for (const double v : values) squares += (v - sum / values.size()) * (v - sum / values.size());
  for (const double v : values) moments.add(v);
  EXPECT_EQ(moments.count(), values.size());
  EXPECT_NEAR(moments.mean(), sum / values.size(), 1e-8);  // rounding of sums of 5000 numbers of size 1e6
  EXPECT_NEAR(moments.standard_deviation(), std::sqrt(squares / values.size()), 1e-6);
}

TEST(RunningMoments, LoseNothingToAnOffset) {
  RunningMoments moments;
  for (int k = 0; k < 1000; ++k) moments.add(1e6 + 1e-3 * std::sin(2 * M_PI * k / 1000));
  EXPECT_NEAR(moments.mean(), 1e6, 1e-9);  // roundings of 1e6
  EXPECT_NEAR(moments.standard_deviation(), 1e-3 / std::sqrt(2), 1e-9);
}

}  // namespace
}  // namespace backlash::diagnosis
