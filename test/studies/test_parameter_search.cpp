// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/studies/parameter_search.h"
#include "support/data.h"

namespace backlash::studies {
namespace {

namespace fs = std::filesystem;

/// A folder with a copy of the default rig and a search file, as long as this lives.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("search_" + std::to_string(::getpid()))) {
    fs::create_directory(path_);
    fs::copy_file(test::package_file("config/sarkar_1997.yaml"), path_ / "rig.yaml",
                  fs::copy_options::overwrite_existing);
  }
  ~Folder() { fs::remove_all(path_); }
  std::string write(const std::string& text) const {
    const std::string file = (path_ / "search.yaml").string();
    std::ofstream(file) << text;
    return file;
  }

 private:
  fs::path path_;
};

const std::string kSearch =
    "schema_version: 1\n"
    "rig: rig.yaml\n"
    "search: {seed: 1, population: 5, budget: 15, goal: 0.001, promising: 0.5}\n"
    "target:\n"
    "  backlash: [0, 1.0e-4]\n"
    "  skewness: [4.6, 2.9]\n"
    "  max_backlash: 1.0e-4\n"
    "  points: 3\n"
    "  periods: 1\n"
    "  phases: 2\n"
    "layouts: {fewest_classes: 50, most_classes: 60, half_ranges: [0.3, 0.4]}\n"
    "parameters:\n"
    "  - {key: diagnosis.apd.settling_periods, comment: from rest, choices: [0]}\n"
    "  - {key: gear_train.input_coupling.damping, comment: N m s/rad, lower: 1.0e-3, upper: 1.0e-1, scale: "
    "log}\n"
    "  - {key: gear_train.mesh.contact.alpha, comment: s/m, lower: 0, upper: 2, scale: linear}\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(FreeParameter, MapsTheUnitIntervalOntoItsBoundsOrChoices) {
  const FreeParameter linear{"k", "", 10, 20, false, {}}, logarithmic{"k", "", 1e-3, 1e-1, true, {}},
      choice{"k", "", 0, 0, false, {"a", "b", "c", "d"}};
  EXPECT_EQ(linear.value(0), "10");
  EXPECT_EQ(linear.value(1.0 / 3), "13.33");  // four digits
  EXPECT_EQ(linear.value(1), "20");
  EXPECT_EQ(logarithmic.value(0), "0.001");
  EXPECT_EQ(logarithmic.value(0.5), "0.01");
  EXPECT_EQ(logarithmic.value(1), "0.1");
  EXPECT_EQ(choice.value(0), "a");
  EXPECT_EQ(choice.value(0.26), "b");
  EXPECT_EQ(choice.value(0.99), "d");
  EXPECT_EQ(choice.value(1), "d");
}

TEST(SearchFile, IsReadStrictly) {
  const Folder folder;
  const SearchFile search = load_search_file(folder.write(kSearch));
  EXPECT_EQ(search.minimise.seed, 1u);
  EXPECT_EQ(search.minimise.population, 5);
  EXPECT_EQ(search.minimise.budget, 15);
  EXPECT_EQ(search.target.backlash, (std::vector<double>{0, 1e-4}));
  EXPECT_EQ(search.target.points, 3);
  ASSERT_EQ(search.parameters.size(), 3u);
  EXPECT_TRUE(search.parameters[1].logarithmic);
  EXPECT_EQ(search.parameters[0].choices, std::vector<std::string>{"0"});
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"seed: 1, ", ""},
           {"seed: 1", "seed: 1, sed: 2"},
           {"budget: 15", "budget: 4"},  // less than the population
           {"population: 5", "population: 3"},
           {"promising: 0.5", "promising: 0"},
           {"points: 3", "points: 1"},
           {"phases: 2", "phases: 0"},
           {"skewness: [4.6, 2.9]", "skewness: [4.6]"},
           {"backlash: [0, 1.0e-4]", "backlash: [0, -1.0e-4]"},
           {"half_ranges: [0.3, 0.4]", "half_ranges: []"},
           {"most_classes: 60", "most_classes: 49"},
           {"lower: 1.0e-3", "lower: 0"},  // of a log scale
           {"upper: 2,", "upper: 0,"},     // not above the lower bound
           {"scale: linear", "scale: square"},
           {"choices: [0]", "choices: []"},
           {"choices: [0]", "choices: [0], lower: 1"},
           {"schema_version: 1", "schema_version: 2"},
       }) {
    EXPECT_THROW(load_search_file(folder.write(replaced(kSearch, from, to))), BadData)
        << from << " -> " << to;
  }
  EXPECT_THROW(load_search_file(folder.write(replaced(kSearch, "rig: rig.yaml", "rig: absent.yaml"))),
               MissingInput);
}

TEST(SearchFile, ParametersCanBeSet) {
  const Folder folder;
  SearchFile search = load_search_file(folder.write(kSearch));
  set_parameter(search, "gear_train.input_coupling.damping", "0.053");
  EXPECT_TRUE(search.parameters[1].fixed());
  EXPECT_EQ(search.parameters[1].value(0.5), "0.053");
  set_parameter(search, "gear_train.mesh.contact.alpha", "0.01..1");
  EXPECT_FALSE(search.parameters[2].fixed());
  EXPECT_EQ(search.parameters[2].value(0.5), "0.1");
  set_parameter(search, "gear_train.motor.inertia", "2.24e-4");
  ASSERT_EQ(search.parameters.size(), 4u);
  EXPECT_EQ(search.parameters[3].key, "gear_train.motor.inertia");
  for (const char* wrong : {"0..1", "2..1", "a..b", "1.."})
    EXPECT_THROW(set_parameter(search, "k", wrong), InvalidParameter) << wrong;
}

