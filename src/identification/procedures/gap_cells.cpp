// SPDX-License-Identifier: BSD-3-Clause
#include "gap_cells.h"

#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace backlash::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTurn = 2 * M_PI;
constexpr int kLeastSamples = 3;    // choice: per cell and run
constexpr double kLopsided = 0.25;  // choice: of a cell, between the mean places of both runs

struct Mean {
  double load = 0, difference = 0;
  int count = 0;
};

std::map<long, Mean> means_of(const GapRun& run, double width) {
  std::map<long, Mean> means;
  for (std::size_t i = 0; i < run.load.size(); ++i) {
    Mean& m = means[std::lround(run.load[i] / width)];
    m.load += run.load[i], m.difference += run.difference[i], ++m.count;
  }
  return means;
}

VectorXd vector_of(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), Index(values.size()));
}

/// What a mean over a cell leaves of a wave.
double of_cell(double order, double width) {
  const double half = 0.5 * order * width;
  return half > 0 ? std::sin(half) / half : 1;
}

}  // namespace

GapCells shared_cells(const GapRun& forward, const GapRun& reverse, double width) {
  const std::map<long, Mean> f = means_of(forward, width), r = means_of(reverse, width);
  std::vector<double> place, separation;
  for (const auto& [cell, a] : f) {
    const auto other = r.find(cell);
    if (other == r.end() || a.count < kLeastSamples || other->second.count < kLeastSamples) continue;
    const Mean& b = other->second;
    if (std::fabs(a.load / a.count - b.load / b.count) > kLopsided * width) continue;
    place.push_back(0.5 * (a.load / a.count + b.load / b.count));
    separation.push_back(a.difference / a.count - b.difference / b.count);
  }
  GapCells cells;
  cells.place = vector_of(place), cells.value = vector_of(separation);
  cells.share = VectorXd::Ones(cells.place.size());
  cells.width = width;
  cells.turns = double(place.size()) * width / kTurn;
  return cells;
}

GapCells separate_cells(const GapRun& forward, const GapRun& reverse, double width) {
  std::vector<double> place, value, share;
  double least = std::numeric_limits<double>::infinity();
  for (const GapRun* run : {&forward, &reverse}) {
    const std::size_t before = place.size();
    for (const auto& [cell, m] : means_of(*run, width)) {
      if (m.count < kLeastSamples) continue;
      place.push_back(m.load / m.count);
      value.push_back(m.difference / m.count);
      share.push_back(run == &forward ? 0.5 : -0.5);
    }
    least = std::min(least, double(place.size() - before) * width / kTurn);
  }
  return {vector_of(place), vector_of(value), vector_of(share), true, width, least};
}

Index columns_per_wave(const GapCells& cells) {
  return cells.apart ? 4 : 2;
}

void put_wave(const GapCells& cells, double order, MatrixXd& a, Index column) {
  const double shown = of_cell(order, cells.width);
  const Eigen::ArrayXd sine = shown * (order * cells.place.array()).sin(),
                       cosine = shown * (order * cells.place.array()).cos();
  a.col(column) = cells.share.array() * sine;
  a.col(column + 1) = cells.share.array() * cosine;
  if (!cells.apart) return;
  a.col(column + 2) = sine;
  a.col(column + 3) = cosine;
}

MatrixXd base_columns(const GapCells& cells, int whole) {
  const Index n = cells.place.size(), per_run = cells.apart ? 2 + 2 * whole : 1 + 2 * whole;
  MatrixXd a = MatrixXd::Zero(n, cells.apart ? 2 * per_run : per_run);
  for (Index i = 0; i < n; ++i) {
    Index c = cells.share[i] > 0 ? 0 : per_run;
    a(i, c++) = 1;
    for (int order = 1; order <= whole; ++order) {
      a(i, c++) = std::sin(order * cells.place[i]);
      a(i, c++) = std::cos(order * cells.place[i]);
    }
    if (cells.apart) a(i, c) = cells.place[i];
  }
  return a;
}

}  // namespace backlash::identification
