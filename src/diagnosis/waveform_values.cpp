// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/waveform_values.h"

#include <algorithm>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "refusal.h"
#include "waveform_solution.h"

namespace backlash::diagnosis {
namespace {

/// The fitted values that are not among `places` eliminated, with what was known of them.
Eigen::MatrixXd information_of(const WaveformSolution& s, const std::vector<int>& places) {
  std::vector<int> kept, rest;
  for (std::size_t i = 0; i < s.fitted.size(); ++i)
    (std::find(places.begin(), places.end(), s.fitted[i]) != places.end() ? kept : rest)
        .push_back(static_cast<int>(i));
  const Eigen::MatrixXd across = s.information(rest, kept);
  Eigen::MatrixXd others = s.information(rest, rest);
  others.diagonal().array() += 1;
  return (s.information(kept, kept) -
          signal::transposed_product(across, signal::solve_symmetric(others, across))) /
         s.wider;
}

std::string doubt_of(const WaveformSolution& s) {
  try {
    refuse_waveform(s);
  } catch (const Refusal& refusal) {
    return refusal.reason;
  }
  return "";
}

void fill(const WaveformSolution& s, const WaveformSettings& settings, WaveformValues& out) {
  out.backlash = 2 * s.half_gap;
  out.log_error = s.log_error;
  out.doubt = doubt_of(s);
  std::vector<int> places = {kHalfGap};  // as they are in the fit: with rising numbers
  const auto& all = waveform_quantities();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].in(settings)) continue;
    out.quantities.push_back(i);
    places.push_back(kQuantityPlaces[i]);
  }
  out.z.resize(static_cast<Eigen::Index>(places.size()));
  out.slope.resize(out.z.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto k = static_cast<std::size_t>(places[i]);
    out.z[static_cast<Eigen::Index>(i)] = s.z[k];
    out.slope[static_cast<Eigen::Index>(i)] = s.pull[k] / s.wider;
    out.spread.push_back(s.priors.shared[k].spread);
  }
  out.information = information_of(s, places);
  for (int c = 0; c < kWaveformChannels; ++c)
    if (s.misfit[c].swing > 0) out.residual[c] = s.misfit[c].rms, out.swing[c] = s.misfit[c].swing;
  out.windows = s.windows, out.left_out = s.left_out;
}

}  // namespace

WaveformValues waveform_values(const record::Record& record, double from, double to,
                               const WaveformSettings& settings, double backlash, double spread) {
  WaveformValues out;
  try {
    check_waveform(record, settings);
    fill(solve_waveform(record, settings, {from, to, backlash / 2, spread}), settings, out);
  } catch (const Refusal& refusal) {
    out.status = refusal.status;
    out.reason = refusal.reason;
  }
  return out;
}

}  // namespace backlash::diagnosis
