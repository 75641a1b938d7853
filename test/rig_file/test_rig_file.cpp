// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/declared_uncertainty.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/data.h"

namespace backlash::rig_file {
namespace {

namespace fs = std::filesystem;

/// A file that lives as long as this.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text)
      : path_((fs::temp_directory_path() / ("rig_file_" + std::to_string(::getpid()) + ".yaml")).string()) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~TemporaryFile() { fs::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

RigFile load(const std::string& text) {
  return load_rig_file(TemporaryFile(text).path());
}

std::string content_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

const char* const kTwoInertias =
    "schema_version: 1\n"
    "name: two_inertias\n"
    "joint: elbow\n"
    "gear_train:\n"
    "  reduction_ratio: 4\n"
    "  motor: {inertia: 1.0e-3}\n"
    "  input_coupling: rigid\n"
    "  mesh: {base_radius: 0.02, backlash: 1.0e-4, contact: {law: linear, stiffness: 1.0e7, damping: 10}}\n"
    "  output_coupling: rigid\n"
    "  link: {inertia: 0.01}\n"
    "excitation: {type: sine, amplitude: 1, frequency: 2}\n"
    "sensors: {sampling_rate: 500, seed: 3}\n"
    "diagnosis:\n"
    "  lost_motion: {torque: 0.5, elastic_deflection: subtracted}\n"
    "  limits: {backlash: {watch: 1, service: 2, stop: 3}}\n";

TEST(RigFile, EveryRigOfThePackageLoads) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(test::package_file("config"))) {
    if (entry.path().extension() != ".yaml") continue;
    if (entry.path().stem().string().find("_search") != std::string::npos) continue;  // of search_parameters
    const std::string path = entry.path().string();
    if (!YamlReader::from_file(path).has("gear_train")) continue;  // not a rig
    SCOPED_TRACE(path);
    RigFile file;
    ASSERT_NO_THROW(file = load_rig_file(path));
    ++count;
    EXPECT_EQ(file.source, path);
    EXPECT_EQ(file.text, content_of(path));
    EXPECT_EQ(file.rig.name, fs::canonical(entry.path()).stem().string());  // old names are links
    EXPECT_NO_THROW(simulation::Simulation(file.rig, file.simulation).step());
  }
  EXPECT_GE(count, 1);
}

TEST(RigFile, TheDefaultIsTheFileOfThePackage) {
  const RigFile built_in = default_rig_file(),
                file = load_rig_file(test::package_file("config/sarkar_1997.yaml"));
  EXPECT_EQ(built_in.text, file.text);
  EXPECT_EQ(built_in.digest, file.digest);
  EXPECT_NE(built_in.source, file.source);
  EXPECT_EQ(built_in.rig.name, "sarkar_1997");
}

TEST(RigFile, TheSarkarRigAsPublished) {
  const RigFile file = default_rig_file();
  EXPECT_EQ(file.rig.motor.inertia, 2.24e-5);
  EXPECT_EQ(file.rig.input_coupling.stiffness, 28.71);
  EXPECT_TRUE(file.rig.link_locked);
  EXPECT_EQ(file.simulation.excitation.type, "square");
  EXPECT_EQ(file.simulation.excitation.amplitude, 0.05);
  EXPECT_EQ(file.simulation.excitation.frequency, 10);
  EXPECT_EQ(file.simulation.sensors.sampling_rate, 1000);
  ASSERT_TRUE(file.diagnosis.apd && file.diagnosis.lost_motion && file.diagnosis.limits);
  EXPECT_EQ(file.diagnosis.apd->period, 0.1);
  EXPECT_TRUE(file.diagnosis.apd->layout == (diagnosis::ApdLayout{60, -0.4, 0.4}));
  EXPECT_TRUE(file.diagnosis.lost_motion->subtract_elastic_deflection);
}

// One flank loaded: both springs in series with the contact F = K d^1.5.
TEST(RigFile, LostMotionKnowsTheElasticDeflectionAndTheBaseRadius) {
  const RigFile file = default_rig_file();
  const diagnosis::LostMotionSettings& lost_motion = *file.diagnosis.lost_motion;
  EXPECT_DOUBLE_EQ(lost_motion.base_radius, 0.014917);
  const double torque = 0.05, radius = 0.014917;
  const double expected =
      torque / 28.71 + torque / 6310 + std::pow(torque / radius / 2.28e8, 1 / 1.5) / radius;
  ASSERT_TRUE(lost_motion.elastic_deflection);
  EXPECT_NEAR(lost_motion.elastic_deflection(torque), expected, 1e-12);
}

TEST(RigFile, MotorSideAxisScalesBaseRadiusAndDeflection) {
  const RigFile load_side = load(kTwoInertias);
  const RigFile motor_side =
      load(replaced(kTwoInertias, "reduction_ratio: 4\n", "reduction_ratio: 4\n  motor_side: true\n"));
  EXPECT_DOUBLE_EQ(load_side.diagnosis.lost_motion->base_radius, 0.02);
  EXPECT_DOUBLE_EQ(motor_side.diagnosis.lost_motion->base_radius, 0.02 / 4);
  // Linear contact at lever r: T / (K r^2); on the motor side torque and angle are scaled by the ratio.
  EXPECT_NEAR(load_side.diagnosis.lost_motion->elastic_deflection(0.5), 0.5 / (1e7 * 0.02 * 0.02), 1e-15);
  EXPECT_NEAR(motor_side.diagnosis.lost_motion->elastic_deflection(0.5), 4 * 4 * 0.5 / (1e7 * 0.02 * 0.02),
              1e-15);
}

// The encoders are before the shaft: what they show is as without it. Behind it they show both.
TEST(RigFile, AShaftBehindTheLoadsEncoderChangesNoDeflection) {
  const auto with_shaft = [](const std::string& bearing) {
    const std::string shaft =
        "{stiffness: 2.0e3, damping: 0, bearing: " + bearing + "}\n  gear: {inertia: 1.0e-4}";
    return load(replaced(kTwoInertias, "output_coupling: rigid", "output_coupling: " + shaft)).diagnosis;
  };
  const auto at_gear = with_shaft("gear"), at_link = with_shaft("link");
  ASSERT_TRUE(at_gear.gap_traverse);
  EXPECT_DOUBLE_EQ(at_gear.gap_traverse->load_inertia, 0.01 + 1e-4);
  EXPECT_NEAR(at_gear.lost_motion->elastic_deflection(0.5), 0.5 / (1e7 * 0.02 * 0.02), 1e-15);
  EXPECT_FALSE(at_link.gap_traverse);
  EXPECT_NEAR(at_link.lost_motion->elastic_deflection(0.5), 0.5 / (1e7 * 0.02 * 0.02) + 0.5 / 2e3, 1e-15);
}

// Hertz's contact in series with a spring, F = T / r: d = F / Ks + (F / K)^(2/3), and a damper.
TEST(RigFile, GapTraverseKnowsTeethThatAreNoSpringUnderATorque) {
  const RigFile file =
      load(replaced(kTwoInertias, "law: linear, stiffness: 1.0e7, damping: 10",
                    "law: hertz_in_series, stiffness: 2.0e9, series_stiffness: 1.0e7, damping: 10"));
  ASSERT_TRUE(file.diagnosis.gap_traverse && file.diagnosis.gap_traverse->flank_under);
  for (const double torque : {0.1, 5.0}) {
    const double radius = 0.02, force = torque / radius;
    const double depth = force / 1e7 + std::pow(force / 2e9, 2.0 / 3);
    const auto flank = file.diagnosis.gap_traverse->flank_under(torque);
    EXPECT_NEAR(flank.stiffness, torque / (depth / radius), 1e-9 * flank.stiffness);
    EXPECT_NEAR(flank.damping, 10 * radius * radius, 1e-6 * flank.damping);  // of a difference
    // d ln F / d ln d, by differences over 1 %: off by about its square.
    EXPECT_NEAR(flank.power, depth / (force / 1e7 + 2.0 / 3 * std::pow(force / 2e9, 2.0 / 3)), 2e-4);
    EXPECT_NEAR(flank.damping_power, 0, 1e-5);
  }
  const RigFile crossley = load(replaced(kTwoInertias, "law: linear, stiffness: 1.0e7, damping: 10",
                                         "law: hunt_crossley, stiffness: 1.0e9, exponent: 1.4, alpha: 0.5"));
  const auto flank = crossley.diagnosis.gap_traverse->flank_under(0.5);  // both follow K d^1.4
  EXPECT_NEAR(flank.power, 1.4, 1e-9);
  EXPECT_NEAR(flank.damping_power, 1.4, 1e-6);  // of a difference
  EXPECT_FALSE(load(kTwoInertias).diagnosis.gap_traverse->flank_under);
}

// Four mistakes in three parts of the file.
TEST(RigFile, AllMistakesAtOnce) {
  std::string text = replaced(kTwoInertias, "motor: {inertia: 1.0e-3}", "motor: {inertai: 1.0e-3}");
  text = replaced(text, "damping: 10", "damping: ten");
  text = replaced(text, "amplitude: 1", "amplitude: -1");
  text = replaced(text, "torque: 0.5", "torque: 0");
  try {
    load(text);
    FAIL();
  } catch (const BadData& error) {
    const std::string all = error.what();
    for (const char* part : {"5 mistakes", ":6: gear_train.motor.inertia: is missing",
                             ":6: gear_train.motor.inertai", ":8: gear_train.mesh.contact.damping = ten",
                             ":11: excitation.amplitude = -1", ":14: diagnosis.lost_motion.torque = 0"})
      EXPECT_NE(all.find(part), std::string::npos) << part << " in " << all;
  }
}

// What only a simulation needs is asked for by the simulation.
TEST(RigFile, ADiagnosisNeedsNeitherExcitationNorSeed) {
  const std::string seedless = replaced(kTwoInertias, ", seed: 3", ", motor_torque: {noise: 1}");
  EXPECT_TRUE(load(seedless).diagnosis.gap_traverse);
  const RigFile noisy = load(seedless);
  EXPECT_THROW(simulation::Simulation(noisy.rig, noisy.simulation), InvalidParameter);
  std::string bare = replaced(kTwoInertias, "excitation: {type: sine, amplitude: 1, frequency: 2}\n", "");
  EXPECT_THROW(simulation::Simulation(load(bare).rig, load(bare).simulation), InvalidParameter);
  bare = replaced(bare, "sensors: {sampling_rate: 500, seed: 3}\n", "");
  EXPECT_TRUE(load(bare).diagnosis.gap_traverse);
}

TEST(RigFile, DigestIsFnv1aOfTheText) {
  const RigFile file = load(kTwoInertias);
  EXPECT_EQ(file.digest, "9424e96f1cccdcb8");  // computed by a separate program
  EXPECT_NE(load(std::string(kTwoInertias) + "# a remark\n").digest, file.digest);
}

TEST(RigFile, MissingAndUnreadableFiles) {
  EXPECT_THROW(load_rig_file("/nonexistent/rig.yaml"), MissingInput);
  EXPECT_THROW(load_rig_file(fs::temp_directory_path().string()), MissingInput);
  EXPECT_THROW(load(""), BadData);
  EXPECT_THROW(load("[1, 2]"), BadData);
  EXPECT_THROW(load("name: \x01"), BadData);
}

TEST(RigFile, AFileWithoutEndIsRefused) {
  EXPECT_THROW(load_rig_file("/dev/zero"), BadData);
}

TEST(RigFile, MalformedFilesAreRefusedWithFileAndKey) {
  struct Case {
    const char *from, *to, *key;
  };
  const std::vector<Case> cases = {
      {"schema_version: 1", "schema_version: 2", "schema_version"},
      {"schema_version: 1\n", "", "schema_version"},
      {"joint: elbow\n", "joint: elbow\ncolour: red\n", "colour"},
      {"reduction_ratio: 4", "reduction_ratio: 4\n  teeth: 40", "gear_train.teeth"},
      {"name: two_inertias\n", "", "name"},
      {"inertia: 1.0e-3", "inertia: -1.0e-3", "gear_train.motor.inertia"},
      {"inertia: 1.0e-3", "inertia: heavy", "gear_train.motor.inertia"},
      {"backlash: 1.0e-4,", "backlash: 1.0e-4, half_gap: 1.0e-4,", "gear_train.mesh.half_gap"},
      {"law: linear", "law: cubic", "gear_train.mesh.contact.law"},
      {"type: sine", "type: saw", "excitation.type"},
      {"sampling_rate: 500", "sampling_rate: 0", "sensors.sampling_rate"},
      {"seed: 3", "seed: 3, motor_current: {noise: 0}", "torque_constant"},
      {"seed: 3", "seed: -3", "sensors.seed"},
      {"lost_motion: {torque: 0.5,", "lost_motion: {torque: -0.5,", "diagnosis.lost_motion.torque"},
      {"watch: 1, service: 2", "watch: 3, service: 2", "diagnosis.limits.backlash.service"},
      {"diagnosis:\n", "diagnosi:\n", "diagnosis"},
      {"diagnosis:\n", "diagnosis:\n  alarm: 3\n", "diagnosis.alarm"},
      // A mesh without base radius knows no lengths, so its limits must be angles.
      {"base_radius: 0.02, backlash: 1.0e-4", "backlash_angle: 1.0e-4", "diagnosis.limits"},
  };
  for (const Case& c : cases) try {
      load(replaced(kTwoInertias, c.from, c.to));
      ADD_FAILURE() << c.to << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(c.key), std::string::npos) << c.to << ": " << error.what();
      EXPECT_NE(std::string(error.what()).find("rig_file_"), std::string::npos) << error.what();
    }
}

