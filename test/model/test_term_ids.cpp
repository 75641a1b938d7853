// SPDX-License-Identifier: BSD-3-Clause
// Only src/model/terms knows a term by its id: everyone else asks what it can do (TermType). So a new term is
// one new file and one line in the registry.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = BACKLASH_DIAGNOSIS_SOURCE_DIR;

/// Words that are ids and mean something else as well: what, and in which file ("": in any).
const std::set<std::pair<std::string, std::string>> kOtherMeanings = {
    {"backlash", ""},  // the quantity: keys of files, of JSON and of messages
    {"delay", "src/findings/identification_report.cpp"},         // of the sensors, a key of the identify JSON
    {"delay", "src/identification/procedures/one_inertia.cpp"},  // the option of that name
    {"delay", "src/arm_findings/arm_report.cpp"},                // of a joint's current, a key of its JSON
    {"delay", "src/arm/arm_rig.cpp"},                            // the same in the rig file of an arm
    {"gravity", "src/arm/arm_rig.cpp"},                          // where it points, a key there
    {"gravity", "src/arm_findings/identified_mjcf.cpp"},         // the same in a file of MuJoCo
    {"friction_drift", "src/arm/trace.cpp"},                     // an arm has no terms: the effect of a joint
};

/// A fault of one place has a bump of its own for each direction; a term that another simulator's language
/// has is translated by name.
const std::set<std::string> kOtherDictionaries = {"src/changes/local_fault.cpp", "src/arm/joint_effect.cpp",
                                                  "src/report/joint_model.cpp"};

std::string text_of(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(TermIds, AreLiteralsOfTheirOwnFilesOnly) {
  int files = 0;
  for (const char* folder : {"src", "include"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kSource / folder)) {
      const std::string path = fs::relative(entry.path(), kSource).string();
      const std::string extension = entry.path().extension().string();
      if ((extension != ".cpp" && extension != ".h") || path.find("src/model/terms/") == 0) continue;
      if (kOtherDictionaries.count(path) > 0) continue;
      ++files;
      const std::string text = text_of(entry.path());
      for (const TermType& type : term_types()) {
        if (kOtherMeanings.count({type.id, ""}) + kOtherMeanings.count({type.id, path}) > 0) continue;
        EXPECT_EQ(text.find('"' + type.id + '"'), std::string::npos) << path << " names the term " << type.id;
      }
    }
  }
  EXPECT_GT(files, 200);  // it has looked at the sources
}

TEST(TermIds, AreFoundWhereTheyMayStand) {
  for (const TermType& type : term_types())
    EXPECT_NE(text_of(kSource / "src/model/terms" / (type.id + ".cpp")).find('"' + type.id + '"'),
              std::string::npos)
        << type.id;
}

TEST(TermIds, WhatATermCanIsSaidOnce) {
  const auto of = [](bool (*can)(const TermType&)) { return term_type_that(can).id; };
  EXPECT_EQ(of([](const TermType& t) { return t.map.has_value(); }), "learned_map");
  EXPECT_EQ(of([](const TermType& t) { return t.calibrates == Calibrates::torque_delay; }), "delay");
  EXPECT_EQ(of([](const TermType& t) { return t.shapes_friction; }), "presliding");
  EXPECT_EQ(of([](const TermType& t) { return t.stands_in_for_contact_law; }), "mesh_hardening");
  EXPECT_EQ(of([](const TermType& t) { return t.gap_variation == GapVariation::harmonic; }),
            "varying_backlash");
  EXPECT_EQ(of([](const TermType& t) { return t.gap_variation == GapVariation::table; }), "backlash_map");
}

/// Each kind of map that is learned can be made, with the units that the header of the term states.
TEST(TermIds, EveryKindOfALearnedMapCanBeMade) {
  const TermType& type = term_type_that([](const TermType& t) { return t.map.has_value(); });
  const TermMap& map = *type.map;
  const MotionRange range{10, 1, 0.01, -1, 1, 5, 1e-3};
  for (const MapKind& kind : map.kinds) {
    ParameterValues values;
    values.set_choice(map.acts_on, kind.acts_on);
    values.set_choice(map.coordinate, kind.coordinate);
    values.set_list(map.points, {0, 1});
    values.set_list(map.values, {0, kind.typical(range)});
    EXPECT_NO_THROW(make_term(type.id, values)) << kind.acts_on << " " << kind.coordinate;
    const bool torque = kind.acts_on == "motor" || kind.acts_on == "load";
    const bool stiffness = kind.acts_on.find("stiffness") != std::string::npos;
    EXPECT_EQ(kind.unit, torque ? "N m" : stiffness ? "-" : "rad") << kind.acts_on;
    EXPECT_GT(kind.typical(range), 0);
    EXPECT_GT(kind.typical(range), kind.least);
  }
}

}  // namespace
}  // namespace backlash::model
