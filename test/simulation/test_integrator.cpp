// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::simulation {
namespace {

const double kNever = std::numeric_limits<double>::infinity();

SolverSettings with(const std::string& method, double tolerance = 1e-6) {
  SolverSettings settings;
  settings.method = method;
  settings.relative_tolerance = tolerance;
  return settings;
}

void oscillator(double, const double* y, double* rate) {
  rate[0] = y[1];
  rate[1] = -y[0];
}

void decay(double, const double* y, double* rate) {
  rate[0] = -y[0];
}

/// Slope of the least-squares line through (log x, log y).
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = std::log(x[i]), v = std::log(y[i]);
    sx += u, sy += v, sxx += u * u, sxy += u * v;
  }
  const double n = x.size();
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

struct Convergence {
  std::vector<double> tolerance, error, evaluations;
};

// Harmonic oscillator against its closed form: the largest error at 200 times within 20 s.
Convergence refine_oscillator(const std::string& method) {
  Convergence all;
  for (double tolerance = 1e-4; tolerance > 5e-11; tolerance /= 10) {
    Integrator integrator(oscillator, {tolerance, tolerance}, with(method, tolerance));
    double y[2] = {1, 0}, error = 0;
    integrator.restart(0, y, kNever);
    for (int k = 1; k <= 200; ++k) {
      const double t = 0.1 * k;
      integrator.integrate_to(t, y);
      error = std::max({error, std::fabs(y[0] - std::cos(t)), std::fabs(y[1] + std::sin(t))});
    }
    all.tolerance.push_back(tolerance);
    all.error.push_back(error);
    all.evaluations.push_back(static_cast<double>(integrator.statistics().evaluations));
  }
  return all;
}

TEST(Integrator, ErrorFallsWithTheToleranceForEveryMethod) {
  for (const std::string& method : integrator_methods()) {
    const Convergence c = refine_oscillator(method);
    // proportional to the tolerance in theory; measured exponents lie between 0.86 and 1.04
    EXPECT_NEAR(slope(c.tolerance, c.error), 1, 0.25) << method;
    for (std::size_t i = 0; i < c.error.size();
         ++i)  // six decades; measured at most 540 tolerances, after 3 turns
      EXPECT_LT(c.error[i], 1000 * c.tolerance[i]) << method << " at " << c.tolerance[i];
  }
}

// Kepler orbit of eccentricity 0.3 and period 2 pi: after one turn everything is as at the start.
void kepler(double, const double* y, double* rate) {
  const double r = std::hypot(y[0], y[1]);
  rate[0] = y[2];
  rate[1] = y[3];
  rate[2] = -y[0] / (r * r * r);
  rate[3] = -y[1] / (r * r * r);
}

TEST(Integrator, ExplicitPairsHaveTheirOrder) {
  // order of the solution that each pair carries on
  const std::map<std::string, double> order = {
      {"bogacki_shampine", 3}, {"cash_karp", 5}, {"dormand_prince", 5}, {"fehlberg", 5}, {"verner", 6}};
  for (const auto& [method, p] : order) {
    std::vector<double> evaluations, error;
    for (double tolerance = 1e-4; tolerance > 5e-11; tolerance /= std::sqrt(10)) {
      Integrator integrator(kepler, {tolerance, tolerance, tolerance, tolerance}, with(method, tolerance));
      const double start[4] = {0.7, 0, 0, std::sqrt(1.3 / 0.7)};
      double y[4];
      integrator.restart(0, start, 2 * M_PI);
      integrator.integrate_to(2 * M_PI, y);
      double worst = 0;
      for (int i = 0; i < 4; ++i) worst = std::max(worst, std::fabs(y[i] - start[i]));
      error.push_back(worst);
      evaluations.push_back(static_cast<double>(integrator.statistics().evaluations));
    }
    // error ~ step^p ~ evaluations^-p; the start-up steps, which a loose tolerance feels most, make it look
    // steeper
    EXPECT_GT(-slope(evaluations, error), p - 0.5) << method;
  }
}

