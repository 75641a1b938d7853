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

/// Fitted values without these rows, by a linear step from the fit.
Eigen::VectorXd without(const signal::LeastSquaresFit& fit, const Eigen::MatrixXd& normal,
                        const std::vector<Eigen::Index>& rows) {
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
  rest.diagonal().array() += kRidge;
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

HeldOut held_out(const MachineFit& fit, const RecordSet& records, const AcceptanceSettings& settings) {
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
  Evidence& e = g.evidence;
  e.gain = (g.deflection ? deflection_fit : torque_fit).gain();
  e.gain_held_out = std::min(e.gain, (g.deflection ? deflection : torque).gain());
  g.total = std::min(fit.gain(), (torque + deflection).gain());
  return g;
}

}  // namespace backlash::identification
