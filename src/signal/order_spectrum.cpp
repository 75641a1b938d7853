// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/order_spectrum.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numeric>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/spectrum.h"

namespace backlash::signal {
namespace {

using Complex = std::complex<double>;

constexpr double kLines = 8;  // choice: per resolution: between two lines 1.3 % of a peak's square is lost
constexpr double kExact = 8;  // choice: resolutions, below which lines are solved exactly
constexpr std::size_t kFewest = 16;  // choice: samples
constexpr double kLeastShare = 0.1;  // choice: of the samples, that count at the largest order
constexpr double kBand = M_SQRT2;    // choice: between the orders at which samples drop out together
constexpr double kOversampling = 4;  // theory: grid of positions per shortest half wave: images below 4 %
constexpr std::size_t kLargestGrid = std::size_t(1) << 21;  // choice (time, memory): values
constexpr double kIndependent = 1e-6;  // theory: least pivot of two waves beside what is fitted as well

/// The samples that count at least at order 0.
struct Counted {
  std::vector<std::size_t> at;
  double low = 0, travel = 0;
};

Counted counted(const OrderSamples& s) {
  Counted c;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t k = 0; k < s.value.size(); ++k) {
    if (s.carrier[k] == 0 || !(s.highest[k] > 0)) continue;
    c.at.push_back(k);
    low = std::min(low, s.position[k]), high = std::max(high, s.position[k]);
  }
  c.low = low, c.travel = c.at.empty() ? 0 : high - low;
  return c;
}

/// The order up to which kLeastShare of the samples count.
double highest_order(const OrderSamples& s, const Counted& c) {
  std::vector<double> highest;
  for (const std::size_t k : c.at) highest.push_back(s.highest[k]);
  const auto place = highest.begin() + std::ptrdiff_t((1 - kLeastShare) * double(highest.size() - 1));
  std::nth_element(highest.begin(), place, highest.end());
  return *place;
}

/// What waves of one order take away of the samples that count there.
struct Line {
  double taken = 0, total = 0;
};

Line exact_line(const OrderSamples& s, const Counted& c, double order, const Eigen::MatrixXd& known) {
  double ss = 0, cc = 0, sc = 0, total = 0;
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  Eigen::MatrixXd on_known = Eigen::MatrixXd::Zero(known.cols(), 2);
  for (const std::size_t k : c.at) {
    if (s.highest[k] < order) continue;
    const double angle = order * (s.position[k] - c.low);
    const double sine = s.carrier[k] * std::sin(angle), cosine = s.carrier[k] * std::cos(angle);
    ss += sine * sine, cc += cosine * cosine, sc += sine * cosine;
    right += s.value[k] * Eigen::Vector2d(sine, cosine);
    total += s.value[k] * s.value[k];
    if (known.cols() == 0) continue;
    on_known.col(0) += sine * known.row(Eigen::Index(k)).transpose();
    on_known.col(1) += cosine * known.row(Eigen::Index(k)).transpose();
  }
  ss -= on_known.col(0).squaredNorm(), cc -= on_known.col(1).squaredNorm();
  sc -= on_known.col(0).dot(on_known.col(1));
  const double determinant = ss * cc - sc * sc;
  if (!(determinant > kIndependent * std::pow(ss + cc, 2))) return {0, total};
  return {(cc * right[0] * right[0] - 2 * sc * right[0] * right[1] + ss * right[1] * right[1]) / determinant,
          total};
}

/// Sums of samples over a grid of positions, and their transform.
class Grid {
 public:
  /// Lines `step` apart [1/rad] up to `largest`.
  Grid(double step, double largest) {
    size_ = 1;
    while (double(size_) < 2 * kOversampling * largest / step) size_ *= 2;
    width_ = 2 * M_PI / (step * double(size_));
    sums_.assign(size_, 0.0);
  }

  /// Shared between the two nearest places.
  void add(double position, double value) {
    const double x = position / width_;
    const auto at = std::size_t(x);
    const double later = x - double(at);
    sums_[at % size_] += (1 - later) * value;
    sums_[(at + 1) % size_] += later * value;
  }

  /// Sum of value * exp(-j n position) at the lines, with the loss of sharing taken back.
  std::vector<Complex> lines() const {
    std::vector<Complex> all = fourier_transform(sums_);
    for (std::size_t k = 1; k < all.size(); ++k) {
      const double half = M_PI * double(k) / double(size_);
      all[k] *= std::pow(half / std::sin(half), 2);
    }
    return all;
  }

