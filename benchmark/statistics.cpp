// SPDX-License-Identifier: BSD-3-Clause
// Cost per sample of the streaming statistics, against the same numbers from Boost.Accumulators and
// Boost.Histogram: histogram of 60 classes and four moments of a signal, for whole periods of 1000 samples.
#include <benchmark/benchmark.h>

#include <boost/accumulators/accumulators.hpp>
#include <boost/accumulators/statistics/kurtosis.hpp>
#include <boost/accumulators/statistics/mean.hpp>
#include <boost/accumulators/statistics/skewness.hpp>
#include <boost/accumulators/statistics/stats.hpp>
#include <boost/accumulators/statistics/variance.hpp>
#include <boost/histogram.hpp>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/diagnosis/period_analyser.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"

namespace {

using namespace backlash;

constexpr double kRate = 1e4, kPeriod = 0.1;
constexpr int kSamples = 100'000;
const diagnosis::ApdLayout kLayout{60, -0.4, 0.4};

const std::vector<double>& signal() {
  static const std::vector<double> values = [] {
    std::vector<double> v;
    for (int k = 0; k < kSamples; ++k) v.push_back(0.3 * std::sin(0.0628 * k) + 0.05 * std::sin(1.7 * k));
    return v;
  }();
  return values;
}

void per_sample(benchmark::State& state) {
  state.counters["ns_per_sample"] =
      benchmark::Counter(double(state.iterations()) * kSamples * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void period_analyser(benchmark::State& state) {
  diagnosis::PeriodAnalyser analyser(kPeriod, kLayout);
  long k = 0;
  double sum = 0;
  for (auto _ : state)
    for (const double value : signal())
      if (const diagnosis::PeriodResult* period = analyser.add(double(k++) / kRate, value))
        sum += period->apd.skewness();
  benchmark::DoNotOptimize(sum);
  per_sample(state);
}

void boost_statistics(benchmark::State& state) {
  using namespace boost::accumulators;
  using Moments = accumulator_set<double, stats<tag::mean, tag::variance, tag::skewness, tag::kurtosis>>;
  auto histogram = boost::histogram::make_histogram(
      boost::histogram::axis::regular<>(kLayout.classes, kLayout.lower, kLayout.upper));
  Moments moments;
  long k = 0;
  double sum = 0;
  for (auto _ : state)
    for (const double value : signal()) {
      histogram(value);
      moments(value);
      if (++k % long(kPeriod * kRate) != 0) continue;
      sum += skewness(moments) + kurtosis(moments) + histogram.at(0);
      histogram.reset();
      moments = Moments();
    }
  benchmark::DoNotOptimize(sum);
  per_sample(state);
}

/// All that the diagnoser does with a sample of four channels until its period ends.
void sample_stream(benchmark::State& state) {
  diagnosis::StreamSettings settings;
  settings.apd.emplace();
  settings.apd->period = kPeriod;
  settings.apd->layout = kLayout;
  settings.apd->signal = record::Channel::sensor_torque;
  settings.keep = 5;
  diagnosis::SampleStream stream(settings);
  record::ChannelValues values;
  values.fill(std::nan(""));
  long k = 0, periods = 0;
  for (auto _ : state)
    for (const double value : signal()) {
      values[std::size_t(record::Channel::motor_torque)] =
          values[std::size_t(record::Channel::motor_position)] = value;
      values[std::size_t(record::Channel::motor_velocity)] =
          values[std::size_t(record::Channel::sensor_torque)] = value;
      periods += stream.add(double(k++) / kRate, values) != nullptr;
    }
  benchmark::DoNotOptimize(periods);
  per_sample(state);
}

BENCHMARK(period_analyser)->Name("statistics/period_analyser");
BENCHMARK(boost_statistics)->Name("statistics/boost");
BENCHMARK(sample_stream)->Name("statistics/sample_stream");

}  // namespace

BENCHMARK_MAIN();
