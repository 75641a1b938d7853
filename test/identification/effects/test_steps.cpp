// SPDX-License-Identifier: BSD-3-Clause
// The steps of the search, each on a machine whose missing effect is written down.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "identification/effects/contact_shape.h"
#include "identification/effects/found_effects.h"
#include "identification/effects/learned.h"
#include "identification/effects/search.h"
#include "identification/effects/steps.h"
#include "identification/effects/strength_in_parts.h"
#include "support/one_inertia_bench.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

using test::cogging_effect;
using test::cogging_torque;
using test::drag_effect;
using test::OneInertiaMachine;
using test::SearchBench;

OneInertiaMachine with_cogging() {
  OneInertiaMachine machine;
  machine.extra = cogging_torque(0.8, 7, 0.6);
  return machine;
}

std::vector<std::string> ids(const Hypothesis& h) {
  std::vector<std::string> all;
  for (const Effect& effect : h.effects) all.push_back(effect.candidate.id);
  return all;
}

std::string reason(const Hypothesis& h, const std::string& id) {
  for (const RejectedEffect& r : rejected_effects(h))
    if (r.id == id) return r.reason;
  return "";
}

TEST(Hypothesis, KeepsTheLatestReasonOfWhatIsNotInIt) {
  Hypothesis h;
  h = with_rejected(h, "gravity", "first");
  h = with_rejected(h, "cogging", "second");
  const Hypothesis before = h;
  h = with_rejected(h, "gravity", "third");
  h.effects.push_back(cogging_effect(1, 1, 0));
  ASSERT_EQ(rejected_effects(h).size(), 1u);
  EXPECT_EQ(rejected_effects(h)[0].id, "gravity");
  EXPECT_EQ(rejected_effects(h)[0].reason, "third");
  EXPECT_EQ(rejected_effects(before).size(), 2u);  // a value: what was made of it changes nothing
}

// So much drag that a straight line wants a dry friction far below 0, where the model no longer feels it.
TEST(AddEffect, FrictionComesBackWithTheEffectThatHidIt) {
  OneInertiaMachine machine;
  machine.coulomb = 0.5;
  machine.viscous = 0.4;
  machine.extra = [](double, double w) { return 3 * w * std::fabs(w); };
  const SearchBench bench{machine};
  const Hypothesis declared = fit_declared(test::one_inertia_rig(), bench.context);
  ASSERT_LE(declared.fitted->fit.machine.rig.motor.coulomb_friction, 0);
  const Hypothesis h = add_effect(declared, bench.context);
  ASSERT_EQ(ids(h), std::vector<std::string>{"quadratic_drag"});
  const model::Rig& rig = h.fitted->fit.machine.rig;
  // Noise of 0.05 N m in some 1000 independent samples: a few thousandths; ten times that.
  EXPECT_NEAR(rig.motor.coulomb_friction, 0.5, 0.03);
  EXPECT_NEAR(rig.motor.viscous_damping, 0.4, 0.05);
  EXPECT_NEAR(rig.terms[0]->values.at("drag"), 3, 0.03);
}

TEST(Hypothesis, RefittedHasTheEffectsAsFitted) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const auto with = refitted(h, {cogging_effect(0.5, 7, 0.3)}, bench.context);
  ASSERT_TRUE(with);
  EXPECT_NEAR(with->effects[0].candidate.terms[0].at("amplitude"), 0.8, 0.02);
  EXPECT_EQ(with->effects[0].after->rig.terms.size(), 1u);
  EXPECT_LT(misfit(*with).torque, 1.2);
  EXPECT_EQ(with->base, h.base);
  EXPECT_TRUE(h.effects.empty());
}

