// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/contact_law.h"

namespace backlash::model {
namespace {

using Law = std::shared_ptr<const ContactLaw>;

struct NamedLaw {
  std::string name;
  double stiffness, exponent;  // of the elastic part K d^n
  Law law;
};

// Every law of the registry, soft and stiff, with and without loss.
std::vector<NamedLaw> all_laws() {
  std::vector<NamedLaw> laws;
  for (double k : {1e5, 2.28e8}) {
    for (double c : {0.0, 300.0})
      laws.push_back({"linear", k, 1, make_contact_law("linear", {{"stiffness", k}, {"damping", c}})});
    for (double n : {1.0, 1.25, 1.5}) {
      laws.push_back({"power_law", k, n, make_contact_law("power_law", {{"stiffness", k}, {"exponent", n}})});
      for (double alpha : {0.0, 0.72})
        laws.push_back(
            {"hunt_crossley", k, n,
             make_contact_law("hunt_crossley", {{"stiffness", k}, {"exponent", n}, {"alpha", alpha}})});
      for (const char* name : {"herbert_mcwhannell", "yang_sun"})
        laws.push_back({name, k, n,
                        make_contact_law(name, {{"stiffness", k},
                                                {"exponent", n},
                                                {"alpha", 0.5},
                                                {"beta", 0.25},
                                                {"minimum_speed", 0.01}})});
      laws.push_back(
          {"lankarani_nikravesh", k, n,
           make_contact_law(
               "lankarani_nikravesh",
               {{"stiffness", k}, {"exponent", n}, {"restitution", 0.5}, {"minimum_speed", 0.01}})});
      laws.push_back({"foundation", k, n,
                      make_contact_law("foundation", {{"stiffness", k},
                                                      {"exponent", n},
                                                      {"radius", 0.02},
                                                      {"viscosity", 1e5},
                                                      {"thickness", 2e-3},
                                                      {"share", 0.4}})});
    }
    // Nothing yields behind the contact, so that the elastic part is that of Hertz.
    laws.push_back({"hertz_in_series", k, 1.5,
                    make_contact_law("hertz_in_series",
                                     {{"stiffness", k}, {"series_stiffness", 1e30}, {"damping", 300}})});
    laws.push_back(
        {"kelvin_voigt", k, 1, make_contact_law("kelvin_voigt", {{"stiffness", k}, {"damping", 300}})});
    laws.push_back(
        {"jankowski", k, 1.5,
         make_contact_law("jankowski", {{"stiffness", k}, {"restitution", 0.5}, {"effective_mass", 0.05}})});
    laws.push_back(
        {"stereomechanical", k, 1,
         make_contact_law(
             "stereomechanical",
             {{"restitution", 0.5}, {"resting_speed", 0.01}, {"stiffness", k}, {"damping", 300}})});
  }
  return laws;
}

const double kPenetrations[] = {1e-9, 1e-7, 3e-6, 1e-5, 1e-4, 1e-3};
const double kImpactSpeeds[] = {0, 1e-3, 0.1, 10};  // none, below the smallest that counts, two above

TEST(ContactLaws, TheTestCoversTheRegistry) {
  std::set<std::string> registered, tested;
  for (const ContactLawType& type : contact_laws())
    EXPECT_TRUE(registered.insert(type.name).second) << type.name;
  for (const NamedLaw& law : all_laws()) tested.insert(law.name);
  EXPECT_EQ(registered, tested);
}

TEST(ContactLaws, ElasticPartIsStiffnessTimesPower) {
  for (const NamedLaw& law : all_laws())
    for (double d : kPenetrations) {
      const double expected = law.stiffness * std::pow(d, law.exponent);
      EXPECT_NEAR(law.law->force(d, 0, 0), expected, 1e-14 * expected) << law.name;  // a few roundings
    }
}

TEST(ContactLaws, DampingIsThatOfTheEquations) {
  const Law linear = make_contact_law("linear", {{"stiffness", 2e6}, {"damping", 40}});
  EXPECT_DOUBLE_EQ(linear->force(1e-5, 0.03, 0), 20 + 1.2);
  EXPECT_DOUBLE_EQ(linear->force(1e-5, -0.03, 0), 20 - 1.2);
  const Law hunt_crossley =
      make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0.5}});
  // 1e8 * (1e-4)^1.5 = 100 N at rest; 3/2 * 0.5 s/m * 0.2 m/s = 0.15
  EXPECT_NEAR(hunt_crossley->force(1e-4, 0.2, 0), 115, 1e-12);
  EXPECT_NEAR(hunt_crossley->force(1e-4, -0.2, 0), 85, 1e-12);
  const Law foundation = make_contact_law("foundation", {{"stiffness", 1e8},
                                                         {"exponent", 1.5},
                                                         {"radius", 0.05 / M_PI},
                                                         {"viscosity", 4e4},
                                                         {"thickness", 2e-3},
                                                         {"share", 0.75}});
  // 100 N at rest; 2 pi R = 0.1 m, eta / h = 2e7 Pa s/m: 0.1 * 2e7 * 0.75 = 1.5e6 N s/m^2, times 1e-4 m
  EXPECT_NEAR(foundation->force(1e-4, 0.2, 0), 130, 1e-12);
  EXPECT_NEAR(foundation->force(1e-4, -0.2, 0), 70, 1e-12);
}

