// SPDX-License-Identifier: BSD-3-Clause
// A load encoder whose scale is wrong: it shows (1 + s) q_L and (1 + s) w_L, s [-].
// A line count or a ratio between encoder and load that is not what the rig file's maker thought.
#include <algorithm>

#include "terms.h"

namespace backlash::model {
namespace {

class EncoderScale : public Term {
 public:
  explicit EncoderScale(double scale) : scale_(scale) {}
  void sense(Sensing& sensing) const override { sensing.load_position_gain *= 1 + scale_; }
  bool moves_load() const override { return false; }

 private:
  double scale_;
};

/// Over the whole travel it shows what the deflection does.
double typical(const MotionRange& range) {
  constexpr double kShortest = 1e-9;  // rad
  return std::max(range.deflection, kShortest) / std::max(range.to - range.from, kShortest);
}

}  // namespace

TermType encoder_scale_term() {
  return {"encoder_scale",
          {{"scale", "-", Range::between(-0.5, 0.5), "s, of the load encoder: shown over true, less 1"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<EncoderScale>(p.at("scale"));
          },
          TermSearch{"scale", "", typical, {}}};
}

}  // namespace backlash::model