TEST(RigFile, AnAngularMeshHasNoBaseRadius) {
  std::string text = replaced(kTwoInertias, "base_radius: 0.02, backlash: 1.0e-4", "backlash_angle: 1.0e-4");
  const RigFile file = load(replaced(text, "{backlash: {watch", "{backlash_angle: {watch"));
  EXPECT_TRUE(file.rig.mesh.angular());
  EXPECT_TRUE(std::isnan(file.diagnosis.lost_motion->base_radius));
  EXPECT_TRUE(file.diagnosis.limits->angular);
}

TEST(RigFile, AnArmsIsKnownByItsUrdf) {
  const std::string folder = test::package_file("config/");
  EXPECT_TRUE(is_arm_rig(folder + "ur10e_arm/ur10e_arm.yaml"));
  EXPECT_FALSE(is_arm_rig(folder + "ur10e_joint.yaml"));
  EXPECT_TRUE(is_urdf(folder + "ur10e_arm/ur10e_arm.urdf"));
  EXPECT_FALSE(is_urdf(folder + "ur10e_arm/ur10e_arm.yaml"));
  EXPECT_THROW(is_arm_rig(folder + "ur10e_arm/ur10e_arm.urdf"), BadData);
}

// By hand: the spring softer by 12 %, and a contact of a 2.5th of the stiffness, 2.5^(2/3) = 1.842.
TEST(DeclaredUncertainty, IsThatOfTheSpringAndOfTheContact) {
  EXPECT_NEAR(elastic_uncertainty(3, 0), 0.12, 1e-12);
  EXPECT_NEAR(elastic_uncertainty(0, 2), 0.842, 1e-3);
  EXPECT_NEAR(elastic_uncertainty(3, 1), (0.36 + 0.842) / 4, 1e-3);
  EXPECT_EQ(elastic_uncertainty(0, 0), 0);
}

}  // namespace
}  // namespace backlash::rig_file