TEST(FitDeclared, FitsWhatTheRigDeclares) {
  const SearchBench bench{OneInertiaMachine()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  EXPECT_EQ(h.declared->parameters.size(), 3u);
  EXPECT_NEAR(h.fitted->fit.machine.rig.motor.inertia, 2, 0.02);
  EXPECT_EQ(h.fitted, h.base);
}

TEST(AddEffect, AddsWhatIsMissingAndNothingElse) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const Hypothesis with = add_effects(h, bench.context);
  EXPECT_EQ(ids(with), std::vector<std::string>{"cogging"});
  EXPECT_NEAR(with.effects[0].candidate.terms[0].at("order"), 7, 0.012);  // as in test_screen
  EXPECT_FALSE(rejected_effects(with).empty());
  for (const RejectedEffect& r : rejected_effects(with)) EXPECT_FALSE(r.reason.empty()) << r.id;

  const SearchBench healthy{OneInertiaMachine()};
  const Hypothesis none =
      add_effects(fit_declared(test::one_inertia_rig(), healthy.context), healthy.context);
  EXPECT_TRUE(none.effects.empty());
}

TEST(AddEffect, NoMoreThanAskedFor) {
  SearchBench bench{with_cogging()};
  bench.context.settings.asked.most_effects = 0;
  EXPECT_TRUE(
      add_effects(fit_declared(test::one_inertia_rig(), bench.context), bench.context).effects.empty());
}

TEST(WithoutEffect, LeavesTheOthersFitted) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const auto both = refitted(h, {drag_effect(0.05), cogging_effect(0.8, 7, 0.6)}, bench.context);
  ASSERT_TRUE(both);
  EXPECT_EQ(ids(without_effect(*both, 0, bench.context)), std::vector<std::string>{"cogging"});
  EXPECT_LT(size(without_effect(*both, 0, bench.context)), 1.3);
  EXPECT_EQ(ids(without_effect(*both, 1, bench.context)), std::vector<std::string>{"quadratic_drag"});
  EXPECT_GT(size(without_effect(*both, 1, bench.context)), 2);
}

TEST(TakeSimpler, TakesTheNameWithFewerUnknownsWhereThatExplainsTheSame) {
  Effect wave = cogging_effect(0.8, 1, 0.6);
  Gain other_channel;
  other_channel.deflection = true;
  wave.alternatives = {{{"gravity", {{{"amplitude", 0.8}, {"phase", 0.6}}}}, other_channel}};
  OneInertiaMachine weight;
  weight.extra = [](double q, double) { return 0.8 * std::sin(q + 0.6); };
  const SearchBench bench{weight};
  const auto start = refitted(fit_declared(test::one_inertia_rig(), bench.context), {wave}, bench.context);
  ASSERT_TRUE(start);
  const Hypothesis simpler = take_simpler(*start, bench.context);
  EXPECT_EQ(ids(simpler), std::vector<std::string>{"gravity"});
  ASSERT_EQ(simpler.effects[0].alternatives.size(), 1u);
  EXPECT_EQ(simpler.effects[0].alternatives[0].candidate.id, "cogging");
  // What is said of the one that was taken is its own, the channel that it explains among it.
  EXPECT_TRUE(simpler.effects[0].gain.deflection);
  EXPECT_FALSE(simpler.effects[0].alternatives[0].gain.deflection);

  wave.candidate = cogging_effect(0.8, 7, 0.6).candidate;
  const SearchBench teeth{with_cogging()};
  const auto right = refitted(fit_declared(test::one_inertia_rig(), teeth.context), {wave}, teeth.context);
  ASSERT_TRUE(right);
  EXPECT_EQ(ids(take_simpler(*right, teeth.context)), std::vector<std::string>{"cogging"});
}

// Friction that follows the load has shapes that are 0 until they are asked for: one unknown, not three as a
// wave has.
TEST(TakeSimpler, ShapesThatAreNotFittedDoNotCount) {
  Effect load;
  load.candidate = {
      "load_dependent_friction",
      {{{"coefficient", 0.1}, {"fluctuation", 0}, {"fluctuation_speed", 0}, {"rotor_share", 0}}}};
  load.candidate.terms[0].set_choice("body", "motor");
  Candidate wave = {"position_dependent_friction", {{{"amplitude", 0.3}, {"order", 1}, {"phase", 0.6}}}};
  wave.terms[0].set_choice("body", "motor");
  load.alternatives = {{wave, {}}};
  const SearchBench bench{with_cogging()};
  Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  h.effects = {load};  // as if fitted: any fit that is tried would take its place
  EXPECT_EQ(ids(take_simpler(h, bench.context)), std::vector<std::string>{"load_dependent_friction"});
}