TEST(Integrator, StopsAndStartsAgainAtAJump) {
  // y' = +1 before t = 1, -2 after: exact for every method as long as none sees the other side
  for (const std::string& method : integrator_methods()) {
    double side = 1, latest = 0;
    Integrator integrator(
        [&](double t, const double*, double* rate) {
          latest = std::max(latest, t);
          rate[0] = side;
        },
        {1e-10}, with(method));
    double y = 0;
    integrator.restart(0, &y, 1);
    integrator.integrate_to(0.3, &y);
    EXPECT_NEAR(y, 0.3, 1e-12) << method;
    integrator.integrate_to(1, &y);
    EXPECT_NEAR(y, 1, 1e-12) << method;
    EXPECT_LE(latest, 1) << method << " looked beyond the stop time";
    side = -2;
    integrator.restart(1, &y, 2);
    integrator.integrate_to(1.75, &y);
    EXPECT_NEAR(y, -0.5, 1e-12) << method;
    EXPECT_LE(latest, 2) << method;
  }
}

TEST(Integrator, AStopTimeAFewRoundingsAheadIsReached) {
  for (const std::string& method : integrator_methods())
    for (double start : {0.05, 1.0, 36000.0, -3.0}) {
      double stop = start;
      for (int ulp = 1; ulp <= 300; ++ulp) {
        stop = std::nextafter(stop, kNever);
        if (ulp > 20 && ulp % 7 != 0) continue;
        Integrator integrator(decay, {1e-9}, with(method));
        double y = 1;
        integrator.restart(start, &y, stop);
        ASSERT_NO_THROW(integrator.integrate_to(stop, &y))
            << method << ", " << ulp << " roundings from " << start;
        ASSERT_NEAR(y, 1, 1e-8);  // exp(-1e-9) at most
        integrator.restart(stop, &y, kNever);
        ASSERT_NO_THROW(integrator.integrate_to(stop + 1, &y)) << method;
        ASSERT_NEAR(y, std::exp(-1.0), 1e-4) << method;  // hundred tolerances
      }
    }
}

TEST(Integrator, RestartTwiceAtTheSameTimeIsRestartOnce) {
  for (const std::string& method : integrator_methods()) {
    double once[2] = {1, 0}, twice[2] = {1, 0};
    Integrator a(oscillator, {1e-9, 1e-9}, with(method)), b(oscillator, {1e-9, 1e-9}, with(method));
    a.restart(0, once, kNever);
    b.restart(0, twice, 5);
    b.restart(0, twice, kNever);
    for (double t : {0.5, 0.5, 3.0}) {
      a.integrate_to(t, once);
      b.integrate_to(t, twice);
      a.restart(t, once, kNever);
      b.restart(t, twice, t + 1e-3);
      b.restart(t, twice, kNever);
    }
    EXPECT_EQ(once[0], twice[0]) << method;
    EXPECT_EQ(once[1], twice[1]) << method;
  }
}

TEST(Integrator, ATimeAHairBeforeTheLastGivesTheSameState) {
  for (const std::string& method : integrator_methods()) {
    double y[2] = {1, 0}, again[2];
    Integrator integrator(oscillator, {1e-9, 1e-9}, with(method));
    integrator.restart(0, y, kNever);
    integrator.integrate_to(0.7, y);
    integrator.integrate_to(std::nextafter(0.7, 0), again);
    EXPECT_EQ(y[0], again[0]) << method;
    EXPECT_EQ(y[1], again[1]) << method;
  }
}

std::string failure(const std::function<void()>& action) {
  try {
    action();
  } catch (const IntegrationError& error) {
    return error.what();
  }
  return "nothing thrown";
}