TEST(ContactLaws, HertzInSeriesIsBothBehindEachOther) {
  const double contact = 1e8, behind = 2e6;
  const Law law = make_contact_law("hertz_in_series",
                                   {{"stiffness", contact}, {"series_stiffness", behind}, {"damping", 40}});
  // 100 N press the contact by (100 / 1e8)^(2/3) = 1e-4 m and what is behind it by 5e-5 m.
  EXPECT_NEAR(law->force(1.5e-4, 0, 0), 100, 1e-11);
  EXPECT_NEAR(law->force(1.5e-4, 0.03, 0), 101.2, 1e-11);
  EXPECT_NEAR(law->force(1.5e-4, -0.03, 0), 98.8, 1e-11);
  EXPECT_EQ(law->force(1.5e-4, -1e3, 0), 0);
  for (const double force : {1e-6, 1.0, 1e5}) {
    const double d = force / behind + std::pow(force / contact, 2.0 / 3);
    EXPECT_NEAR(law->force(d, 0, 0), force, 1e-12 * force);
    EXPECT_NEAR(law->static_penetration(force), d, 1e-15 * d);
    // Energies of both springs, by hand: F^2 / (2 Ks) and 2/5 K d^(5/2).
    EXPECT_NEAR(law->elastic_energy(d),
                0.5 * force * force / behind + 0.4 * contact * std::pow(force / contact, 5.0 / 3),
                1e-12 * force * d);
  }
  // What is behind it alone where the contact does not yield: the linear law.
  const Law stiff = make_contact_law("hertz_in_series",
                                     {{"stiffness", 1e20}, {"series_stiffness", behind}, {"damping", 40}});
  EXPECT_NEAR(stiff->force(1e-4, 0.1, 0), 204, 1e-3);
}

TEST(ContactLaws, NoneButKelvinVoigtPulls) {
  for (const NamedLaw& law : all_laws())
    for (double d : kPenetrations)
      for (double rate = -1e4; rate < -1e-6; rate /= 3)
        for (double v : kImpactSpeeds) {
          const double at_rest = law.law->force(d, 0, v);
          if (law.name != "kelvin_voigt") {
            EXPECT_GE(law.law->force(d, rate, v), 0) << law.name << " at " << d << " m, " << rate << " m/s";
          }
          EXPECT_LE(law.law->force(d, rate, v), at_rest) << law.name;
          EXPECT_GE(law.law->force(d, -rate, v), at_rest) << law.name;
        }
}

TEST(ContactLaws, KelvinVoigtJumpsAtTouchAndPullsAtTheEnd) {
  const Law law = make_contact_law("kelvin_voigt", {{"stiffness", 2e6}, {"damping", 40}});
  EXPECT_NEAR(law->force(1e-15, 0.3, 0), 12, 1e-8);  // c v, Yumrukcal (2013), Eq. 2.14; K d = 2e-9 N
  EXPECT_NEAR(law->force(1e-15, -0.3, 0), -12, 1e-8);
  EXPECT_DOUBLE_EQ(law->force(1e-5, -0.5, 0), 0);  // K d = c d' = 20 N: where the tension begins
  EXPECT_DOUBLE_EQ(law->force(1e-5, -0.6, 0), -4);
}

