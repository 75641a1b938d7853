// SPDX-License-Identifier: BSD-3-Clause
#include "traced_records.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "candidates.h"

namespace backlash::identification {
namespace {

constexpr double kLeastLoadTravel = 0.01;  // choice: of the motor's: less, and the link does not move freely
constexpr double kSureSpeed = 5;           // choice: standard deviations of the motor speed's noise
constexpr double kLeastMoving = 0.05;      // choice: of the samples
constexpr double kSameRate = 0.01;         // choice: relative difference of the intervals between samples
constexpr double kBeyond = 0.1;            // choice: of the travel, on either side
constexpr double kFaster = 1.5;            // choice: times speed or torque

}  // namespace

double common_interval(const std::vector<record::Record>& train, const record::Record& test) {
  double longest = test.sampling_interval();
  for (const record::Record& r : train) longest = std::max(longest, r.sampling_interval());
  return longest;
}

ServoData traced_data(const record::Record& record, const model::Rig& rig, double torque, double interval) {
  const bool own = interval < (1 + kSameRate) * record.sampling_interval();
  ServoData data = servo_data(own ? record::evenly_sampled_grid(record) : record::resampled(record, interval),
                              rig, torque);
  if (simulation::load_moves_freely(rig)) {
    if (data.load.empty())
      throw CannotIdentify(record.name + " has no load_position, which a rig with two inertias needs");
    if (signal::peak_to_peak(data.load) < kLeastLoadTravel * signal::peak_to_peak(data.motor))
      throw CannotIdentify(record.name +
                           ": the load stands still while the motor moves; the rig file has a link that " +
                           "moves freely (a gearbox with locked output: link: locked)");
  }
  const double sure = kSureSpeed * data.rate_noise;
  const auto moving = std::count_if(data.motor_rate.begin(), data.motor_rate.end(),
                                    [&](double rate) { return std::fabs(rate) > sure; });
  if (double(moving) < kLeastMoving * double(data.size()))
    throw CannotIdentify(record.name +
                         " moves too slowly: its speed stands out of the noise of the encoder in " +
                         std::to_string(100 * moving / long(data.size())) + " % of the samples");
  return data;
}

std::vector<std::string> range_warnings(const std::vector<ServoData>& train, const ServoData& test,
                                        bool linear) {
  const model::MotionRange known = motion_range(train), asked = motion_range({test});
  const double slack = kBeyond * (known.to - known.from);
  std::vector<std::string> warnings;
  if (asked.from < known.from - slack || asked.to > known.to + slack)
    warnings.push_back(fmt::format(
        "the test record moves from {:.3g} to {:.3g} {}, the training records from {:.3g} to {:.3g}",
        asked.from, asked.to, model::axis_unit("rad", linear), known.from, known.to));
  if (asked.speed > kFaster * known.speed || asked.torque > kFaster * known.torque)
    warnings.push_back(
        fmt::format("the test record is faster or stronger than the training records: speed {:.3g} against "
                    "{:.3g} {}, {} {:.3g} "
                    "against {:.3g} {} (standard deviations)",
                    asked.speed, known.speed, model::axis_unit("rad/s", linear), linear ? "force" : "torque",
                    asked.torque, known.torque, model::axis_unit("N m", linear)));
  return warnings;
}

}  // namespace backlash::identification