TEST(Integrator, RefusesTimesThatItCannotReach) {
  for (const std::string& method : integrator_methods()) {
    Integrator integrator(decay, {1e-9}, with(method));
    double y = 1;
    EXPECT_NE(failure([&] { integrator.integrate_to(1, &y); }).find("needs a restart() first"),
              std::string::npos);
    integrator.restart(0, &y, 2);
    integrator.integrate_to(1, &y);
    EXPECT_NE(failure([&] { integrator.integrate_to(0.5, &y); }).find("before the last"), std::string::npos)
        << method;
    EXPECT_NE(failure([&] { integrator.integrate_to(2.5, &y); }).find("beyond the stop"), std::string::npos)
        << method;
    EXPECT_NE(failure([&] { integrator.integrate_to(std::nan(""), &y); }).find("is not finite"),
              std::string::npos);
    EXPECT_NE(failure([&] { integrator.integrate_to(kNever, &y); }).find("is not finite"), std::string::npos);
    integrator.integrate_to(2, &y);  // none of them did harm
    EXPECT_NEAR(y, std::exp(-2.0), 1e-4) << method;
  }
}

TEST(Integrator, FailureNamesMethodFunctionAndCodeAndIsMendedByRestart) {
  for (const std::string& method : integrator_methods()) {
    bool broken = true;
    Integrator integrator(
        [&](double, const double* y, double* rate) { rate[0] = broken ? std::nan("") : -y[0]; }, {1e-9},
        with(method));
    double y = 1;
    integrator.restart(0, &y, kNever);
    const std::string text = failure([&] { integrator.integrate_to(2, &y); });
    const bool multistep = method == "bdf" || method == "adams";
    EXPECT_EQ(text.rfind(method + (multistep ? ": CVode" : ": ARKodeEvolve") + " returned ", 0), 0u) << text;
    EXPECT_NE(text.find(multistep ? "CV_" : "ARK_"), std::string::npos) << text;
    EXPECT_NE(text.find("at t = "), std::string::npos) << text;
    broken = false;
    y = 1;
    integrator.restart(0, &y, kNever);
    integrator.integrate_to(0.5, &y);
    EXPECT_NEAR(y, std::exp(-0.5), 1e-4) << method;
  }
}

TEST(Integrator, AWallOfNonFiniteDerivativesIsReportedSoonAndWithItsTime) {
  for (const std::string& method : integrator_methods()) {
    long calls = 0;
    Integrator integrator(
        [&](double t, const double* y, double* rate) {
          ++calls;
          rate[0] = t < 1 ? -y[0] : std::nan("");
        },
        {1e-9}, with(method));
    double y = 1;
    integrator.restart(0, &y, kNever);
    const std::string text = failure([&] { integrator.integrate_to(2, &y); });
    const std::size_t at = text.find("at t = ");
    ASSERT_NE(at, std::string::npos) << text;
    EXPECT_NEAR(std::stod(text.substr(at + 7)), 1, 0.01)
        << text;  // where the wall is, not where the call began
    EXPECT_LT(calls, 100000) << method;
  }
}

TEST(Integrator, AFewNonFiniteTrialsAreMendedByShorterSteps) {
  for (const std::string& method : integrator_methods()) {
    Integrator integrator(  // long rest, then motion; what lies beyond t = 1.5 is only tried, never reached
        [](double t, const double* y, double* rate) { rate[0] = t < 1     ? 0
                                                                : t < 1.5 ? -y[0]
                                                                          : std::nan(""); },
        {1e-9}, with(method));
    double y = 1;
    integrator.restart(0, &y, kNever);
    integrator.integrate_to(1.2, &y);
    EXPECT_NEAR(y, std::exp(-0.2), 1e-4) << method;
  }
}

