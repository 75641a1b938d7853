// SPDX-License-Identifier: BSD-3-Clause
// Whether an effect is as strong in each part of the records as it is over all: slow and fast, here and
// there, early and late, and on the unseen record. What stands in for something else follows it where it was
// fitted, and not everywhere.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hypothesis.h"

namespace backlash::identification {

/// What some of the samples say, all else as fitted.
struct PartStrength {
  std::string part;                      // in words
  double ratio = 1, standard_error = 0;  // of the strength of the whole fit
};

/// Of a hypothesis, which must outlive it as the records must.
class StrengthInParts {
 public:
  StrengthInParts(const Hypothesis& h, const ServoData& unseen, const SearchContext& context);

  /// The part that differs most, of those that differ clearly (BeliefSettings::least_constant); nothing where
  /// the effect is the same in all, where little but noise is left, for maps, and for the shape of friction,
  /// which has no strength.
  std::optional<PartStrength> differing(std::size_t effect) const;

 private:
  struct Record {
    const ServoData* data;
    Calibration calibration;
    ServoPrediction prediction;
  };
  std::vector<PartStrength> strengths(const std::vector<Record>& records, std::size_t effect,
                                      const model::Rig& stronger, const std::string& where) const;

  const Hypothesis& h_;
  const SearchContext& context_;
  std::vector<Record> seen_, unseen_;
};

}  // namespace backlash::identification
