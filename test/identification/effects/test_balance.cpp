// SPDX-License-Identifier: BSD-3-Clause
// Records of another integrator (SUNDIALS on the whole train, with the oscillations of its teeth): the
// balance of the torques and the pressed flanks show the effect that was put in, and show nothing where
// nothing was.
#include <gtest/gtest.h>

#include "backlash_diagnosis/identification/fit/servo_data.h"
#include "identification/effects/balance.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

constexpr double kCutoff = 15;  // Hz, a third of the mesh resonance of this servo (45 Hz)
constexpr double kStrength = 1e-3;
constexpr int kBlocks = 12;

std::shared_ptr<const model::Term> wave(const std::string& id, double amplitude, double phase) {
  return model::make_term(id, {{"amplitude", amplitude}, {"order", 36}, {"phase", phase}});
}

std::shared_ptr<const model::Term> friction(const std::string& id, ParameterValues values) {
  values.set_choice("body", "motor");
  return model::make_term(id, values);
}

struct Shown {
  explicit Shown(const std::vector<std::shared_ptr<const model::Term>>& effects) {
    model::Rig real = test::other_servo();
    real.terms = effects;
    const record::Record record = simulation::simulate_record(real, test::servo_run(11), 6);
    machine.rig = model::load_side(test::other_servo());
    machine.calibrations.resize(1);
    data = {servo_data(record, machine.rig)};
  }
  Balance::Explained gain(const std::vector<std::shared_ptr<const model::Term>>& terms) const {
    const Balance balance(machine, data, {kCutoff, kCutoff});
    Eigen::MatrixXd columns(balance.left().size(), Eigen::Index(terms.size()));
    for (std::size_t i = 0; i < terms.size(); ++i)
      columns.col(Eigen::Index(i)) = balance.column(*terms[i], kStrength);
    return balance.explained(columns, kBlocks);
  }

  Machine machine;
  std::vector<ServoData> data;
};

const std::vector<std::shared_ptr<const model::Term>> kCogging = {wave("cogging", 1, 0),
                                                                  wave("cogging", 1, M_PI / 2)};
const std::vector<std::shared_ptr<const model::Term>> kVaryingBacklash = {
    wave("varying_backlash", 0.1, 0), wave("varying_backlash", 0.1, M_PI / 2)};

TEST(Balance, ShowsCoggingInTheTorqueAndNotElsewhere) {
  const Shown shown({wave("cogging", 15, 0.7)});
  const Balance::Explained cogging = shown.gain(kCogging);
  EXPECT_FALSE(cogging.deflection);
  // A wave of 15 N m has 10.6 N m rms and the low-pass passes some of it; what is left without it is noise of
  // 1 to 3 N m in a band of 15 of 500 Hz, 0.5 N m: more than a half is explained in any case.
  EXPECT_GT(cogging.gain_held_out, 0.5);
  EXPECT_GE(cogging.gain, cogging.gain_held_out);
  EXPECT_LT(shown.gain(kVaryingBacklash).gain_held_out, 0.1);
}

TEST(Balance, ShowsAVaryingBacklashAtThePressedFlanks) {
  const Shown shown({wave("varying_backlash", 0.3, 1.1)});
  const Balance::Explained varying = shown.gain(kVaryingBacklash);
  EXPECT_TRUE(varying.deflection);
  // It moves a flank by up to 95 urad, the encoder has steps of 7 urad: six times what 12 blocks give by
  // chance.
  EXPECT_GT(varying.gain_held_out, 0.3);
  EXPECT_LT(shown.gain(kCogging).gain_held_out, 0.1);
}

TEST(Balance, ShowsNothingWhereNothingIsMissing) {
  const Shown shown({});
  for (const auto& terms : {kCogging, kVaryingBacklash}) EXPECT_LT(shown.gain(terms).gain_held_out, 0.05);
  EXPECT_LT(shown.gain({friction("asymmetric_coulomb", {{"torque", 1}})}).gain_held_out, 0.05);
}

// The sign: of a friction that the machine has too little of, left() wants more.
TEST(Balance, AColumnIsTheChangeOfWhatIsLeft) {
  const Shown shown({friction("asymmetric_coulomb", {{"torque", 12}})});
  const Balance balance(shown.machine, shown.data, {kCutoff, kCutoff});
  const Eigen::VectorXd column = balance.column(*friction("asymmetric_coulomb", {{"torque", 12}}), kStrength);
  // With the whole effect what is left is what is left of a healthy machine: a tenth of it at most.
  EXPECT_LT((balance.left() + column).squaredNorm(), balance.left().squaredNorm());
  EXPECT_NEAR(-column.dot(balance.left()) / column.squaredNorm(), 1, 0.1);
}

}  // namespace
}  // namespace backlash::identification