 private:
  std::size_t size_;
  double width_;
  std::vector<double> sums_;
};

/// Lines `begin` to `end` of the grid of orders, the same samples for all: those that count at the last.
void fill_band(const OrderSamples& s, const Counted& c, std::size_t begin, std::size_t end, double largest,
               OrderSpectrum& spectrum) {
  Grid grid(spectrum.step, largest);
  double total = 0, power = 0;
  const double last = spectrum.first + double(end - 1) * spectrum.step;
  for (const std::size_t k : c.at) {
    if (s.highest[k] < last) continue;
    grid.add(s.position[k] - c.low, s.carrier[k] * s.value[k]);
    total += s.value[k] * s.value[k], power += s.carrier[k] * s.carrier[k];
  }
  if (!(power > 0) || !(total > 0)) return;
  const std::vector<Complex> lines = grid.lines();
  const auto shift = std::size_t(std::lround(spectrum.first / spectrum.step));
  for (std::size_t i = begin; i < end; ++i) {
    spectrum.taken[i] = 2 * std::norm(lines[shift + i]) / power;
    spectrum.share[i] = spectrum.taken[i] / total;
  }
}

}  // namespace

OrderSpectrum order_spectrum(const OrderSamples& s, double largest, const Eigen::MatrixXd& known) {
  OrderSpectrum spectrum;
  const Counted c = counted(s);
  if (c.at.size() < kFewest || !(c.travel > 0)) return spectrum;
  spectrum.resolution = 2 * M_PI / c.travel;
  spectrum.step = spectrum.resolution / kLines;
  spectrum.first = spectrum.resolution;
  largest =
      std::min({largest, highest_order(s, c), double(kLargestGrid) / kOversampling / 4 * spectrum.step});
  if (!(largest > spectrum.first)) return spectrum;
  const auto count = std::size_t((largest - spectrum.first) / spectrum.step) + 1;
  spectrum.share.assign(count, 0.0);
  spectrum.taken.assign(count, 0.0);
  const std::size_t exact = std::min(count, std::size_t((kExact - 1) * kLines));
  for (std::size_t i = 0; i < exact; ++i) {
    const Line line = exact_line(s, c, spectrum.first + double(i) * spectrum.step, known);
    spectrum.taken[i] = line.taken;
    spectrum.share[i] = line.total > 0 ? line.taken / line.total : 0;
  }
  // Bands begin where samples start to drop out.
  const double all = [&] {
    double least = largest;
    for (const std::size_t k : c.at) least = std::min(least, s.highest[k]);
    return least;
  }();
  for (std::size_t begin = exact; begin < count;) {
    const double from = spectrum.first + double(begin) * spectrum.step, to = std::max(kBand * from, all);
    const auto end = std::clamp(std::size_t((to - spectrum.first) / spectrum.step), begin + 1, count);
    fill_band(s, c, begin, end, largest, spectrum);
    begin = end;
  }
  return spectrum;
}

std::vector<OrderPeak> strongest_orders(const OrderSpectrum& spectrum, std::size_t count, double lowest) {
  const std::vector<double>& y = spectrum.taken;
  std::vector<OrderPeak> all;
  for (std::size_t i = 1; i + 1 < y.size(); ++i) {
    if (!(y[i] > y[i - 1] && y[i] >= y[i + 1])) continue;
    const double bend = y[i - 1] - 2 * y[i] + y[i + 1];
    const double aside = bend < 0 ? 0.5 * (y[i - 1] - y[i + 1]) / bend : 0;
    const double order = spectrum.first + (double(i) + aside) * spectrum.step;
    if (order >= lowest) all.push_back({order, spectrum.share[i], y[i]});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const OrderPeak& a, const OrderPeak& b) { return a.taken > b.taken; });
  std::vector<OrderPeak> apart;
  for (const OrderPeak& peak : all) {
    if (apart.size() == count) break;
    const bool new_one = std::all_of(apart.begin(), apart.end(), [&](const OrderPeak& other) {
      return std::fabs(other.order - peak.order) >= spectrum.resolution;
    });
    if (new_one) apart.push_back(peak);
  }
  return apart;
}

}  // namespace backlash::signal
