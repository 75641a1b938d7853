// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/fit/windowed_fit.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "backlash_diagnosis/base/parallel.h"

namespace backlash::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Of one window alone, which ends where a step gains less than this share of its cost.
constexpr int kSettleSteps = 15;
constexpr double kSettled = 1e-3;
constexpr double kPaced = 10;  // steps at the pace of one, within which a cost that is wanted must be; choice

}  // namespace

double Prior::value(double z) const {
  return factor ? centre * std::exp(spread * z) : centre + spread * z;
}

/// All windows once for each point that Ceres looks at, with slopes where it asks for them: it goes on from
/// those points only. The machines that slopes need are moved side by side with that of the point.
struct Evaluation : ceres::EvaluationCallback {
  WindowedFit& fit;
  VectorXd looked_at, sloped;  // states of the residuals and of the slopes
  VectorXd state;  // all values in one piece: Ceres orders blocks by their addresses, and sums in that order
  explicit Evaluation(WindowedFit& of) : fit(of) {
    Eigen::Index size = fit.shared.size();
    for (const VectorXd& own : fit.own) size += own.size();
    state.resize(size);
    looked_at = sloped = VectorXd::Constant(size, std::numeric_limits<double>::quiet_NaN());
    move([](VectorXd& values, double* at) { Eigen::Map<VectorXd>(at, values.size()) = values; });
  }
  template <typename Move>
  void move(const Move& each) {
    double* at = state.data();
    each(fit.shared, at), at += fit.shared.size();
    for (VectorXd& own : fit.own) each(own, at), at += own.size();
  }
  void take() {
    move([](VectorXd& values, double* at) { values = Eigen::Map<VectorXd>(at, values.size()); });
  }
  void PrepareForEvaluation(bool slopes, bool new_point) override {
    if (new_point) take();
    evaluate(slopes);
  }
  void evaluate(bool slopes) {
    if (looked_at == state && (!slopes || sloped == state)) return;
    fit.evaluate(slopes ? WindowedFit::Slopes::all : WindowedFit::Slopes::none);
    looked_at = state;
    if (slopes) sloped = state;
  }
};

/// Ends a solution that would not come to what is wanted.
class Pace : public ceres::IterationCallback {
 public:
  explicit Pace(const FitOptions& options) : options_(options) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    const bool slow = step.iteration > 0 && step.step_is_successful &&
                      2 * kPaced * step.cost_change < 2 * step.cost - options_.wanted;
    return slow ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const FitOptions& options_;
};

/// Of one window with the shared values as they are.
class OwnCost : public ceres::CostFunction {
 public:
  OwnCost(const WindowedFit& fit, int window) : fit_(fit), window_(window) {
    set_num_residuals(int(fit.parts_[std::size_t(window)].residual.size()));
    *mutable_parameter_block_sizes() = {int(fit.own[std::size_t(window)].size())};
  }
  bool Evaluate(const double* const* values, double* residuals, double** slopes) const override {
    const Eigen::Index m = parameter_block_sizes()[0];
    const VectorXd at = Eigen::Map<const VectorXd>(values[0], m);
    const bool asked = slopes != nullptr && slopes[0] != nullptr;
    const WindowedFit::Part part =
        fit_.part_of(window_, at, asked ? WindowedFit::Slopes::own : WindowedFit::Slopes::none);
    if (!part.residual.allFinite()) return false;
    Eigen::Map<VectorXd>(residuals, num_residuals()) = part.residual;
    if (asked) Eigen::Map<RowMatrix>(slopes[0], num_residuals(), m) = part.slopes.rightCols(m);
    return true;
  }

 private:
  const WindowedFit& fit_;
  int window_;
};

/// Of one channel of a window.
class WindowCost : public ceres::CostFunction {
 public:
  WindowCost(const WindowedFit& fit, int window, int channel)
      : part_(fit.parts_[std::size_t(window)]),
        rows_(part_.residual.size() / fit.windows_->channels()),
        first_(channel * rows_) {
    set_num_residuals(int(rows_));
    *mutable_parameter_block_sizes() = {int(fit.shared.size()), int(fit.own[std::size_t(window)].size())};
  }
  bool Evaluate(const double* const*, double* residuals, double** slopes) const override {
    if (!part_.residual.allFinite()) return false;
    Eigen::Map<VectorXd>(residuals, rows_) = part_.residual.segment(first_, rows_);
    Eigen::Index from = 0;
    for (std::size_t b = 0; b < parameter_block_sizes().size(); ++b) {
      const Eigen::Index size = parameter_block_sizes()[b];
      if (slopes != nullptr && slopes[b] != nullptr)
        Eigen::Map<RowMatrix>(slopes[b], rows_, size) = part_.slopes.block(first_, from, rows_, size);
      from += size;
    }
    return true;
  }

