// SPDX-License-Identifier: BSD-3-Clause
#include "local_fault.h"

#include <algorithm>
#include <cmath>

namespace backlash::changes {
namespace {

constexpr int kNarrowest = 160, kWidths = 4;  // widths per travel, then twice as wide each. Choice
constexpr double kReach = 3;                  // widths, beyond which a bump is nothing
constexpr double kShows = 2;                  // widths, within which it shows
constexpr double kPass = 3;                   // intervals of rows that no pass is interrupted by
constexpr int kOfEachWidth = 2;               // places. Choice
constexpr double kOnsets = 1;                 // s. Choice
constexpr int kLeastPasses = 3;               // beside those that say most. Choice
constexpr double kLeastScatter = 5;           // degrees of freedom of a direction's scatter. Choice

/// Whether it moves so, or is pressed so; between, while it turns.
double forward(ChangeChannel channel, const Moment& m) {
  return channel == ChangeChannel::torque ? 0.5 * (1 + m.direction) : m.side() > 0 ? 1 : 0;
}
double backward(ChangeChannel channel, const Moment& m) {
  // A flank that is farther away lets the motor go farther backward.
  return channel == ChangeChannel::torque ? 0.5 * (1 - m.direction) : m.side() < 0 ? -1 : 0;
}

double chord(double position, double place) {
  return 2 * std::sin(0.5 * (position - place));
}
double bump(double position, double place, double width) {
  const double c = chord(position, place) / width;
  return std::exp(-0.5 * c * c);
}

}  // namespace

const char* const kLocalFault = "local_fault";

ChangeEffect local_fault(ChangeChannel channel, double place, double width) {
  ChangeEffect e{kLocalFault, place};
  e.count = 2;
  e.width = width;
  e.law = [=](double q0) {
    return std::vector<OfMoment>{
        [=](const Moment& m) { return forward(channel, m) * bump(m.position, q0, width); },
        [=](const Moment& m) { return backward(channel, m) * bump(m.position, q0, width); }};
  };
  return e;
}

ChangeEffect fault_with_slopes(ChangeChannel channel, const ChangeEffect& fault,
                               const Eigen::VectorXd& values) {
  ChangeEffect e = fault;
  const double width = fault.width, f = values[0], b = values[1];
  const auto size = [=](const Moment& m) { return f * forward(channel, m) + b * backward(channel, m); };
  e.count = 4;
  e.law = [=, law = fault.law](double q0) {
    std::vector<OfMoment> all = law(q0);
    all.emplace_back([=](const Moment& m) {
      const double c = chord(m.position, q0);
      return size(m) * bump(m.position, q0, width) * c * std::cos(0.5 * (m.position - q0)) / (width * width);
    });
    all.emplace_back([=](const Moment& m) {
      const double c = chord(m.position, q0);
      return size(m) * bump(m.position, q0, width) * c * c / (width * width * width);
    });
    return all;
  };
  return e;
}

bool shows_fault(const ChangeEffect& fault, const Moment& moment) {
  return std::fabs(chord(moment.position, fault.shape)) < kShows * fault.width &&
         std::cos(moment.position - fault.shape) > 0;
}

namespace {

struct Pass {
  double score[2] = {0, 0}, squares[2] = {0, 0};  // forward, backward
  double entered = 0, left = 0;                   // chords
  double time = 0;                                // s
  bool through() const { return entered * left < 0; }
};

double gain_of(const double (&score)[2], const double (&squares)[2], double variance) {
  double gain = 0;
  for (int d = 0; d < 2; ++d)
    if (squares[d] > 0) gain += score[d] * score[d] / (squares[d] * variance);
  return gain;
}

/// Those through the place.
std::vector<Pass> passes_of(const SampledMotion& motion, const ChangeEffect& fault,
                            const Eigen::VectorXd& left) {
  const Eigen::MatrixXd columns = *effect_columns(motion, fault);
  std::vector<Pass> passes;
  double last = -1e300;
  for (Eigen::Index r = 0; r < motion.size(); ++r) {
    const Moment& m = motion.moment(r);
    if (!shows_fault(fault, m)) continue;
    const double c = chord(m.position, fault.shape);
    if (m.time - last > kPass * motion.row_interval) {
      passes.emplace_back();
      passes.back().entered = c;
    }
    last = m.time;
    Pass& pass = passes.back();
    pass.left = c;
    pass.time = m.time;
    for (int d = 0; d < 2; ++d) {
      pass.score[d] += columns(r, d) * left[r];
      pass.squares[d] += columns(r, d) * columns(r, d);
    }
  }
  passes.erase(std::remove_if(passes.begin(), passes.end(), [](const Pass& p) { return !p.through(); }),
               passes.end());
  return passes;
}

double mean(const std::vector<double>& all) {
  double sum = 0;
  for (const double x : all) sum += x;
  return sum / double(all.size());
}

/// Squares about the mean, and how many of them are independent.
void add_scatter(const std::vector<double>& all, double& squares, double& count) {
  if (all.empty()) return;
  const double middle = mean(all);
  for (const double x : all) squares += (x - middle) * (x - middle);
  count += double(all.size()) - 1;
}

void take_out_largest(std::vector<double>& all) {
  if (all.empty()) return;
  all.erase(std::max_element(all.begin(), all.end(),
                             [](double a, double b) { return std::fabs(a) < std::fabs(b); }));
}

}  // namespace

double repeated_gain(const SampledMotion& motion, const ChangeEffect& fault, const Eigen::VectorXd& left,
                     double from, double to) {
  std::vector<double> inside[2], outside[2];  // A of passes, forward, backward
  for (const Pass& p : passes_of(motion, fault, left)) {
    const int d = p.squares[0] > p.squares[1] ? 0 : 1;
    if (!(p.squares[d] > 0)) continue;
    (p.time >= from && p.time < to ? inside : outside)[d].push_back(p.score[d] / p.squares[d]);
  }
  double gain = 0, passes = 0, counted = 0;
  for (int d = 0; d < 2; ++d) {
    take_out_largest(inside[d]);
    double squares = 0, count = 0;
    add_scatter(inside[d], squares, count);
    add_scatter(outside[d], squares, count);
    if (inside[d].empty() || count < kLeastScatter) continue;
    const double middle = mean(inside[d]);
    gain += middle * middle * double(inside[d].size()) * count / squares;
    passes += double(inside[d].size());
    counted += count;
  }
  return passes < kLeastPasses || counted < 2 * kLeastScatter ? 0 : gain;
}

struct FaultScreen::Bins {
  explicit Bins(std::size_t n) : sum(2, std::vector<double>(n, 0)), rows(sum) {}
  void add(const SampledMotion& motion, Eigen::Index row, std::size_t bin, double left) {
    const Moment& m = motion.moment(row);
    const bool torque = motion.sampling.channel == ChangeChannel::torque;
    const bool back = torque ? m.direction < 0 : m.side() < 0;
    sum[back ? 1 : 0][bin] += left;
    ++rows[back ? 1 : 0][bin];
  }
  std::vector<std::vector<double>> sum, rows;  // forward, backward
};

FaultScreen::FaultScreen(const SampledMotion& motion) : motion_(motion) {
  double to = motion.moment(0).position;
  from_ = to;
  for (Eigen::Index r = 0; r < motion.size(); ++r) {
    from_ = std::min(from_, motion.moment(r).position);
    to = std::max(to, motion.moment(r).position);
  }
  turns_ = to - from_ > 2 * M_PI;
  const double travel = turns_ ? 2 * M_PI : to - from_;
  for (int i = 0; i < kWidths; ++i) widths_.push_back(travel * double(1 << i) / kNarrowest);
  bins_ = 2 * kNarrowest;
  bin_ = travel / double(bins_);
  for (const double width : widths_) {
    kernels_.emplace_back();
    for (int i = 0; i * bin_ <= kReach * width; ++i) {
      const double x = i * bin_ / width;
      kernels_.back().push_back(std::exp(-0.5 * x * x));
    }
    for (double place = from_ + 0.5 * width; place < from_ + travel; place += width)
      tried_.push_back({place, width, static_cast<std::size_t>((place - from_) / bin_)});
  }
  for (Eigen::Index r = 0; r < motion.size(); ++r) {
    const double x = motion.moment(r).position - from_;
    const double within = turns_ ? std::fmod(x, travel) : x;
    bin_of_row_.push_back(std::min(bins_ - 1, static_cast<std::size_t>(within / bin_)));
  }
}

double FaultScreen::gain(const Tried& tried, const Bins& bins, double variance) const {
  const auto at =
      static_cast<std::size_t>(std::find(widths_.begin(), widths_.end(), tried.width) - widths_.begin());
  const std::vector<double>& kernel = kernels_[at];
  double score[2] = {0, 0}, squares[2] = {0, 0};
  const auto middle = static_cast<long>(tried.bin), n = static_cast<long>(bins_),
             reach = static_cast<long>(kernel.size()) - 1;
  for (long i = middle - reach; i <= middle + reach; ++i) {
    if (!turns_ && (i < 0 || i >= n)) continue;
    const auto bin = static_cast<std::size_t>((i + n) % n);
    const double k = kernel[static_cast<std::size_t>(std::labs(i - middle))];
    for (std::size_t d = 0; d < 2; ++d) {
      score[d] += k * bins.sum[d][bin];
      squares[d] += k * k * bins.rows[d][bin];
    }
  }
  return gain_of(score, squares, variance);
}

std::vector<ChangeEffect> FaultScreen::likeliest(const Eigen::VectorXd& left, double variance, double margin,
                                                 double least) const {
  std::vector<double> best(tried_.size(), 0);
  Bins bins(bins_);
  const double end = motion_.moments.back().time;
  double next = end - margin;  // an onset, later ones are done
  for (Eigen::Index r = motion_.size() - 1; r >= 0 && motion_.time(r) >= margin; --r) {
    if (motion_.time(r) < next) {
      for (std::size_t i = 0; i < tried_.size(); ++i)
        best[i] = std::max(best[i], gain(tried_[i], bins, variance));
      next = motion_.time(r) - kOnsets;
    }
    bins.add(motion_, r, bin_of_row_[static_cast<std::size_t>(r)], left[r]);
  }
  std::vector<ChangeEffect> chosen;
  for (const double width : widths_)
    for (int k = 0; k < kOfEachWidth; ++k) {
      std::size_t most = tried_.size();
      for (std::size_t i = 0; i < tried_.size(); ++i)
        if (tried_[i].width == width && best[i] > (most < tried_.size() ? best[most] : least)) most = i;
      if (most == tried_.size()) break;
      chosen.push_back(local_fault(motion_.sampling.channel, tried_[most].place, width));
      for (std::size_t i = 0; i < tried_.size(); ++i)  // the same one beside
        if (tried_[i].width == width &&
            std::fabs(chord(tried_[i].place, tried_[most].place)) < kShows * width)
          best[i] = 0;
    }
  return chosen;
}

double FaultScreen::elsewhere(const ChangeEffect& fault, const Eigen::VectorXd& left, double variance,
                              double from, double to) const {
  Bins bins(bins_);
  for (Eigen::Index r = 0; r < motion_.size(); ++r)
    if (const double t = motion_.time(r); t >= from && t < to)
      bins.add(motion_, r, bin_of_row_[static_cast<std::size_t>(r)], left[r]);
  // Of the width that is nearest.
  const double width = *std::min_element(widths_.begin(), widths_.end(), [&](double a, double b) {
    return std::fabs(std::log(a / fault.width)) < std::fabs(std::log(b / fault.width));
  });
  double most = 0;
  for (const Tried& t : tried_)
    if (t.width == width && std::fabs(chord(t.place, fault.shape)) > kReach * std::max(width, fault.width))
      most = std::max(most, gain(t, bins, variance));
  return most;
}

}  // namespace backlash::changes
