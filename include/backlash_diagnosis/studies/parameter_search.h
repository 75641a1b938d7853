// SPDX-License-Identifier: BSD-3-Clause
// Open search for the unprinted parameters of a published monitoring curve: one rig that gives the printed
// skewness values and whose curve never rises.
//
//   rms       = sqrt(mean((skewness_i - published_i)^2))              over the published backlash values
//   rise      = max over a finer grid of (skewness_i - min of skewness_0 .. i)
//   objective = rms                            where rms > promising  (only the published values are
//   simulated)
//             = min(rms + rise, promising)     otherwise              (the grid is simulated too)
//
// Skewness is the mean over the periods read and over sampling phases between two samples. Every motion is
// read with every class layout that the search file lists; the best counts. Layouts cost no simulation, and
// the search has two dimensions less.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/studies/minimise.h"

namespace backlash::studies {

/// A value of the rig file that the search may choose: within bounds, or one of a list.
struct FreeParameter {
  std::string key;      // "gear_train.mesh.contact.alpha"
  std::string comment;  // goes into the rig file: unit, and where the bounds come from
  double lower = 0, upper = 0;
  bool logarithmic = false;
  std::vector<std::string> choices;  // not empty: no bounds; one alone is no dimension of the search

  bool fixed() const { return choices.size() == 1; }

  /// Value for u in [0, 1], as it is written: numbers to four significant digits.
  std::string value(double u) const;
};

/// What is compared with the published values.
struct CurveTarget {
  std::vector<double> backlash, skewness;  // published; backlash is the total free play [m]
  double max_backlash = 0;                 // m, end of the grid on which the curve may not rise
  int points = 0;                          // of that grid, >= 2
  int periods = 1;                         // read, after the settling periods of the rig file
  int phases = 1;                          // sampling phases averaged
};

struct SearchFile {
  std::string source;
  std::string rig_source, rig_text;  // the rig that the parameters are set in
  MinimiseSettings minimise;
  double promising = 0;
  CurveTarget target;
  std::vector<FreeParameter> parameters;
  int fewest_classes = 0, most_classes = 0;
  std::vector<double> half_ranges;  // classes cover -half_range .. half_range
};

/// Reads a search file; the path of its rig is relative to it. Throws MissingInput, BadData.
SearchFile load_search_file(const std::string& path);

/// Changes a parameter of the search, or adds one: "0.053" sets a value that is not searched, "1e-5..0.1"
/// searches between bounds > 0 on a log scale. Throws InvalidParameter for other bounds.
void set_parameter(SearchFile& search, const std::string& key, const std::string& value);

/// How well a rig meets a target.
struct CurveFit {
  struct Point {
    double backlash, skewness;  // m; mean
    double lowest, highest;     // skewness, over sampling phases
    double highest_class;       // largest share of the APD, percent
    double largest_torque;      // N m, magnitude
  };
  std::vector<Point> published;           // at the published backlash values
  std::vector<Point> curve;               // on the grid
  double rms = 0, rise = 0, rise_at = 0;  // rise_at: backlash at its top [m]
};

/// Simulates and reads a rig with its own class layout. Throws InvalidParameter, IntegrationError.
CurveFit fit_of(const rig_file::RigFile& file, const CurveTarget& target);

struct SearchResult {
  std::string rig_text;  // the rig file found, without its head comment; comments mark the parameters that
                         // were searched
  std::vector<std::string> values;  // of the parameters, in their order
  std::vector<bool> at_bound;       // within 1 % of the way between the bounds
  CurveFit fit;
  long evaluations = 0;
  std::vector<MinimiseResult::Step> history;
};

/// Throws BadData (a parameter that the rig file does not know), InvalidParameter, Cancelled.
SearchResult search_parameters(const SearchFile& search, const Progress& progress = nullptr);

}  // namespace backlash::studies
