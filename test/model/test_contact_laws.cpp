#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/contact_law.h"

namespace backlash {
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
    }
  }
  return laws;
}

const double kPenetrations[] = {1e-9, 1e-7, 3e-6, 1e-5, 1e-4, 1e-3};

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
      EXPECT_NEAR(law.law->force(d, 0), expected, 1e-14 * expected) << law.name;  // a few roundings
    }
}

TEST(ContactLaws, DampingIsThatOfTheEquations) {
  const Law linear = make_contact_law("linear", {{"stiffness", 2e6}, {"damping", 40}});
  EXPECT_DOUBLE_EQ(linear->force(1e-5, 0.03), 20 + 1.2);
  EXPECT_DOUBLE_EQ(linear->force(1e-5, -0.03), 20 - 1.2);
  const Law hunt_crossley =
      make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0.5}});
  // 1e8 * (1e-4)^1.5 = 100 N at rest; 3/2 * 0.5 s/m * 0.2 m/s = 0.15
  EXPECT_NEAR(hunt_crossley->force(1e-4, 0.2), 115, 1e-12);
  EXPECT_NEAR(hunt_crossley->force(1e-4, -0.2), 85, 1e-12);
}

TEST(ContactLaws, NeverPull) {
  for (const NamedLaw& law : all_laws())
    for (double d : kPenetrations)
      for (double rate = -1e4; rate < -1e-6; rate /= 3) {
        EXPECT_GE(law.law->force(d, rate), 0) << law.name << " at " << d << " m, " << rate << " m/s";
        EXPECT_LE(law.law->force(d, rate), law.law->force(d, 0)) << law.name;
        EXPECT_GE(law.law->force(d, -rate), law.law->force(d, 0)) << law.name;
      }
}

TEST(ContactLaws, ClampBeginsWhereTheEquationTurnsNegative) {
  const Law linear = make_contact_law("linear", {{"stiffness", 1e6}, {"damping", 100}});
  EXPECT_EQ(linear->force(1e-5, -0.1001), 0);  // K d = 10 N, c d' = -10.01 N
  EXPECT_NEAR(linear->force(1e-5, -0.0999), 0.01, 1e-12);
  const Law hunt_crossley =
      make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0.5}});
  EXPECT_EQ(hunt_crossley->force(1e-4, -1.3334), 0);  // -2 / (3 alpha) = -1.33333 m/s
  EXPECT_GT(hunt_crossley->force(1e-4, -1.3333), 0);
}

TEST(ContactLaws, DerivativeOfElasticEnergyIsTheForceAtRest) {
  for (const NamedLaw& law : all_laws()) {
    EXPECT_EQ(law.law->elastic_energy(0), 0);
    for (double d : kPenetrations) {
      const double h = 1e-4 * d;
      const double slope = (law.law->elastic_energy(d + h) - law.law->elastic_energy(d - h)) / (2 * h);
      const double force = law.law->force(d, 0);
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
      EXPECT_NEAR(law.law->force(d, 0), force, 1e-13 * force) << law.name;  // pow() there and back
    }
  }
}

TEST(ContactLaws, LossDoesNotChangeEnergyAndPenetrationAtRest) {
  const Law elastic = make_contact_law("power_law", {{"stiffness", 1e7}, {"exponent", 1.3}});
  const Law lossy =
      make_contact_law("hunt_crossley", {{"stiffness", 1e7}, {"exponent", 1.3}, {"alpha", 0.9}});
  for (double d : kPenetrations) {
    EXPECT_DOUBLE_EQ(elastic->elastic_energy(d), lossy->elastic_energy(d));
    EXPECT_DOUBLE_EQ(elastic->force(d, 0), lossy->force(d, 0));
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
  EXPECT_NEAR(read_contact_law(yaml)->force(1e-4, 0.2), 115, 1e-12);
  EXPECT_NO_THROW(yaml.finish());
}

}  // namespace
}  // namespace backlash
