// SPDX-License-Identifier: BSD-3-Clause
// The report of a trace that was put together by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/findings/trace_folder.h"
#include "backlash_diagnosis/findings/trace_report.h"
#include "backlash_diagnosis/signal/measured_text.h"
#include "support/data.h"

namespace backlash::findings {
namespace {

using Json = nlohmann::ordered_json;

const double kUnknown = std::nan("");
const TraceInputs kInputs = {"rig.yaml", {"a.csv", "b<i>.csv"}, "test.csv"};

std::shared_ptr<const model::Term> drag() {
  ParameterValues values = {{"drag", 2.0}};
  values.set_choice("body", "motor");
  return model::make_term("quadratic_drag", values);
}

identification::TraceSeries series() {
  identification::TraceSeries s;
  for (int k = 0; k < 2000; ++k) {
    const double t = k * 1e-3, w = std::cos(7 * t);
    s.time.push_back(t);
    s.motor_position.push_back(std::sin(7 * t) / 7);
    s.motor_velocity.push_back(w);
    s.motor_torque.push_back(10 * w);
    s.mesh_torque.push_back(5 * w);
    s.torque_counts.push_back(std::fabs(w) > 0.1);
    s.deflection_counts.push_back(1);
    s.torque.push_back(10 * w);
    s.torque_before.push_back(10 * w + 2 * w * std::fabs(w));
    s.torque_after.push_back(10 * w);
    s.deflection.push_back(1e-4 * w);
  }
  s.load_position = s.motor_position;
  s.load_velocity = s.motor_velocity;
  s.deflection_before = s.deflection_after = s.deflection;
  return s;
}

identification::Trace trace() {
  identification::Trace t;
  t.verdict = identification::TraceVerdict::effect_found;
  t.cutoff = 25;
  t.augmented = t.base = rig_file::load_rig_file(test::package_file("config/two_inertia_servo.yaml")).rig;
  t.augmented.name = "a < b & \"c\"";
  t.augmented.terms = {drag()};
  t.base_parameters = {{"motor_inertia", {6.2, 0.3}}};
  t.parameters = {{"motor_inertia", {6.31234, 0.0123}}};
  t.units = {{"motor_inertia", "kg m^2"}};
  t.channels["torque"] = {0.05, 0.004, 0.003, 0.06, kUnknown};
  t.channels["deflection"] = {0.02, 0.02, 0.019, 0.02, 0.02};
  identification::FoundEffect e;
  e.id = "quadratic_drag";
  e.channel = "torque";
  e.terms = {0};
  e.words = {{"body", "motor"}};
  e.parameters = {{"drag", "N m s^2/rad^2", {2, kUnknown}}};
  e.evidence = {0.9, 0.8};
  e.test_error_before = 0.05;
  e.test_error_after = 0.004;
  e.equivalent_to = {"asymmetric_viscous"};
  t.steps = {e};
  t.rejected = {{"cogging", "others explain it"}};
  t.independence = {{"torque", "motor_velocity", 0.61, 0.012}};
  t.warnings = {"b.csv: 3 gaps"};
  t.series = series();
  return t;
}

TEST(TraceReport, JsonIsTheContract) {
  const Json json = Json::parse(trace_report_json(trace(), kInputs));
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["verdict"], "effect_found");
  EXPECT_EQ(json["rig"], "rig.yaml");
  EXPECT_EQ(json["train"], (Json{"a.csv", "b<i>.csv"}));
  EXPECT_EQ(json["cutoff"]["value"], 25);
  EXPECT_EQ(json["channels"]["torque"]["before"], 0.05);
  EXPECT_EQ(json["channels"]["torque"]["after"], 0.004);
  EXPECT_EQ(json["channels"]["torque"]["floor"], 0.003);
  EXPECT_TRUE(json["channels"]["torque"]["train_after"].is_null());  // not known
  ASSERT_EQ(json["steps"].size(), 1u);
  const Json& step = json["steps"][0];
  EXPECT_EQ(step["effect"], "quadratic_drag");
  EXPECT_EQ(step["channel"], "torque");
  EXPECT_EQ(step["parameters"]["drag"]["value"], 2);
  EXPECT_EQ(step["parameters"]["drag"]["unit"], "N m s^2/rad^2");
  EXPECT_TRUE(step["parameters"]["drag"]["standard_error"].is_null());
  EXPECT_EQ(step["test_error_before"], 0.05);
  EXPECT_EQ(step["test_error_after"], 0.004);
  EXPECT_EQ(step["evidence"]["gain_held_out"], 0.8);
  EXPECT_EQ(step["equivalent_to"], Json{"asymmetric_viscous"});
  EXPECT_EQ(step["choices"]["body"], "motor");
  EXPECT_EQ(step["terms"][0], (Json{{"id", "quadratic_drag"}, {"body", "motor"}, {"drag", 2.0}}));
  EXPECT_TRUE(json["unexplained"].is_null());
  EXPECT_EQ(json["rejected"], (Json{{{"effect", "cogging"}, {"reason", "others explain it"}}}));
  EXPECT_EQ(json["parameters"]["motor_inertia"]["standard_error"], 0.0123);
  EXPECT_EQ(json["base_parameters"]["motor_inertia"]["value"], 6.2);
  EXPECT_EQ(json["independence"][0]["input"], "motor_velocity");
  EXPECT_EQ(json["independence"][0]["after"], 0.012);
  EXPECT_EQ(json["warnings"], Json{"b.csv: 3 gaps"});
}

TEST(TraceReport, SaysWhetherAnErrorFallsStaysOrRises) {
  identification::Trace t = trace();
  const std::pair<double, const char*> cases[] = {{0.01, "torque falls from 3 % to 1 %"},
                                                  {0.0301, "torque stays at 3.01 %"},
                                                  {0.04, "torque rises from 3 % to 4 %"}};
  for (const auto& [after, text] : cases) {
    t.channels["torque"] = {0.03, after, 0.01, 0.03, 0.01};
    EXPECT_NE(verdict_sentence(t).find(text), std::string::npos) << verdict_sentence(t);
  }
}

TEST(TraceReport, UnexplainedIsSaidWithItsSignature) {
  identification::Trace t = trace();
  t.verdict = identification::TraceVerdict::unexplained;
  t.unexplained =
      identification::Unexplained{"deflection", "follows load position, order 7.3", {0.5, 0.4, 0.6}};
  const Json json = Json::parse(trace_report_json(t, kInputs));
  EXPECT_EQ(json["verdict"], "unexplained");
  EXPECT_EQ(json["unexplained"]["channel"], "deflection");
  EXPECT_EQ(json["unexplained"]["signature"], "follows load position, order 7.3");
  EXPECT_EQ(json["unexplained"]["explainable"], 0.5);
  EXPECT_NE(verdict_sentence(t).find("lacks quadratic_drag"), std::string::npos);
  EXPECT_NE(verdict_sentence(t).find("order 7.3"), std::string::npos);
  t.steps.clear();
  EXPECT_EQ(verdict_sentence(t).find("lacks"), std::string::npos);
  t.verdict = identification::TraceVerdict::nothing_missing;
  EXPECT_EQ(verdict_sentence(t).find("Nothing is missing"), 0u);
}

TEST(TraceReport, UnitsOfALinearAxis) {
  identification::Trace t = trace();
  t.augmented.linear = true;
  const Json json = Json::parse(trace_report_json(t, kInputs));
  EXPECT_EQ(json["steps"][0]["parameters"]["drag"]["unit"], "N s^2/m^2");
  EXPECT_EQ(json["parameters"]["motor_inertia"]["unit"], "kg");
  const Json drawn = Json::parse(trace_series_json(t));
  EXPECT_EQ(drawn["coordinates"]["motor_velocity"]["unit"], "m/s");
  EXPECT_EQ(drawn["channels"]["torque"]["unit"], "N");
}

TEST(TraceReport, SeriesAreThinnedAndHaveGapsWhereSamplesDoNotCount) {
  const identification::Trace t = trace();
  const Json json = Json::parse(trace_series_json(t));
  // Four samples per cycle of 25 Hz: each tenth of 1 kHz.
  const Json &time = json["coordinates"]["time"]["values"], &torque = json["channels"]["torque"];
  ASSERT_EQ(time.size(), 200u);
  EXPECT_NEAR(time[1].get<double>(), 0.01, 1e-9);
  for (std::size_t i = 0; i < 200; ++i) {
    const double w = std::cos(7 * 0.01 * double(i));
    EXPECT_EQ(torque["after"][i].is_null(), std::fabs(w) <= 0.1) << i;
    EXPECT_NEAR(torque["measured"][i].get<double>(), 10 * w, 1e-5);
    // -drag w |w| on the motor (Batchelor 1967, as the term's header has it)
    const Json& drawn = json["steps"][0]["contributions"];
    ASSERT_EQ(drawn.size(), 1u);
    EXPECT_EQ(drawn[0]["quantity"], "torque on the motor");
    EXPECT_NEAR(drawn[0]["values"][i].get<double>(), -2 * w * std::fabs(w), 1e-6);
  }
}

TEST(TraceReport, DryFrictionOpposesMotion) {
  identification::Trace t = trace();
  ParameterValues values = {{"torque", 1.5}};
  values.set_choice("body", "load");
  t.augmented.terms = {model::make_term("asymmetric_coulomb", values)};
  const Json json = Json::parse(trace_series_json(t));
  const Json& drawn = json["steps"][0]["contributions"];
  EXPECT_TRUE(drawn.empty());  // 1.5 more against forward motion and less against backward: -1.5 all the time
  t.augmented.terms = {model::make_term("gravity", {{"amplitude", 3}, {"phase", 0.2}}), t.augmented.terms[0]};
  t.steps[0].terms = {0, 1};
  const Json both = Json::parse(trace_series_json(t))["steps"][0]["contributions"][0];
  EXPECT_EQ(both["quantity"], "torque on the load");
  const double q = std::sin(0.07) / 7;
  EXPECT_NEAR(both["values"][1].get<double>(), -3 * std::sin(q + 0.2) - 1.5, 1e-5);
}

TEST(TraceReport, ALearnedMapIsSaidToBeOne) {
  identification::Trace t = trace();
  t.steps[0].id = "learned_map";
  t.steps[0].words = {{"acts_on", "motor"}, {"coordinate", "motor_torque"}};
  t.steps[0].nearest = {"cogging"};
  EXPECT_NE(verdict_sentence(t).find("lacks a function of motor_torque that is not one of the named effects"),
            std::string::npos);
  EXPECT_NE(trace_summary(t).find("nearest named effects: cogging"), std::string::npos);
  EXPECT_NE(trace_page(t, kInputs, "", "").find("nearest named effects: cogging"), std::string::npos);
  EXPECT_EQ(Json::parse(trace_report_json(t, kInputs))["steps"][0]["nearest"], Json{"cogging"});
}

TEST(TraceReport, NumbersHaveAsManyDigitsAsTheirErrorLeaves) {
  EXPECT_EQ(signal::with_error({6.31234, 0.0123}), "6.312 +- 0.012");
  EXPECT_EQ(signal::with_error({0.001, 20}), "0.001 +- 20");
  EXPECT_EQ(signal::with_error({15, 0}), "15");
  EXPECT_EQ(signal::with_error({2.5, kUnknown}), "2.5");
  EXPECT_EQ(percent(0.01234), "1.23 %");
  EXPECT_EQ(percent(kUnknown), "unknown");
}

TEST(TraceReport, PageHoldsEverythingAndAsksForNothing) {
  const std::string page = trace_page(trace(), kInputs, "<p>the plots</p>", "<p>the rig</p>");
  for (const char* part :
       {"a &lt; b &amp; &quot;c&quot;", "b&lt;i&gt;.csv", "quadratic_drag", "body: motor", "2 N m s^2/rad^2",
        "5 % &rarr; 0.4 %", "blocks left out 80 %", "asymmetric_viscous", "6.312 &plusmn; 0.012 kg m^2",
        "<p>the plots</p>", "<p>the rig</p>", "b.csv: 3 gaps", "noise alone", "61 %", "1.2 %",
        "class=\"verdict effect_found\""})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  for (const char* part : {"http:", "https:", "<script", "<link", "nan", "url("})
    EXPECT_EQ(page.find(part), std::string::npos) << part;
}

class TraceFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::path(testing::TempDir()) / "trace_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    top_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(top_); }
  std::string path(const std::string& name) const { return (top_ / name).string(); }
  std::filesystem::path top_;
};

