// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/hysteresis_loop.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

constexpr std::size_t kPositions =
    400;  // over the travel; flanks are steep in torque and need several of them

struct Characteristic {
  std::vector<double> position, middle, half_width;  // x, m(x), w(x)
};

// Torque at the first passage of each position, on the way from one wall to the other. Torque is averaged
// over a fiftieth of the passage, short against its way from -T to T.
void add_passage(const LockedMotion& motion, std::size_t begin, std::size_t end, int side,
                 const std::vector<double>& positions, std::vector<std::vector<double>>& torques) {
  const std::size_t half = (end - begin) / 100;
  double sum = 0;
  std::size_t from = begin, to = begin;  // torque samples [from, to) are in `sum`
  std::size_t next = 0;                  // positions passed so far, counted in the direction of motion
  for (std::size_t i = begin; i < end && next < positions.size(); ++i) {
    while (to < std::min(end, i + half + 1)) sum += motion.torque[to++];
    while (from + half < i) sum -= motion.torque[from++];
    while (next < positions.size()) {
      const std::size_t index = side > 0 ? next : positions.size() - 1 - next;
      if (side * (motion.position[i] - positions[index]) < 0) break;
      torques[index].push_back(sum / static_cast<double>(to - from));
      ++next;
    }
  }
}

Characteristic find_characteristic(const LockedMotion& motion, const std::vector<TorqueExcursion>& excursions,
                                   double lower, double upper) {
  std::vector<double> positions(kPositions);
  for (std::size_t i = 0; i < kPositions; ++i) {
    positions[i] = lower + (upper - lower) * (static_cast<double>(i) + 0.5) / kPositions;
  }
  std::vector<std::vector<double>> up(kPositions), down(kPositions);
  for (std::size_t i = 1; i < excursions.size(); ++i) {
    const TorqueExcursion &from = excursions[i - 1], &to = excursions[i];
    if (from.side != to.side)
      add_passage(motion, from.end, to.end, to.side, positions, to.side > 0 ? up : down);
  }
  Characteristic characteristic;
  for (std::size_t i = 0; i < kPositions; ++i) {
    if (up[i].empty() || down[i].empty()) continue;
    const double rising = signal::median(up[i]), falling = signal::median(down[i]);
    characteristic.position.push_back(positions[i]);
    characteristic.middle.push_back(0.5 * (rising + falling));
    characteristic.half_width.push_back(0.5 * (rising - falling));
  }
  return characteristic;
}

struct Flank {
  double start = kNaN, compliance = kNaN;
  std::vector<double> half_width;
};

// Line x = start + compliance * m through one flank.
Flank fit_flank(const Characteristic& characteristic, int side) {
  Flank flank;
  double largest = 0;
  for (const double middle : characteristic.middle) largest = std::max(largest, side * middle);
  double n = 0, mx = 0, mm = 0, xx = 0, xm = 0;
  for (int pass = 0; pass < 2; ++pass) {  // means first, then moments about them
    for (std::size_t i = 0; i < characteristic.middle.size(); ++i) {
      const double m = characteristic.middle[i], x = characteristic.position[i];
      if (side * m < 0.3 * largest || side * m > 0.9 * largest) continue;
      if (pass == 0) {
        n += 1;
        flank.half_width.push_back(characteristic.half_width[i]);
        mm += (m - mm) / n;
        mx += (x - mx) / n;
      } else {
        xx += (m - mm) * (m - mm);
        xm += (m - mm) * (x - mx);
      }
    }
  }
  if (n < 3 || !(xx > 0) || !(xm > 0)) return flank;
  flank.compliance = xm / xx;
  flank.start = mx - flank.compliance * mm;
  return flank;
}

}  // namespace

HysteresisLoop analyse_hysteresis(const LockedMotion& motion, const std::vector<TorqueExcursion>& excursions,
                                  double lower, double upper) {
  HysteresisLoop loop;
  const Characteristic characteristic = find_characteristic(motion, excursions, lower, upper);
  std::vector<double> inner;
  for (std::size_t i = 0; i < characteristic.position.size(); ++i) {
    const double place = (characteristic.position[i] - lower) / (upper - lower);
    if (place > 0.25 && place < 0.75) inner.push_back(characteristic.half_width[i]);
  }
  if (inner.empty()) {
    loop.missing = "the hysteresis loop is not passed in both directions";
    return loop;
  }
  loop.components.coulomb = std::max(0.0, signal::median(inner));
  const Flank positive = fit_flank(characteristic, 1), negative = fit_flank(characteristic, -1);
  if (std::isnan(positive.start) || std::isnan(negative.start)) {
    loop.missing =
        "the flanks of the hysteresis loop are too short for a line, so gap and compliance cannot be "
        "separated";
    return loop;
  }
  std::vector<double> flank_widths = positive.half_width;
  flank_widths.insert(flank_widths.end(), negative.half_width.begin(), negative.half_width.end());
  loop.flank_friction = std::max(0.0, signal::median(flank_widths));
  loop.components.compliance = 0.5 * (positive.compliance + negative.compliance);
  loop.components.gap = std::max(0.0, positive.start - negative.start);
  return loop;
}

}  // namespace backlash::diagnosis
