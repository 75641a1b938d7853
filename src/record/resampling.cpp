// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/resampling.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash::record {

Record evenly_sampled(const Record& record) {
  const std::size_t n = record.size();
  const double interval = record.sampling_interval();
  if (n < 4) throw BadData(record.name, "has only " + std::to_string(n) + " samples");
  const double even = (record.time.back() - record.time.front()) / double(n - 1);
  double worst = 0;
  for (std::size_t k = 0; k < n; ++k)
    worst = std::max(worst, std::fabs(record.time[k] - record.time.front() - double(k) * even));
  if (worst <= 0.01 * even) return record;
  for (std::size_t k = 1; k < n; ++k)
    if (record.time[k] - record.time[k - 1] > kGapFactor * interval)
      throw BadData(record.name, "a gap of " + to_text(record.time[k] - record.time[k - 1]) +
                                     " s after t = " + time_text(record.time[k - 1]) +
                                     " s: give the parts as records of their own");
  Record out;
  out.name = record.name;
  out.warnings = record.warnings;
  std::size_t j = 0;
  for (double t = record.time.front(); t <= record.time.back();
       t = record.time.front() + double(out.time.size()) * interval) {
    while (j + 2 < n && record.time[j + 1] < t) ++j;
    const double u = (t - record.time[j]) / (record.time[j + 1] - record.time[j]);
    out.time.push_back(t);
    for (const Channel channel : kChannels)
      if (const auto& in = record.column(channel); !in.empty())
        out.column(channel).push_back((1 - u) * in[j] + u * in[j + 1]);
  }
  return out;
}

}  // namespace backlash::record