// 0.05 N m of noise at 2000 samples; the errors that are stated are those of the fit.
TEST(BestShapes, OfOneInertiaTheRotorLoadsNoTeeth) {
  OneInertiaMachine machine;
  machine.weight = 6, machine.loss = 0.15, machine.rotor = 0.4;
  model::Rig rig = test::one_inertia_rig();
  rig.terms = {model::make_term("gravity", {{"amplitude", 6}, {"phase", 0}})};
  const SearchBench bench{rig, {test::record_of(machine, 1), test::record_of(machine, 2)}};
  const Hypothesis h = add_effects(fit_declared(rig, bench.context), bench.context);
  ASSERT_EQ(ids(h), std::vector<std::string>{"load_dependent_friction"});
  const ParameterValues& found = h.effects[0].candidate.terms[0];
  EXPECT_NEAR(found.at("coefficient"), 0.15, 0.003);
  EXPECT_NEAR(found.at("rotor_share"), 0.4, 0.03);
}

TEST(OtherTeeth, AreAsStiffAndDampedUnderTheSameTorque) {
  const model::Rig rig = test::servo_file().rig;
  const auto others = with_hertzian_teeth(rig, 200);
  ASSERT_EQ(others.size(), 2u);
  const model::ContactLaw& linear = *rig.mesh.contact;
  const double depth = 200 / 460e3;  // rad
  for (const model::Rig& other : others) {
    const model::ContactLaw& hertz = *other.mesh.contact;
    EXPECT_NEAR(hertz.force(depth, 0, 0), 200, 1e-6);
    EXPECT_NEAR(hertz.force(depth, 0.01, 0) - 200, linear.force(depth, 0.01, 0) - 200, 1e-6);
    EXPECT_TRUE(with_hertzian_teeth(other, 200).empty());  // they are already
  }
}

TEST(OtherTeeth, AreNotTriedOfOneInertiaWhichHasNone) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const auto with = refitted(h, {cogging_effect(0.8, 7, 0.6)}, bench.context);
  ASSERT_TRUE(with);
  EXPECT_FALSE(with_other_teeth(*with, bench.context));
}

/// A torque over the position that no named effect has: a step that is rounded a little.
double unnamed(double q) {
  return 1.5 * std::tanh(8 * (q - 0.2)) * (q > -0.5 ? 1 : -0.6);
}

/// A record of this machine, whose rig file has bearing and encoder on the load.
struct ServoBench : SearchBench {
  explicit ServoBench(const model::Rig& machine)
      : SearchBench(test::servo_file().rig, {simulation::simulate_record(machine, test::servo_run(11), 4)}),
        fitted(fit_declared(test::servo_file().rig, context)) {}
  Hypothesis fitted;
};

TEST(WithShaft, BearingAndEncoderAreBeforeIt) {
  const ServoBench bench(test::servo_behind_shaft(0.01));
  const auto h = with_shaft(bench.fitted, bench.context);
  ASSERT_TRUE(h);
  EXPECT_TRUE(h->behind_shaft);
  EXPECT_TRUE(h->effects.empty());
  // The fit's gear has no mass: a tenth.
  EXPECT_NEAR(h->fitted->fit.machine.rig.output_coupling.stiffness, 1.2e6, 0.12e6);
}

// Much is left, and the sensitivities show that a shaft would not take it: none is fitted.
TEST(WithShaft, AGapThatVariesIsNone) {
  model::Rig machine = test::other_servo();
  machine.terms.push_back(
      model::make_term("varying_backlash", {{"amplitude", 0.3}, {"order", 7}, {"phase", 0.4}}));
  ServoBench bench(machine);
  EXPECT_GT(misfit(bench.fitted).deflection, 3);
  int fits = 0;
  bench.context.report = [&](const std::string&) { ++fits; };
  EXPECT_FALSE(with_shaft(bench.fitted, bench.context));
  EXPECT_EQ(fits, 0);
}