 private:
  const WindowedFit::Part& part_;
  const Eigen::Index rows_, first_;
};

WindowedFit::WindowedFit(const Windows& windows)
    : shared(VectorXd::Zero(Eigen::Index(windows.shared().size()))),
      own(std::size_t(windows.count()), VectorXd::Zero(Eigen::Index(windows.own().size()))),
      windows_(&windows),
      parts_(std::size_t(windows.count())) {}

WindowedFit::Part WindowedFit::part_of(int window, const VectorXd& mine, Slopes slopes) const {
  const Eigen::Index n = shared.size(), m = mine.size();
  const auto prior = [&](Eigen::Index k) -> const Prior& {
    return k < n ? windows_->shared()[std::size_t(k)] : windows_->own()[std::size_t(k - n)];
  };
  std::vector<Eigen::Index> moved;
  for (Eigen::Index k = slopes == Slopes::all ? 0 : slopes == Slopes::own ? n : n + m; k < n + m; ++k)
    if (prior(k).spread > 0) moved.push_back(k);
  const int sides = central_ ? 2 : 1;
  const Eigen::Index columns = 1 + sides * Eigen::Index(moved.size());
  MatrixXd at = shared.replicate(1, columns), own_at = mine.replicate(1, columns);
  for (Eigen::Index i = 1; i < columns; ++i) {
    const Eigen::Index k = moved[std::size_t((i - 1) / sides)];
    const double step = (i - 1) % sides == 0 ? prior(k).step : -prior(k).step;
    (k < n ? at(k, i) : own_at(k - n, i)) += step;
  }
  const MatrixXd r = windows_->residuals(window, at, own_at);
  Part part{r.col(0), MatrixXd::Zero(r.rows(), n + m)};
  for (Eigen::Index i = 0; i < Eigen::Index(moved.size()); ++i) {
    const Eigen::Index k = moved[std::size_t(i)], first = 1 + sides * i;
    part.slopes.col(k) = (r.col(first) - r.col(central_ ? first + 1 : 0)) / (sides * prior(k).step);
    if (!part.slopes.col(k).allFinite())
      part.slopes.col(k).setZero();  // a place beside this cannot be followed
  }
  return part;
}

void WindowedFit::evaluate(Slopes slopes) {
  for_each_in_parallel(windows_->count(), [&](int w) {
    Part part = part_of(w, own[std::size_t(w)], slopes);
    if (slopes == Slopes::none)
      part.slopes = std::move(parts_[std::size_t(w)].slopes);  // of where they were asked for
    parts_[std::size_t(w)] = std::move(part);
  });
}

void WindowedFit::settle() {
  for_each_in_parallel(windows_->count(), [&](int w) {
    VectorXd& mine = own[std::size_t(w)];
    ceres::Problem problem;
    problem.AddResidualBlock(new OwnCost(*this, w), nullptr, mine.data());
    problem.AddResidualBlock(
        new ceres::NormalPrior(MatrixXd::Identity(mine.size(), mine.size()), VectorXd::Zero(mine.size())),
        nullptr, mine.data());
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.max_num_iterations = kSettleSteps;
    solver.function_tolerance = kSettled;
    solver.num_threads = 1;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
  });
}

void WindowedFit::run(const FitOptions& options) {
  robust_ = options.robust;
  cost_ = std::numeric_limits<double>::infinity();
  // From where a window cannot be followed nothing leads on, and Ceres would write that to the user's screen.
  const auto followed = [&] {
    return std::all_of(parts_.begin(), parts_.end(), [](const Part& p) { return p.residual.allFinite(); });
  };
  evaluate(Slopes::own);
  if (!followed()) return;
  settle();
  Evaluation evaluation(*this);
  evaluation.evaluate(true);
  if (!followed()) return;
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &evaluation;
  ceres::Problem problem(problem_options);
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  int block = -1;  // shared values, then the windows
  double* shared_values = nullptr;
  evaluation.move([&](const VectorXd& z, double* at) {
    problem.AddParameterBlock(at, int(z.size()));
    problem.AddResidualBlock(
        new ceres::NormalPrior(MatrixXd::Identity(z.size(), z.size()), VectorXd::Zero(z.size())), nullptr,
        at);
    order->AddElementToGroup(at, block < 0 ? 1 : 0);
    if (block < 0) {
      shared_values = at;
    } else {
      for (int c = 0; c < windows_->channels(); ++c) {
        auto* cost = new WindowCost(*this, block, c);
        problem.AddResidualBlock(cost, new ceres::CauchyLoss(std::sqrt(robust_ * cost->num_residuals())),
                                 shared_values, at);
      }
    }
    ++block;
  });
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = order;
  solver.max_num_iterations = options.iterations;
  solver.initial_trust_region_radius = options.radius;
  solver.function_tolerance = options.tolerance;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  Pace pace(options);
  solver.callbacks.push_back(&pace);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  evaluation.take();
  if (summary.IsSolutionUsable()) cost_ = 2 * summary.final_cost;
  central_ = options.central;
  if (central_)
    evaluate(Slopes::all);
  else
    evaluation.evaluate(true);
  central_ = false;
}