TEST_F(TraceFolderTest, GoesAwayWithoutFilesAndNeverReplacesInputs) {
  { const TraceFolder folder(path("new"), {}); }
  EXPECT_FALSE(std::filesystem::exists(path("new")));
  std::filesystem::create_directory(path("old"));
  { const TraceFolder folder(path("old"), {}); }
  EXPECT_TRUE(std::filesystem::exists(path("old")));
  std::ofstream(path("old/rig.yaml")) << "x";
  std::filesystem::create_symlink("old/rig.yaml", path("link.yaml"));
  EXPECT_THROW(TraceFolder(path("old"), {path("link.yaml")}), CannotWrite);
  EXPECT_THROW(TraceFolder(path("old/rig.yaml"), {}), CannotWrite);
  EXPECT_THROW(TraceFolder(path("old/rig.yaml/more"), {}), CannotWrite);
}

TEST_F(TraceFolderTest, HoldsRigAndPageAlsoWhereNothingCanBeDrawn) {
  identification::Trace t = trace();
  t.series.torque.clear();  // refused by the script, where there is one
  const rig_file::RigFile declared =
      rig_file::load_rig_file(test::package_file("config/two_inertia_servo.yaml"));
  const TraceFolder folder(path("a/b"), {});
  folder.write(t, declared, kInputs);
  EXPECT_EQ(rig_file::load_rig_file(folder.files().rig).rig.terms.size(), 1u);
  std::ifstream in(folder.files().page);
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(page.find("</html>"), std::string::npos);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path("a/b")), {}), 4);
}

}  // namespace
}  // namespace backlash::findings