// Its load gains speed by itself.
TEST(Believe, AMachineThatRunsAwayIsContradicted) {
  const ServoBench bench(test::other_servo());
  Machine unstable = bench.fitted.fitted->fit.machine;
  unstable.rig.link.viscous_damping = -1e5;
  Hypothesis h = bench.fitted;
  h.effects.push_back(drag_effect(1));
  h.effects.back().after = std::make_shared<const Machine>(unstable);
  EXPECT_NE(contradicted_by_unseen(h, bench.context).find("does not follow"), std::string::npos);
}

TEST(Learned, MapsAreOverTheCoordinateThatTheResidualFollows) {
  OneInertiaMachine machine;
  machine.extra = [](double q, double) { return unnamed(q); };
  const SearchBench bench{machine};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const std::vector<LearnedCandidate> maps =
      learn_maps(h.fitted->fit, h.fitted->records, bench.context.range, bench.context.settings.maps);
  ASSERT_FALSE(maps.empty());
  EXPECT_EQ(maps[0].values.choice("coordinate"), "motor_position");
  EXPECT_GT(maps[0].gain, 0.5);
  const Hypothesis with = add_map(h, bench.context);
  ASSERT_EQ(ids(with), std::vector<std::string>{"learned_map"});
  // The term adds a torque to the motor, so the motor has to give the opposite. What is constant or lies
  // within its rounded corners the friction takes up or the smoothness hides: the change over a wide stretch
  // is compared.
  const std::vector<double>&x = with.effects[0].candidate.terms[0].list("points"),
        &y = with.effects[0].candidate.terms[0].list("values");
  const auto at = [&](double q) {
    return y[std::size_t(std::lower_bound(x.begin(), x.end(), q) - x.begin())];
  };
  EXPECT_NEAR(at(0.8) - at(0.0), -(unnamed(0.8) - unnamed(0.0)), 0.4);
}

TEST(AddLearned, NothingWhereNothingIsLeft) {
  const SearchBench bench{OneInertiaMachine()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  EXPECT_EQ(add_learned(h, bench.context).fitted, h.fitted);
}

/// The part of the records, of machines of these two, in which a cogging fitted to the first differs most.
std::optional<PartStrength> part_of_cogging(const OneInertiaMachine& machine,
                                            const OneInertiaMachine& other) {
  const SearchBench bench{machine};
  const Hypothesis h = *refitted(fit_declared(test::one_inertia_rig(), bench.context),
                                 {cogging_effect(0.8, 7, 0.6)}, bench.context);
  const ServoData unseen = servo_data(record_of(other, 5), test::one_inertia_rig());
  return StrengthInParts(h, unseen, bench.context).differing(0);
}

// Three standard errors.
TEST(StrengthInParts, OfAnEffectIsTheSameEverywhereAndOfAStandInIsNot) {
  EXPECT_FALSE(part_of_cogging(with_cogging(), with_cogging()));
  OneInertiaMachine weaker, half;
  weaker.extra = [](double q, double) { return 0.3 * 0.8 * std::sin(7 * q + 0.6); };
  const auto unseen = part_of_cogging(with_cogging(), weaker);
  ASSERT_TRUE(unseen);
  EXPECT_NE(unseen->part.find("on the unseen record"), std::string::npos);
  EXPECT_NEAR(unseen->ratio, 0.3, 3 * unseen->standard_error);
  half.extra = [](double q, double) { return q > 0.1 ? 1.6 * std::sin(7 * q + 0.6) : 0; };
  const auto here = part_of_cogging(half, half);
  ASSERT_TRUE(here);
  EXPECT_GT(std::fabs(here->ratio - 1), 0.5);
}

TEST(HoldFriction, BelowZeroIsHeldAtZero) {
  OneInertiaMachine machine;
  machine.viscous = -0.4;
  const SearchBench bench{machine};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  EXPECT_NEAR(h.fitted->fit.machine.rig.motor.viscous_damping, -0.4, 0.03);
  const Hypothesis held = hold_friction(h, bench.context);
  EXPECT_EQ(held.held, (std::map<std::string, double>{{"motor_viscous", 0}}));
  EXPECT_EQ(held.fitted->fit.machine.rig.motor.viscous_damping, 0);
  EXPECT_EQ(held.declared->parameters.size(), 2u);

  const SearchBench usual{OneInertiaMachine()};
  const Hypothesis same = fit_declared(test::one_inertia_rig(), usual.context);
  EXPECT_EQ(hold_friction(same, usual.context).fitted, same.fitted);
}

TEST(ShareOfSignal, OfASineIsItsPartOfTheTorque) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const auto with = refitted(h, {cogging_effect(0.8, 7, 0.6)}, bench.context);
  ASSERT_TRUE(with);
  // Standard deviation of the sine over that of the torque; 20 %: the positions are not evenly spread.
  const double expected = 0.8 / std::sqrt(2.0) / bench.context.range.torque;
  EXPECT_NEAR(share_of_signal(*with, "cogging") / expected, 1, 0.2);
  EXPECT_EQ(share_of_signal(*with, "gravity"), 0);
}

