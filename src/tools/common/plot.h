// SPDX-License-Identifier: BSD-3-Clause
// Plots are drawn by the package's Python scripts (matplotlib), found beside the executable.
#pragma once

#include <string>

namespace backlash::tools {

/// Throws UsageError for a picture that does not end in .png, .svg or .pdf.
void check_plot_path(const std::string& path);

/// Draws a curve file. Throws CannotWrite where the picture cannot be written, Error where the script or
/// Python is missing or fails.
void plot_curve(const std::string& curve_path, const std::string& picture_path);

/// Draws the pictures PREFIX_loops.png and PREFIX_work.png of a study's JSON file. Throws as plot_curve.
void plot_integrator_study(const std::string& json_path, const std::string& prefix);

/// Draws the picture of a study's JSON file. Throws as plot_curve.
void plot_uncertainty_study(const std::string& json_path, const std::string& picture_path);

/// Draws the JSON of identify. Throws as plot_curve.
void plot_identification(const std::string& json_path, const std::string& picture_path);

/// Draws the JSON of compare_models. Throws as plot_curve.
void plot_model_comparison(const std::string& json_path, const std::string& picture_path);

/// Draws the JSON of separability_map. Throws as plot_curve.
void plot_separability_map(const std::string& json_path, const std::string& picture_path);

/// Draws the JSON of backlash_trend, given as text: its file is optional. Throws as plot_curve.
void plot_trend(const std::string& json, const std::string& picture_path);

/// Draws what check_record saw (report::record_check_series). Throws as plot_curve.
void plot_check(const std::string& series, const std::string& picture_path);

}  // namespace backlash::tools