TEST(Integrator, ExceptionsOfTheDerivativeComeThrough) {
  for (const std::string& method : integrator_methods()) {
    bool broken = true;
    long calls = 0;
    Integrator integrator(
        [&](double t, const double* y, double* rate) {
          ++calls;
          if (broken && t > 0.5) throw std::domain_error("no such angle");
          rate[0] = -y[0];
        },
        {1e-9}, with(method));
    double y = 1;
    integrator.restart(0, &y, kNever);
    EXPECT_THROW(integrator.integrate_to(1, &y), std::domain_error) << method;
    EXPECT_LT(calls, 10000) << method << " went on trying";
    broken = false;
    y = 1;
    integrator.restart(0, &y, kNever);
    integrator.integrate_to(1, &y);
    EXPECT_NEAR(y, std::exp(-1.0), 1e-4) << method;
  }
}

/// The oscillator's cosine rises through -0.5, its sine falls through 0 and rises, each once per turn.
void crossings(double, const double* y, double* values) {
  values[0] = y[0] + 0.5;
  values[1] = y[1];
}

TEST(Integrator, EventsAreTheRisesThroughZeroAndNothingElse) {
  for (const std::string& method : integrator_methods()) {
    for (bool restarts : {false, true}) {
      Integrator integrator(oscillator, {1e-11, 1e-11}, with(method, 1e-10), crossings, 2);
      double y[2] = {1, 0};  // y[1] = -sin t: exactly zero at the start, and falling
      integrator.restart(0, y, kNever);
      double latest = 0;
      for (int turn = 0; turn < 5; ++turn) {
        // y[1] rises through zero at pi; y[0] through -0.5 at 4/3 pi
        for (const auto& [event, time] : {std::pair(1, M_PI), std::pair(0, 4 * M_PI / 3)}) {
          const double expected = time + 2 * M_PI * turn;
          ASSERT_EQ(integrator.integrate_to(expected - 1e-3, y), Integrator::kNoEvent) << method;
          ASSERT_EQ(integrator.integrate_to(100, y), event) << method << " near " << expected;
          // phase error of 1e-10 per step over some thousand steps; the interpolation adds less
          EXPECT_NEAR(integrator.time(), expected, 1e-7) << method;
          EXPECT_GT(integrator.time(), latest);
          latest = integrator.time();
          EXPECT_NEAR(event == 0 ? y[0] + 0.5 : y[1], 0, 1e-11) << method;
          if (restarts) integrator.restart(latest, y, kNever);
        }
      }
    }
  }
}

TEST(Integrator, ExceptionsOfEventsComeThrough) {
  for (const std::string& method : integrator_methods()) {
    bool broken = true;
    const auto events = [&](double t, const double*, double* values) {
      if (broken && t > 0.5) throw std::domain_error("no such angle");
      values[0] = -1;
    };
    Integrator integrator(decay, {1e-9}, with(method), events, 1);
    double y = 1;
    integrator.restart(0, &y, kNever);
    EXPECT_THROW(integrator.integrate_to(1, &y), std::domain_error) << method;
    broken = false;
    y = 1;
    integrator.restart(0, &y, kNever);
    EXPECT_EQ(integrator.integrate_to(1, &y), Integrator::kNoEvent);
    EXPECT_NEAR(y, std::exp(-1.0), 1e-4) << method;
  }
}

TEST(Integrator, StatisticsCountEveryEvaluationAcrossRestarts) {
  for (const std::string& method : integrator_methods()) {
    long calls = 0;
    Integrator integrator(
        [&](double, const double* y, double* rate) {
          ++calls;
          oscillator(0, y, rate);
        },
        {1e-9, 1e-9}, with(method));
    EXPECT_EQ(integrator.statistics().steps, 0);
    double y[2] = {1, 0};
    for (double t = 0; t < 3; t += 1) {
      integrator.restart(t, y, t + 1);
      integrator.integrate_to(t + 1, y);
      const IntegratorStatistics now = integrator.statistics();
      EXPECT_EQ(now.evaluations, calls) << method;
      EXPECT_GT(now.steps, 5) << method;
      EXPECT_EQ(integrator.statistics().steps, now.steps);  // asking changes nothing
    }
  }
}