// The unseen record is of the machine itself, or of one that lacks the effect.
TEST(Believe, KeepsWhatTheUnseenRecordBearsOut) {
  const SearchBench bench{with_cogging()};
  Effect cogging = cogging_effect(0.8, 7, 0.6);
  cogging.candidate.held_orders = {0.5};  // the order is not fitted: the next value is another term's
  const Hypothesis h = *refitted(fit_declared(test::one_inertia_rig(), bench.context),
                                 {cogging, cogging_effect(0.1, 3, 0.2)}, bench.context);
  const model::Rig rig = test::one_inertia_rig();
  const Hypothesis believed = believe(h, servo_data(record_of(with_cogging(), 5), rig), bench.context);
  ASSERT_EQ(ids(believed), std::vector<std::string>{"cogging"});
  EXPECT_EQ(believed.effects[0].candidate.terms[0].at("order"), 7);
  EXPECT_NE(believed.rejected.back().reason.find("less than 4 standard errors"), std::string::npos);
}

TEST(Believe, DropsWhatTheUnseenRecordContradicts) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = *refitted(fit_declared(test::one_inertia_rig(), bench.context),
                                 {cogging_effect(0.8, 7, 0.6)}, bench.context);
  const ServoData unseen = servo_data(record_of(OneInertiaMachine(), 5), test::one_inertia_rig());
  const Hypothesis believed = believe(h, unseen, bench.context);
  EXPECT_TRUE(believed.effects.empty());
  EXPECT_NE(reason(believed, "cogging").find("on the unseen record"), std::string::npos);
}

TEST(BelieveTogether, DropsAllWhereTheyExplainNoMoreThanTheDeclaredMachine) {
  const SearchBench bench{with_cogging()};
  const Hypothesis declared = fit_declared(test::one_inertia_rig(), bench.context);
  const Hypothesis h = *refitted(declared, {cogging_effect(0.8, 7, 0.6)}, bench.context);
  const auto unseen = [](const OneInertiaMachine& machine) {
    return servo_data(record_of(machine, 5), test::one_inertia_rig());
  };
  EXPECT_EQ(believe_together(h, declared, unseen(with_cogging()), bench.context).fitted, h.fitted);
  const Hypothesis none = believe_together(h, declared, unseen(OneInertiaMachine()), bench.context);
  EXPECT_TRUE(none.effects.empty());
  EXPECT_EQ(none.fitted, declared.base);
  EXPECT_NE(reason(none, "cogging").find("no better than by the declared machine"), std::string::npos);
}

TEST(SearchEffects, CanBeStoppedAndIsTheSameEveryTime) {
  const SearchBench bench{with_cogging()};
  const auto found = [&] {
    return search_effects(test::one_inertia_rig(), bench.data, bench.data.front(), bench.context.settings,
                          nullptr)
        .found;
  };
  const Hypothesis a = found(), b = found();
  ASSERT_EQ(ids(a), std::vector<std::string>{"cogging"});
  EXPECT_EQ(a.effects[0].candidate.terms, b.effects[0].candidate.terms);
  EXPECT_THROW(search_effects(test::one_inertia_rig(), bench.data, bench.data.front(), bench.context.settings,
                              [](double, const std::string&) { return false; }),
               Cancelled);
}

}  // namespace
}  // namespace backlash::identification