// Two forces at the same d and d' give D / v; from the published equations by hand.
TEST(ContactLaws, DampingFollowsTheImpactSpeed) {
  const ParameterValues falling = {
      {"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0.5}, {"beta", 0.25}, {"minimum_speed", 0.01}};
  const auto damping = [](const Law& law, double v) {  // 1e8 (1e-4)^1.5 = 100 N at rest
    const double slower = std::max(v, 0.01);
    return (law->force(1e-4, 0.1 * slower, v) / law->force(1e-4, 0, v) - 1) / 0.1;
  };
  const Law exact = make_contact_law("herbert_mcwhannell", falling),
            yang_sun = make_contact_law("yang_sun", falling);
  EXPECT_NEAR(damping(yang_sun, 0.0256), 6 * 0.2 / (0.36 + 3), 1e-12);  // e = 1 - 0.5 * 0.4 = 0.8
  EXPECT_NEAR(damping(exact, 0.0256), 0.3731, 5e-5);                    // e = 0.8, REFERENCE 1.3
  EXPECT_NEAR(damping(exact, 1), 1.4328, 5e-5);                         // e = 0.5
  EXPECT_NEAR(damping(exact, 6.5536), 4.9192, 5e-5);                    // e = 0.2
  EXPECT_EQ(damping(exact, 1000), damping(exact, 2000));                // e = 0.05 held
  EXPECT_LT(damping(exact, 1000), 20);                                  // and no singularity: D < 1 / e
  const Law constant = make_contact_law(
      "lankarani_nikravesh",
      {{"stiffness", 1e8}, {"exponent", 1.5}, {"restitution", 0.6}, {"minimum_speed", 0.01}});
  for (double v : {0.02, 0.5, 3.0}) EXPECT_NEAR(damping(constant, v), 0.75 * 0.64, 1e-12);
  for (const Law& law : {exact, yang_sun, constant})
    for (double slow : {0.0, 1e-6, 9e-3})
      EXPECT_EQ(law->force(1e-4, 0.02, slow), law->force(1e-4, 0.02, 0.01));
}

TEST(ContactLaws, JankowskiDampsOnApproachOnly) {
  const Law law =
      make_contact_law("jankowski", {{"stiffness", 1e8}, {"restitution", 0.6}, {"effective_mass", 0.04}});
  const double xi = 4.5 * std::sqrt(5) * 0.64 / (0.6 * (0.6 * (9 * M_PI - 16) + 16));
  // 2 sqrt(1e8 * 0.04 * sqrt(1e-4)) = 2 sqrt(4e4) = 400
  EXPECT_NEAR(law->force(1e-4, 0.2, 0), 100 + 400 * xi * 0.2, 1e-10);
  EXPECT_NEAR(law->force(1e-4, -0.2, 0), 100, 1e-12);
}

TEST(ContactLaws, OnlyThoseThatRememberNeedTheImpactSpeed) {
  const std::set<std::string> remember = {"herbert_mcwhannell", "yang_sun", "lankarani_nikravesh",
                                          "stereomechanical"};
  for (const NamedLaw& law : all_laws()) {
    EXPECT_EQ(law.law->needs_impact_speed(), remember.count(law.name) == 1) << law.name;
    EXPECT_EQ(law.law->jump_restitution(0.02),
              law.name == "stereomechanical" ? std::optional(0.5) : std::nullopt);
    EXPECT_EQ(law.law->jump_restitution(0.01), std::nullopt);  // resting_speed
    if (!law.law->needs_impact_speed()) {
      EXPECT_EQ(law.law->force(1e-5, 0.1, 0), law.law->force(1e-5, 0.1, 3)) << law.name;
    }
  }
}

TEST(ContactLaws, ClampBeginsWhereTheEquationTurnsNegative) {
  const Law linear = make_contact_law("linear", {{"stiffness", 1e6}, {"damping", 100}});
  EXPECT_EQ(linear->force(1e-5, -0.1001, 0), 0);  // K d = 10 N, c d' = -10.01 N
  EXPECT_NEAR(linear->force(1e-5, -0.0999, 0), 0.01, 1e-12);
  const Law hunt_crossley =
      make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0.5}});
  EXPECT_EQ(hunt_crossley->force(1e-4, -1.3334, 0), 0);  // -2 / (3 alpha) = -1.33333 m/s
  EXPECT_GT(hunt_crossley->force(1e-4, -1.3333, 0), 0);
}

TEST(ContactLaws, DerivativeOfElasticEnergyIsTheForceAtRest) {
  for (const NamedLaw& law : all_laws()) {
    EXPECT_EQ(law.law->elastic_energy(0), 0);
    for (double d : kPenetrations) {
      const double h = 1e-4 * d;
      const double slope = (law.law->elastic_energy(d + h) - law.law->elastic_energy(d - h)) / (2 * h);
      const double force = law.law->force(d, 0, 0);
      // central difference: (h/d)^2 n (n-1) / 6 < 2e-9 truncation, eps d / h = 2e-12 rounding
      EXPECT_NEAR(slope, force, 5e-9 * force) << law.name << " n = " << law.exponent;
    }
  }
}

TEST(ContactLaws, StaticPenetrationIsTheInverseOfTheForceAtRest) {
  for (const NamedLaw& law : all_laws()) {
    EXPECT_EQ(law.law->static_penetration(0), 0);
    for (double force = 1e-4; force < 1e5; force *= 7) {
      const double d = law.law->static_penetration(force);
      EXPECT_NEAR(law.law->force(d, 0, 0), force, 1e-13 * force) << law.name;  // pow() there and back
    }
  }
}

