// SPDX-License-Identifier: BSD-3-Clause
// Columns of terms against the laws as they are printed in the sources that the terms name.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/term_columns.h"

namespace backlash::model {
namespace {

// rad, rad/s, -, N m, rad: a joint on its way back, soon after a reversal; no value is special.
const JointMoment kMoment = {2.5, 0.7, -0.4, -0.8, 3, 0.05, -1};

struct TermLaw {
  const char* id;
  ParameterValues given;
  std::vector<double> columns;  // at kMoment
};

std::ostream& operator<<(std::ostream& out, const TermLaw& law) {
  return out << law.id;
}

class TermColumnsOf : public testing::TestWithParam<TermLaw> {};

TEST_P(TermColumnsOf, TheDictionaryFollowTheLaw) {
  const TermLaw& law = GetParam();
  const TermColumns columns(term_type(law.id), law.given);
  ASSERT_EQ(columns.count(), law.columns.size());
  for (std::size_t i = 0; i < columns.count(); ++i)
    EXPECT_NEAR(columns.at(i, kMoment), law.columns[i], 1e-14) << i;  // rounding of some operations near 1
}

INSTANTIATE_TEST_SUITE_P(
    Terms, TermColumnsOf,
    testing::Values(
        TermLaw{"asymmetric_coulomb", {}, {1}}, TermLaw{"asymmetric_viscous", {}, {0.4}},
        TermLaw{"quadratic_drag", {}, {-0.4 * 0.4}},
        TermLaw{"square_root_friction", {}, {-0.8 * std::sqrt(0.4)}},
        TermLaw{"load_dependent_friction", {}, {-0.8 * 3}},
        TermLaw{"stribeck", {{"speed", 0.3}, {"exponent", 1}}, {-0.8 * std::exp(-0.4 / 0.3)}},
        TermLaw{"stribeck", {{"speed", 0.3}, {"exponent", 2}}, {-0.8 * std::exp(-16.0 / 9)}},
        TermLaw{"presliding", {{"distance", 0.04}, {"damping", 0}}, {2 * 0.8 * std::exp(-1.25)}},
        TermLaw{"friction_drift", {{"span", 5}, {"rate", 0}}, {-0.8 * 2.5 / 5}},
        TermLaw{"gravity", {}, {std::cos(0.7), std::sin(0.7)}},
        TermLaw{"cogging", {{"order", 9}}, {std::cos(6.3), std::sin(6.3)}},
        TermLaw{"position_dependent_friction", {{"order", 2}}, {-0.8 * std::cos(1.4), -0.8 * std::sin(1.4)}},
        // Of the deflection, motor ahead of load: the flank at the back bears it.
        TermLaw{"backlash", {}, {-0.5}}, TermLaw{"encoder_scale", {}, {-0.7}},
        TermLaw{"transmission_error", {{"order", 4}}, {-std::cos(2.8), -std::sin(2.8)}}),
    [](const auto& info) { return std::string(info.param.id) + std::to_string(info.index); });

TEST(TermColumns, EveryTermShowsSomewhereOrIsNotLinear) {
  std::set<std::string> neither;
  for (const TermType& type : term_types())
    if (type.search && shown_in(type) == ShownIn::neither) neither.insert(type.id);
  // Hardening, hysteresis and a ratio that follows the torque need the deflection under load, a varying gap
  // the gap, a delay the record before.
  EXPECT_EQ(neither, (std::set<std::string>{"delay", "mesh_hardening", "mesh_hysteresis", "varying_backlash",
                                            "varying_reduction_ratio"}));
}

TEST(TermColumns, NothingIsGuessed) {
  EXPECT_THROW(TermColumns(term_type("stribeck"), {{"exponent", 2}}), InvalidParameter);
  EXPECT_THROW(TermColumns(term_type("stribeck"), {{"speed", -1}, {"exponent", 2}}), InvalidParameter);
  EXPECT_THROW(TermColumns(term_type("delay"), {}), InvalidParameter);
}

TEST(TermColumns, FrictionIsThatWhichIsTheSameInBothDirections) {
  const auto rubs = [](const char* id, const ParameterValues& given) {
    return TermColumns(term_type(id), given).rubs();
  };
  EXPECT_TRUE(rubs("load_dependent_friction", {}));
  EXPECT_TRUE(rubs("position_dependent_friction", {{"order", 2}}));
  EXPECT_TRUE(rubs("presliding", {{"distance", 0.1}, {"damping", 0}}));
  EXPECT_FALSE(rubs("asymmetric_coulomb", {}));
  EXPECT_FALSE(rubs("cogging", {{"order", 2}}));
}

TEST(TermColumns, OnlyAConstantTorqueMayBeTheZeroOfASensor) {
  for (const TermType& type : term_types())
    EXPECT_EQ(looks_like(type).empty(), type.id != "asymmetric_coulomb") << type.id;
}

TEST(TermColumns, SearchedTermsHaveAllButStrengthPhaseAndOneShape) {
  const MotionRange range{10, 1, 0.01, -1, 1, 5, 1e-3};
  for (const ShownIn channel : {ShownIn::torque, ShownIn::deflection})
    for (const SearchedTerm& term : searched_terms(channel, range)) {
      ParameterValues given = term.given;
      const auto shape = searched_shape(*term.type);
      EXPECT_EQ(shape && !has_order(*term.type), !term.shapes.empty()) << term.type->id;
      if (shape) given[shape->name] = term.shapes.empty() ? 3 : term.shapes.back();
      EXPECT_NO_THROW(TermColumns(*term.type, given)) << term.type->id;
    }
}

}  // namespace
}  // namespace backlash::model
