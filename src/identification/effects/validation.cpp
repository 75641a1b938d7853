// SPDX-License-Identifier: BSD-3-Clause
#include "validation.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr double kRidge = 1e-10;  // theory: of a squared sensitivity
constexpr double kShown =
    0.05;  // choice: of a squared sensitivity; what the other rows hardly show stays where it is

constexpr double kDampings[] = {0, 1e-4, 1e-3, 1e-2, 0.1};  // choice: of a squared sensitivity
constexpr double kNoWorse = 1.02;  // choice: of a sum of squares, what is lost to a linear step

double duration(const PreparedServo& record) {
  return double(record.data().size()) * record.data().interval;
}

/// The rows that `wanted` accepts.
template <typename Wanted>
std::vector<Eigen::Index> rows_where(const RecordSet& records, const Wanted& wanted) {
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < records.layout().size(); ++i)
    if (wanted(records.layout()[i])) rows.push_back(Eigen::Index(i));
  return rows;
}

/// Fitted values without these rows, by a linear step from the fit; damped as Marquardt does.
Eigen::VectorXd without(const signal::LeastSquaresFit& fit, const Eigen::MatrixXd& normal,
                        const std::vector<Eigen::Index>& rows, double damping = 0) {
  const Eigen::MatrixXd j = fit.jacobian(rows, Eigen::all);
  const Eigen::VectorXd unit = normal.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd rest = unit.asDiagonal() * (normal - signal::gram(j)) * unit.asDiagonal();
  Eigen::VectorXd gradient = unit.asDiagonal() * (j.transpose() * fit.residuals(rows));
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    if (rest(i, i) >= kShown) continue;
    rest.row(i).setZero();
    rest.col(i).setZero();
    rest(i, i) = 1;
    gradient[i] = 0;
  }
  rest.diagonal().array() += kRidge + damping;
  return unit.asDiagonal() * signal::solve_symmetric(rest, gradient);
}

void add_squares(const RecordSet& records, const std::vector<Eigen::Index>& rows, const Eigen::VectorXd& r,
                 double& torque, double& deflection) {
  for (std::size_t i = 0; i < rows.size(); ++i)
    (records.layout()[std::size_t(rows[i])].deflection ? deflection : torque) +=
        r[Eigen::Index(i)] * r[Eigen::Index(i)];
}

double gain_of(double before, double after) {
  return before > 0 ? 1 - std::sqrt(after / before) : 0;
}

struct Squares {
  double before = 0, after = 0;
  double gain() const { return gain_of(before, after); }
  double decrease() const { return before - after; }
  Squares operator+(const Squares& other) const { return {before + other.before, after + other.after}; }
};

/// Of all blocks but the one that gets worse by most.
Squares all_but_worst(const std::vector<double>& before, const std::vector<double>& after) {
  std::size_t worst = 0;
  Squares sum;
  for (std::size_t i = 0; i < before.size(); ++i) {
    sum.before += before[i], sum.after += after[i];
    if (after[i] - before[i] > after[worst] - before[worst]) worst = i;
  }
  return {sum.before - before[worst], sum.after - after[worst]};
}

}  // namespace

namespace {

std::vector<Eigen::Index> late_rows(const RecordSet& records, const AcceptanceSettings& settings) {
  return rows_where(records, [&](const RecordSet::Row& row) {
    return row.time > settings.earlier_part * duration(records.records()[row.record]);
  });
}

/// The later rows, with what the earlier ones say. The step that the later ones are left out by is linear:
/// where it leads to a machine that leaves more of the earlier rows than before it is no fit of them, and a
/// shorter one is taken.
Eigen::VectorXd forward(const signal::LeastSquaresFit& f, const Machine& start, const RecordSet& records,
                        const Eigen::MatrixXd& normal, const AcceptanceSettings& settings) {
  const auto late = late_rows(records, settings);
  const double all = f.residuals.squaredNorm(), earlier = all - f.residuals(late).squaredNorm();
  Eigen::VectorXd r = f.residuals(late);
  for (const double damping : kDampings) {
    const Eigen::VectorXd change = without(f, normal, late, damping);
    r = f.residuals(late) + f.jacobian(late, Eigen::all) * change;
    try {
      const Machine machine = Unknowns(start).machine(f.values + change);
      const Eigen::VectorXd rows = records.rows(machine.rig, machine.calibrations);
      r = rows(late);
      if (rows.squaredNorm() - r.squaredNorm() <= kNoWorse * earlier) return r;
    } catch (const Error&) {  // the step leads out of what a rig may be
    }
  }
  return r;
}

}  // namespace

HeldOut held_out(const MachineFit& fit, const Machine& start, const RecordSet& records,
                 const AcceptanceSettings& settings) {
  const signal::LeastSquaresFit& f = fit.fit;
  const Eigen::MatrixXd normal = signal::gram(f.jacobian);
  HeldOut out;
  const auto everything = rows_where(records, [](const RecordSet::Row&) { return true; });
  add_squares(records, everything, f.residuals(everything), out.torque_train, out.deflection_train);
  for (int b = 0; b < settings.blocks; ++b) {
    const auto rows = rows_where(records, [&](const RecordSet::Row& row) {
      return int(settings.blocks * row.time / duration(records.records()[row.record])) == b;
    });
    const Eigen::VectorXd change = without(f, normal, rows);
    double torque = 0, deflection = 0;
    add_squares(records, rows, f.residuals(rows) + f.jacobian(rows, Eigen::all) * change, torque, deflection);
    out.torque.push_back(torque);
    out.deflection.push_back(deflection);
  }
  const Eigen::VectorXd late = forward(f, start, records, normal, settings);
  add_squares(records, late_rows(records, settings), late, out.torque_forward, out.deflection_forward);
  return out;
}

// Where one block alone determines a parameter, its prediction from the others is arbitrarily bad, and so is
// the gain. It is therefore limited to the gain of the fit itself.
Gain compare(const HeldOut& a, const HeldOut& b) {
  Gain g;
  const Squares torque = all_but_worst(a.torque, b.torque),
                deflection = all_but_worst(a.deflection, b.deflection),
                torque_fit{a.torque_train, b.torque_train},
                deflection_fit{a.deflection_train, b.deflection_train}, fit = torque_fit + deflection_fit;
  g.deflection = deflection_fit.decrease() > torque_fit.decrease();
  const std::vector<double>&before = g.deflection ? a.deflection : a.torque,
        &after = g.deflection ? b.deflection : b.torque;
  Evidence& e = g.evidence;
  e.gain = (g.deflection ? deflection_fit : torque_fit).gain();
  e.gain_held_out = std::min(e.gain, (g.deflection ? deflection : torque).gain());
  e.gain_forward = g.deflection ? gain_of(a.deflection_forward, b.deflection_forward)
                                : gain_of(a.torque_forward, b.torque_forward);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] == 0) continue;
    ++e.blocks;
    e.blocks_better += after[i] < before[i];
  }
  g.total = std::min(fit.gain(), (torque + deflection).gain());
  return g;
}

}  // namespace backlash::identification