TEST(ContactLaws, LossDoesNotChangeEnergyAndPenetrationAtRest) {
  const Law elastic = make_contact_law("power_law", {{"stiffness", 1e7}, {"exponent", 1.3}});
  const Law lossy =
      make_contact_law("hunt_crossley", {{"stiffness", 1e7}, {"exponent", 1.3}, {"alpha", 0.9}});
  for (double d : kPenetrations) {
    EXPECT_DOUBLE_EQ(elastic->elastic_energy(d), lossy->elastic_energy(d));
    EXPECT_DOUBLE_EQ(elastic->force(d, 0, 0), lossy->force(d, 0, 0));
  }
  EXPECT_DOUBLE_EQ(elastic->static_penetration(12), lossy->static_penetration(12));
}

struct BadLaw {
  const char* name;
  ParameterValues values;
  const char* message;
};

TEST(ContactLaws, RefusalNamesParameterValueAndLimit) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const BadLaw cases[] = {
      {"hertz", {{"stiffness", 1}}, "contact.law = hertz: is not a known contact law"},
      {"", {}, "contact.law = : is not a known contact law"},
      {"linear", {{"stiffness", 1}}, "contact.damping = absent: is required by linear"},
      {"linear", {{"stiffness", 0}, {"damping", 0}}, "contact.stiffness = 0: must be > 0 N/m"},
      {"linear", {{"stiffness", 1}, {"damping", -2}}, "contact.damping = -2: must be >= 0 N s/m"},
      {"linear", {{"stiffness", nan}, {"damping", 0}}, "contact.stiffness = nan: must be > 0 N/m"},
      {"power_law",
       {{"stiffness", 1}, {"exponent", 0.99}},
       "contact.exponent = 0.99: must be >= 1 and <= 1.5 1"},
      {"power_law", {{"stiffness", inf}, {"exponent", 1}}, "contact.stiffness = inf: must be > 0 N/m^n"},
      {"hunt_crossley",
       {{"stiffness", 1}, {"exponent", 1.6}, {"alpha", 0}},
       "contact.exponent = 1.6: must be >= 1 and <= 1.5 1"},
      {"hunt_crossley",
       {{"stiffness", 1}, {"exponent", 1.5}, {"alpha", -0.1}},
       "contact.alpha = -0.1: must be >= 0 s/m"},
      {"kelvin_voigt", {{"stiffness", 1}, {"damping", -2}}, "contact.damping = -2: must be >= 0 N s/m"},
      {"herbert_mcwhannell",
       {{"stiffness", 1}, {"exponent", 1}, {"alpha", 0.1}, {"beta", 0}, {"minimum_speed", 0.01}},
       "contact.beta = 0: must be > 0 1"},
      {"yang_sun",
       {{"stiffness", 1}, {"exponent", 1}, {"alpha", 0.1}, {"beta", 0.25}, {"minimum_speed", 0}},
       "contact.minimum_speed = 0: must be > 0 m/s"},
      {"lankarani_nikravesh",
       {{"stiffness", 1}, {"exponent", 1}, {"restitution", 1.1}, {"minimum_speed", 0.01}},
       "contact.restitution = 1.1: must be >= 0 and <= 1 1"},
      {"jankowski",
       {{"stiffness", 1}, {"restitution", 0}, {"effective_mass", 1}},
       "contact.restitution = 0: must be > 0 and <= 1 1"},
      {"jankowski",
       {{"stiffness", 1}, {"restitution", 0.5}, {"effective_mass", 0}},
       "contact.effective_mass = 0: must be > 0 kg"},
      {"stereomechanical",
       {{"restitution", 0.5}, {"resting_speed", 0}, {"stiffness", 1}, {"damping", 0}},
       "contact.resting_speed = 0: must be > 0 m/s"},
      {"foundation",
       {{"stiffness", 1}, {"exponent", 1}, {"radius", 1}, {"viscosity", 0}, {"thickness", 0}, {"share", 1}},
       "contact.thickness = 0: must be > 0 m"},
  };
  for (const BadLaw& bad : cases) {
    try {
      make_contact_law(bad.name, bad.values);
      ADD_FAILURE() << "accepted: " << bad.message;
    } catch (const InvalidParameter& error) {
      EXPECT_STREQ(error.what(), bad.message);
    }
  }
}

TEST(ContactLaws, ReadFromYaml) {
  const YamlReader yaml =
      YamlReader::from_text("{law: hunt_crossley, stiffness: 1e8, exponent: 1.5, alpha: 0.5}", "t");
  const ContactSpec spec = read_contact_spec(yaml);
  EXPECT_NEAR(make_contact_law(spec.law, spec.values)->force(1e-4, 0.2, 0), 115, 1e-12);
  EXPECT_NO_THROW(yaml.finish());
}

}  // namespace
}  // namespace backlash::model