TEST(ParameterSearch, RefusesAParameterThatTheRigDoesNotKnow) {
  const Folder folder;
  const std::string wrong = replaced(kSearch, "contact.alpha", "contact.alfa");
  EXPECT_THROW(search_parameters(load_search_file(folder.write(wrong))), BadData);
}

TEST(ParameterSearch, DependsOnTheSeedNotOnTheThreadsAndWritesWhatItFound) {
  const Folder folder;
  SearchFile search = load_search_file(folder.write(kSearch));
  search.minimise.threads = 1;
  const SearchResult one = search_parameters(search);
  search.minimise.threads = 3;
  const SearchResult three = search_parameters(search);
  EXPECT_EQ(one.rig_text, three.rig_text);
  EXPECT_EQ(one.fit.rms, three.fit.rms);
  search.minimise.seed = 2;
  EXPECT_NE(search_parameters(search).values, one.values);

  // The text holds the values found, and judged anew it gives the same figures.
  const rig_file::RigFile file = rig_file::rig_file_from_text(one.rig_text, "found");
  EXPECT_EQ(file.rig.input_coupling.damping, std::stod(one.values[1]));
  EXPECT_EQ(file.diagnosis.apd->settling_periods, 0);
  EXPECT_GE(file.diagnosis.apd->layout.classes, 50);
  EXPECT_LE(file.diagnosis.apd->layout.classes, 60);
  const CurveFit again = fit_of(file, search.target);
  EXPECT_EQ(again.rms, one.fit.rms);
  EXPECT_EQ(again.curve.back().skewness, one.fit.curve.back().skewness);
  // Its figures agree with their definitions.
  EXPECT_DOUBLE_EQ(
      again.rms,
      std::hypot(again.published[0].skewness - 4.6, again.published[1].skewness - 2.9) / std::sqrt(2));
  EXPECT_EQ(again.curve.size(), 3u);
  EXPECT_EQ(again.curve[2].skewness, again.published[1].skewness);  // both at 100 um
}

// A rig that never moves out of one or two classes has the skewness of those classes, whatever its backlash.
TEST(ParameterSearch, ReadsTheSkewnessThatWideClassesMustGive) {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.diagnosis.apd->layout = {40, -20, 20};  // the torque is within +-1 N m: classes 19 and 20 alone
  CurveTarget target;
  target.backlash = {1e-4};
  target.skewness = {1};
  target.max_backlash = 2e-4;
  target.points = 2;
  target.phases = 2;
  const CurveFit fit = fit_of(file, target);
  // Two classes of about a half each: (M - 4) / sqrt(2 (M - 2)); shares of 0.4 to 0.6 change it by 2 %.
  EXPECT_NEAR(fit.published[0].skewness, 36 / std::sqrt(76), 0.1);
  EXPECT_NEAR(fit.rms, std::fabs(fit.published[0].skewness - 1), 1e-12);
  EXPECT_NEAR(fit.published[0].highest_class, 50, 10);
}

// The rig of the package that claims to meet the five published values (Sarkar, Ellis and Moore 1997, Fig.
// 10) with rms 0.065 and to fall all the way. 0.08 leaves room for another compiler's rounding: sampling
// phases alone move the values by some hundredths.
TEST(ParameterSearch, TheFittedRigMeetsThePublishedValuesAndItsCurveNeverRises) {
  CurveTarget target;
  target.backlash = {0, 5e-5, 1e-4, 1.5e-4, 2e-4};
  target.skewness = {4.6346, 3.7013, 2.9010, 2.2009, 1.5762};
  target.max_backlash = 2e-4;
  target.points = 21;
  target.phases = 4;
  const rig_file::RigFile file =
      rig_file::load_rig_file(test::package_file("config/sarkar_1997_fitted.yaml"));
  const CurveFit fit = fit_of(file, target);
  EXPECT_LE(fit.rms, 0.08);
  EXPECT_EQ(fit.rise, 0);
  for (std::size_t i = 1; i < fit.curve.size(); ++i)
    EXPECT_LT(fit.curve[i].skewness, fit.curve[i - 1].skewness) << fit.curve[i].backlash;
  // What the paper prints is kept (Table 2), and what it shows is met: Fig. 10 has axes of 30 % and +-0.2 N
  // m.
  EXPECT_EQ(file.rig.motor.inertia, 2.24e-5);
  EXPECT_EQ(file.rig.motor.viscous_damping, 0.0048);
  EXPECT_EQ(file.rig.input_coupling.stiffness, 28.71);
  EXPECT_EQ(file.rig.input_coupling.damping, 0.053);
  EXPECT_EQ(file.rig.pinion.inertia, 2.1e-5);
  EXPECT_EQ(file.rig.gear.inertia, 2.1e-5);
  EXPECT_EQ(file.simulation.excitation.amplitude, 0.05);
  EXPECT_EQ(file.simulation.excitation.frequency, 10);
  for (const CurveFit::Point& point : fit.published) {
    EXPECT_LT(point.highest_class, 30);
    EXPECT_LT(point.largest_torque, 0.2);
  }
}

}  // namespace
}  // namespace backlash::studies
