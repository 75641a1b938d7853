// SPDX-License-Identifier: BSD-3-Clause
// The whole chain on simulated records of the Sarkar rig: rig file, curve, record, diagnosis.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "support/data.h"
#include "support/estimates.h"
#include "support/records.h"

namespace backlash::studies {
namespace {

constexpr double kNoise = 0.001;  // N m, of the torque sensor
constexpr double kRate = 5000;    // Hz

rig_file::RigFile rig() {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.simulation.sensors.sampling_rate = kRate;
  file.simulation.sensors.of(record::Channel::sensor_torque).noise = kNoise;
  return file;
}

/// One curve for all tests of this file, up to 200 um of total backlash.
const diagnosis::MonitoringCurve& curve() {
  static const diagnosis::MonitoringCurve built = [] {
    CurveRequest request;
    request.points = 11;
    request.periods = 5;
    request.seeds = 4;
    request.machines = 0;
    return build_curve(rig(), request);
  }();
  return built;
}

using Change = std::function<void(rig_file::RigFile&)>;

record::Record record_of(double half_gap, unsigned seed = 77, double duration = 1.2,
                         const Change& change = nullptr) {
  rig_file::RigFile file = rig();
  file.rig.mesh.backlash = 2 * half_gap;
  file.simulation.sensors.seed = seed;
  if (change) change(file);
  return simulation::simulate_record(file.rig, file.simulation, duration);
}

diagnosis::Diagnosis diagnosed(const record::Record& record) {
  diagnosis::DiagnosisSettings settings = rig().diagnosis;
  settings.leave_out_waveform();  // test_waveform.cpp
  return diagnosis::diagnose(record, settings, &curve());
}

/// Whether an answer is right: its interval holds the truth, its bound lies below, or it does not claim to
/// know.
bool right(const diagnosis::Estimate& e, double truth) {
  const double rounding = 1e-12;  // m
  if (e.status == diagnosis::Status::ok) return e.lower <= truth + rounding && truth <= e.upper + rounding;
  if (e.status == diagnosis::Status::above_range) return e.lower <= truth + rounding;
  return true;
}

TEST(RigDiagnosis, WithoutMotorTorqueNoRingingOfTheSensorIsTakenForAWall) {
  int answers = 0;
  for (const double half_gap : {10e-6, 20e-6, 60e-6, 80e-6})
    for (const double frequency : {5.0, 8.0, 10.0}) {
      record::Record record = record_of(half_gap, 5, 2.2, [frequency](rig_file::RigFile& f) {
        f.simulation.excitation.frequency = frequency;
      });
      record.column(record::Channel::motor_torque).clear();
      const diagnosis::Estimate e =
          diagnosis::diagnose(record, rig().diagnosis, nullptr, std::nullopt, "lost_motion")
              .estimates.front();
      EXPECT_TRUE(right(e, 2 * half_gap)) << half_gap << ' ' << frequency << ' ' << e.backlash;
      answers += e.status == diagnosis::Status::ok;
    }
  EXPECT_GE(answers, 6);  // small gaps ring little and must be answered
}

TEST(RigDiagnosis, IntervalsHoldTheTruth) {
  int answers = 0, wrong = 0, informative = 0;
  for (const double half_gap :
       {0.0, 5e-6, 10e-6, 20e-6, 30e-6, 40e-6, 50e-6, 60e-6, 70e-6, 80e-6, 90e-6, 99e-6})
    for (const unsigned seed : {3u, 4u}) {
      record::Record record = record_of(half_gap, seed);
      const diagnosis::Diagnosis d = diagnosed(record);
      for (const diagnosis::Estimate& e : d.estimates) {
        ++answers;
        informative += e.status == diagnosis::Status::ok;
        if (right(e, 2 * half_gap)) continue;
        ++wrong;
        // Even a miss must be a near one: half of its interval's width again.
        const double slack = 0.5 * (e.upper - e.lower);
        EXPECT_LE(e.lower - slack, 2 * half_gap) << e.method << ' ' << half_gap;
        EXPECT_GE(e.upper + slack, 2 * half_gap) << e.method << ' ' << half_gap;
      }
      // The motor's own travel shows the play to the rig's ringing; 3 um as the records of the separate
      // program.
      ASSERT_GE(d.verdict.estimate, 0) << half_gap << ": " << d.verdict.message;
      EXPECT_NEAR(d.estimates[d.verdict.estimate].backlash, 2 * half_gap, 3e-6) << d.verdict.message;
      EXPECT_EQ(d.verdict.agreement, "agree") << half_gap << ": " << d.verdict.message;
    }
  // 95 % intervals: 72 answers miss 3.6 times in the mean, more than 9 times with a probability of 0.4 %.
  EXPECT_LE(wrong, 9);
  EXPECT_GE(informative, 60);  // all but those that reach the end of the curve
  EXPECT_GE(answers, 72);
}

TEST(RigDiagnosis, SkewnessAloneIsNeverConfidentlyWrong) {
  int wrong = 0, answers = 0;
  for (const double half_gap : {0.0, 15e-6, 30e-6, 45e-6, 60e-6, 75e-6, 95e-6})
    for (const double noise : {0.0, 0.003, 0.01, 0.02}) {
      record::Record record = record_of(half_gap, 5, 1.2, [noise](rig_file::RigFile& f) {
        f.simulation.sensors.of(record::Channel::sensor_torque).noise = noise;
      });
      for (const record::Channel channel :
           {record::Channel::motor_torque, record::Channel::motor_position, record::Channel::load_position})
        record.column(channel).clear();
      const diagnosis::Estimate e = diagnosed(record).estimates[0];
      ++answers;
      wrong += !right(e, 2 * half_gap);
      if (noise < 0.012) continue;  // 1.2 times the largest on the curve
      EXPECT_EQ(e.status, diagnosis::Status::out_of_domain) << e.message;
    }
  // 5 % of 28 is 1.4 in the mean; more than 5 with a probability of 0.2 %.
  EXPECT_LE(wrong, 5);
  EXPECT_EQ(answers, 28);
}

TEST(RigDiagnosis, BacklashBeyondTheCurve) {
  for (const double half_gap : {112e-6, 120e-6, 150e-6, 250e-6}) {
    const record::Record record = record_of(half_gap);
    const diagnosis::Diagnosis d = diagnosed(record);
    EXPECT_TRUE(d.estimates[0].status == diagnosis::Status::out_of_domain ||
                d.estimates[0].status == diagnosis::Status::above_range)
        << half_gap << ": " << d.estimates[0].message;
    EXPECT_EQ(d.verdict.grade, diagnosis::Grade::stop) << d.verdict.message;  // by lost_motion
  }
}

struct Variant {
  std::string name;
  Change change;
  std::string reason;          // with all channels
  std::string without_torque;  // the reason without motor_torque; empty: no check of it
  std::string
      without_position;  // without motor_position and load_position, but with motor_torque; empty likewise
};

TEST(RigDiagnosis, OtherConditionsAreRefusedWithTheReason) {
  const auto amplitude = [](double factor) {
    return [factor](rig_file::RigFile& f) { f.simulation.excitation.amplitude *= factor; };
  };
  const auto frequency = [](double hertz) {
    return [hertz](rig_file::RigFile& f) { f.simulation.excitation.frequency = hertz; };
  };
  const auto limit = [](double torque) {
    return [torque](rig_file::RigFile& f) {
      f.simulation.sensors.of(record::Channel::sensor_torque).limit = torque;
    };
  };
  const std::vector<Variant> variants = {
      {"20 % more", amplitude(1.2), "excitation level", "signal level", "excitation level"},
      {"20 % less", amplitude(0.8), "excitation level", "signal level", "excitation level"},
      {"8 Hz", frequency(8), "excitation frequency", "excitation frequency", "excitation frequency"},
      {"12.5 Hz", frequency(12.5), "excitation frequency", "excitation frequency", "excitation frequency"},
      {"2 kHz", [](rig_file::RigFile& f) { f.simulation.sensors.sampling_rate = 2000; }, "sampling rate",
       "sampling rate", "sampling rate"},
      {"saturated at 0.09 N m", limit(0.09), "saturated", "saturated", "saturated"},
      {"saturated at 0.06 N m", limit(0.06), "saturated", "saturated", "saturated"},
      {"saturated at 0.04 N m", limit(0.04), "saturated", "saturated", "saturated"},
      {"constant torque", [](rig_file::RigFile& f) { f.simulation.excitation.type = "constant"; }, "constant",
       "excitation", "constant"},
      {"sine", [](rig_file::RigFile& f) { f.simulation.excitation.type = "sine"; }, "excitation level",
       "signal level", "excitation level"},
      {"sine of the same level",
       [](rig_file::RigFile& f) {
         f.simulation.excitation.type = "sine";
         f.simulation.excitation.amplitude *= std::sqrt(2.0);
       },
       "excitation amplitude", "", "excitation amplitude"},
      {"free output",
       [](rig_file::RigFile& f) {
         f.rig.link_locked = false;
         f.rig.link.inertia = 1e-3;
       },
       "output moves", "output moves", ""},
      {"light free output",
       [](rig_file::RigFile& f) {
         f.rig.link_locked = false;
         f.rig.link.inertia = 1e-5;
         f.rig.link.viscous_damping = 1e-3;
       },
       "signal level", "signal level", "signal level"},
  };
  for (const Variant& variant : variants)
    for (const double half_gap : {0.0, 30e-6, 60e-6}) {
      const record::Record full = record_of(half_gap, 8, 1.0, variant.change);
      record::Record no_torque = full, no_position = full;
      no_torque.column(record::Channel::motor_torque).clear();
      no_position.column(record::Channel::motor_position).clear();
      no_position.column(record::Channel::load_position).clear();
      const auto expect_refused = [&](const record::Record& record, const std::string& reason,
                                      const char* what) {
        if (reason.empty()) return;
        const diagnosis::Estimate e = diagnosed(record).estimates[0];
        EXPECT_EQ(e.status, diagnosis::Status::out_of_domain)
            << variant.name << ' ' << half_gap << what << ": " << e.message;
        EXPECT_NE(e.message.find(reason), std::string::npos)
            << variant.name << ' ' << half_gap << what << ": " << e.message;
      };
      expect_refused(full, variant.reason, "");
      expect_refused(no_torque, variant.without_torque, " without motor_torque");
      expect_refused(no_position, variant.without_position, " without positions");
    }
}

TEST(RigDiagnosis, RecordsTooShortAndOutputsThatMove) {
  for (const double duration : {0.02, 0.1, 0.29}) {
    const diagnosis::Diagnosis d = diagnosed(record_of(30e-6, 8, duration));
    EXPECT_EQ(d.estimates[0].status, diagnosis::Status::insufficient_data) << duration;
    EXPECT_NE(d.estimates[0].message.find("whole excitation period"), std::string::npos)
        << d.estimates[0].message;
    EXPECT_EQ(d.verdict.grade, diagnosis::Grade::cannot_tell);
  }
  record::Record record = record_of(30e-6);
  for (std::size_t i = 0; i < record.size(); ++i)
    record.column(record::Channel::load_position)[i] = 1e-3 * std::sin(2 * M_PI * 3 * record.time[i]);
  const diagnosis::Diagnosis d = diagnosed(record);
  for (const char* method : {"apd_skewness", "apd_shape", "lost_motion"}) {  // the others allow it
    const diagnosis::Estimate& e = test::by(method, d.estimates);
    EXPECT_EQ(e.status, diagnosis::Status::out_of_domain) << e.message;
    EXPECT_NE(e.message.find("output"), std::string::npos) << e.message;
  }
}

TEST(RigDiagnosis, TheSamplingPhaseAndTheStartDoNotMatter) {
  const record::Record record = record_of(50e-6);
  const diagnosis::Estimate all = diagnosed(record).estimates[0];
  for (const std::size_t skipped : {1u, 137u, 250u, 499u}) {
    record::Record cut = record;
    test::cut_out(cut, 0, static_cast<std::ptrdiff_t>(skipped));
    for (double& t : cut.time) t += 1.7e9;
    const diagnosis::Estimate e = diagnosed(cut).estimates[0];
    EXPECT_EQ(e.status, diagnosis::Status::ok) << e.message;
    // The windows now begin elsewhere in a periodic motion: the same samples but for those that noise moves.
    EXPECT_NEAR(e.skewness, all.skewness, 3 * curve().at(1e-4, kNoise).within + 0.02) << skipped;
    EXPECT_TRUE(right(e, 1e-4)) << e.message;
  }
}

// Records of a separate program with the parameters of the rig file.
TEST(RigDiagnosis, RecordsOfASeparateProgram) {
  std::vector<std::pair<double, std::string>> files;
  for (const int half_gap : {0, 30, 55, 80})
    if (const auto path = test::find_data("rig/rig_halfgap_" + std::to_string(half_gap) + "um.csv"))
      files.emplace_back(2e-6 * half_gap, *path);
  if (files.empty())
    GTEST_SKIP() << "no rig/rig_halfgap_*um.csv in $BACKLASH_DIAGNOSIS_DATA or ../shared/data";
  const rig_file::RigFile file = rig_file::default_rig_file();
  CurveRequest request;
  request.points = 21;
  const diagnosis::MonitoringCurve at_1khz = build_curve(file, request);
  for (const auto& [truth, path] : files) {
    SCOPED_TRACE(path);
    const record::Record record = record::read_csv(path);
    const diagnosis::Diagnosis d = diagnosis::diagnose(record, file.diagnosis, &at_1khz);
    for (const diagnosis::Estimate& e : d.estimates)
      EXPECT_TRUE(right(e, truth)) << e.method << ": " << e.message;
    ASSERT_GE(d.verdict.estimate, 0) << d.verdict.message;
    EXPECT_NEAR(d.estimates[d.verdict.estimate].backlash, truth, 3e-6) << d.verdict.message;
    EXPECT_EQ(d.verdict.agreement.find("disagree"), std::string::npos) << d.verdict.message;
    // Noise of the sensor: 0.002 N m. Five standard errors with 170 stretches, see test_noise.cpp; at 80 um
    // the motion does not repeat and the estimate is an upper bound.
    EXPECT_GT(d.apd->noise_range.upper / 0.002, 0.80);
    EXPECT_LT(d.apd->noise_range.lower / 0.002, 1.20);
    EXPECT_TRUE(d.apd->noise_range.lower > 0 || truth > 1.5e-4);
  }
}

}  // namespace
}  // namespace backlash::studies