TEST(Integrator, MayBeMovedAndDoesNotTouchOthers) {
  Integrator a(oscillator, {1e-9, 1e-9}, with("dormand_prince")), b(decay, {1e-9}, with("bdf"));
  double y[2] = {1, 0}, z = 1;
  a.restart(0, y, kNever);
  b.restart(0, &z, kNever);
  a.integrate_to(1, y);
  Integrator c = std::move(a);
  b.integrate_to(1, &z);
  c.integrate_to(2, y);
  EXPECT_NEAR(y[0], std::cos(2.0), 1e-4);
  EXPECT_NEAR(z, std::exp(-1.0), 1e-4);
}

TEST(Integrator, RefusesUnknownMethodsAndTolerances) {
  const auto message = [](const SolverSettings& settings, double absolute) -> std::string {
    try {
      Integrator integrator(decay, {absolute}, settings);
    } catch (const InvalidParameter& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(with("dormand_prince"), 1e-9), "accepted");
  EXPECT_EQ(message(with("euler"), 1e-9), "solver.method = euler: is not a known method");
  EXPECT_EQ(message(with("bdf", 0), 1e-9), "solver.relative_tolerance = 0: must be > 0 and finite");
  EXPECT_EQ(message(with("bdf", -1e-6), 1e-9), "solver.relative_tolerance = -1e-06: must be > 0 and finite");
  EXPECT_EQ(message(with("bdf", std::nan("")), 1e-9),
            "solver.relative_tolerance = nan: must be > 0 and finite");
  EXPECT_EQ(message(with("bdf"), 0), "solver absolute tolerance = 0: must be > 0 and finite");
  EXPECT_EQ(message(with("bdf"), kNever), "solver absolute tolerance = inf: must be > 0 and finite");
}

TEST(SolverSettings, ReadsAllAndRefusesTheRest) {
  const auto read = [](const std::string& text) {
    const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
    const SolverSettings settings = read_solver(yaml);
    yaml.finish();
    return settings;
  };
  const SolverSettings s =
      read("{method: verner, relative_tolerance: 1e-8, position_tolerance: 1e-11, velocity_tolerance: 1e-9}");
  EXPECT_EQ(s.method, "verner");
  EXPECT_EQ(s.relative_tolerance, 1e-8);
  EXPECT_EQ(s.position_tolerance, 1e-11);
  EXPECT_EQ(s.velocity_tolerance, 1e-9);
  const std::string rest = "\nposition_tolerance: 1e-10\nvelocity_tolerance: 1e-7\n";
  const struct {
    std::string text, message;
  } cases[] = {
      {"method: rk4\nrelative_tolerance: 1e-6" + rest, "rig.yaml:1: method = rk4: must be one of "},
      {"method: bdf" + rest, "rig.yaml:1: relative_tolerance: is missing, expected a number"},
      {"method: bdf\nrelative_tolerance: 0" + rest,
       "rig.yaml:2: relative_tolerance = 0: must be >= 1e-13 and <= 0.1"},
      {"method: bdf\nrelative_tolerance: 1" + rest,
       "rig.yaml:2: relative_tolerance = 1: must be >= 1e-13 and <= 0.1"},
      {"method: bdf\nrelative_tolerance: 1e-6\nposition_tolerance: 0\nvelocity_tolerance: 1\n",
       "rig.yaml:3: position_tolerance = 0: must be > 0"},
      {"method: bdf\nrelative_tolerance: 1e-6" + rest + "step: 1\n", "rig.yaml:5: step = 1: unknown key"},
  };
  for (const auto& bad : cases) {
    try {
      read(bad.text);
      ADD_FAILURE() << "accepted: " << bad.text;
    } catch (const BadData& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, bad.message.size()), bad.message);
    }
  }
}

}  // namespace
}  // namespace backlash::simulation