double WindowedFit::cost_at(const VectorXd& others, const FitOptions& options) const {
  std::vector<double> costs(own.size(), 0.0);
  for_each_in_parallel(windows_->count(), [&](int w) {
    const VectorXd& mine = own[std::size_t(w)];
    const VectorXd r = windows_->residuals(w, others, mine);
    const Eigen::Index rows = r.size() / windows_->channels();
    const double scale = options.robust * double(rows);
    double& cost = costs[std::size_t(w)];
    cost = mine.squaredNorm();
    for (int c = 0; c < windows_->channels(); ++c)
      cost += scale * std::log1p(r.segment(c * rows, rows).squaredNorm() / scale);
  });
  return std::accumulate(costs.begin(), costs.end(), others.squaredNorm());
}

double WindowedFit::weight(int window, int channel) const {
  const VectorXd& r = parts_[std::size_t(window)].residual;
  const Eigen::Index rows = r.size() / windows_->channels();
  return 1 / (1 + r.segment(channel * rows, rows).squaredNorm() / (robust_ * double(rows)));
}

double WindowedFit::mean_square() const {
  double squares = 0, rows = 0;
  for (int w = 0; w < windows_->count(); ++w)
    for (int c = 0; c < windows_->channels(); ++c) {
      const VectorXd& r = parts_[std::size_t(w)].residual;
      const Eigen::Index n = r.size() / windows_->channels();
      squares += weight(w, c) * r.segment(c * n, n).squaredNorm(), rows += weight(w, c) * double(n);
    }
  return squares / rows;
}

/// Adds what a window says of the shared values, its own eliminated.
void WindowedFit::reduce(int window, MatrixXd* information, VectorXd* score) const {
  const Part& part = parts_[std::size_t(window)];
  const Eigen::Index n = shared.size(), m = part.slopes.cols() - n,
                     rows = part.residual.size() / windows_->channels();
  MatrixXd owns = MatrixXd::Zero(m, m), mixed = MatrixXd::Zero(m, n), said = MatrixXd::Zero(n, n);
  VectorXd of_shared = VectorXd::Zero(n), of_own = VectorXd::Zero(m);
  for (int c = 0; c < windows_->channels(); ++c) {
    const double f = weight(window, c);
    const auto s = part.slopes.block(c * rows, 0, rows, n), o = part.slopes.block(c * rows, n, rows, m);
    const auto r = part.residual.segment(c * rows, rows);
    owns += f * (o.transpose() * o), mixed += f * (o.transpose() * s), said += f * (s.transpose() * s);
    of_shared += f * (s.transpose() * r), of_own += f * (o.transpose() * r);
  }
  owns.diagonal().array() += 1;  // their priors
  const Eigen::LDLT<MatrixXd> solver(owns);
  *information += said - mixed.transpose() * solver.solve(mixed);
  *score = of_shared - mixed.transpose() * solver.solve(VectorXd(of_own + own[std::size_t(window)]));
}

MatrixXd WindowedFit::information() const {
  MatrixXd information = MatrixXd::Identity(shared.size(), shared.size());
  VectorXd score;
  for (int w = 0; w < windows_->count(); ++w) reduce(w, &information, &score);
  return information;
}

double WindowedFit::windows_that_count(Eigen::Index which) const {
  double sum = 0, squares = 0;
  for (int w = 0; w < windows_->count(); ++w) {
    MatrixXd information = MatrixXd::Zero(shared.size(), shared.size());
    VectorXd score;
    reduce(w, &information, &score);
    const double mine = information(which, which);
    sum += mine, squares += mine * mine;
  }
  return squares > 0 ? sum * sum / squares : 0;
}

MatrixXd WindowedFit::covariance() const {
  return information().ldlt().solve(MatrixXd::Identity(shared.size(), shared.size()));
}

MatrixXd WindowedFit::clustered_covariance() const {
  const Eigen::Index n = shared.size();
  MatrixXd scatter = MatrixXd::Identity(n, n), information = scatter;
  VectorXd score;
  for (int w = 0; w < windows_->count(); ++w) {
    reduce(w, &information, &score);
    scatter += score * score.transpose();
  }
  const MatrixXd inverse = information.ldlt().solve(MatrixXd::Identity(n, n));
  return inverse * scatter * inverse;
}

}  // namespace backlash::fit
