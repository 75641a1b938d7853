// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/excitation.h"

namespace backlash::simulation {
namespace {

const double kNever = std::numeric_limits<double>::infinity();

TEST(Excitation, ShortestPeriodIsThatOfTheHighestFrequency) {
  EXPECT_DOUBLE_EQ(sine_excitation(1, 4)->shortest_period(0), 0.25);
  EXPECT_DOUBLE_EQ(multi_sine_excitation({{1, 3, 0}, {1, 50, 0}, {1, 7, 0}})->shortest_period(0), 0.02);
  EXPECT_DOUBLE_EQ(chirp_excitation(1, 0.25, 100, 8)->shortest_period(0), 0.01);
  EXPECT_DOUBLE_EQ(chirp_excitation(1, 100, 0.25, 8)->shortest_period(0), 0.01);
  EXPECT_GE(random_excitation(1, 5, 40, 16, 1)->shortest_period(0), 1 / 40.0);
  EXPECT_TRUE(std::isinf(constant_excitation(3)->shortest_period(0)));
  EXPECT_TRUE(std::isinf(square_excitation(1, 10)->shortest_period(0)));
}

TEST(Excitation, SquareSwitchesAtExactTimes) {
  const auto square = square_excitation(0.05, 10, 0.01);
  EXPECT_EQ(square->period(), 0.1);
  for (long k : {0L, 1L, 2L, 3L, 4L, 17L, 1000000L, 1000000007L}) {
    EXPECT_EQ(square->segment_end(k), (k + 1) / 20.0) << k;  // rounded once, nothing accumulates
    const double inside = (k + 0.5) / 20;
    EXPECT_EQ(square->torque(inside, k), k % 2 == 0 ? 0.01 + 0.05 : 0.01 - 0.05);
  }
}

TEST(Excitation, SquareIsDefinedFromBothSidesOfASwitch) {
  const auto square = square_excitation(0.05, 10);
  EXPECT_EQ(square->torque(0.05, 0), 0.05);
  EXPECT_EQ(square->torque(0.05, 1), -0.05);
}

TEST(Excitation, SineFollowsTheFormulaAndNeverSwitches) {
  const auto sine = sine_excitation(2, 3, -0.5);
  EXPECT_DOUBLE_EQ(sine->period(), 1.0 / 3);
  EXPECT_EQ(sine->segment_end(0), kNever);
  EXPECT_DOUBLE_EQ(sine->torque(0, 0), -0.5);
  EXPECT_NEAR(sine->torque(1.0 / 12, 0), 1.5, 1e-15);   // a quarter of a period
  EXPECT_NEAR(sine->torque(3.0 / 12, 0), -2.5, 1e-15);  // three quarters
  EXPECT_NEAR(sine->torque(1.0 / 18, 0), -0.5 + 2 * std::sqrt(0.75),
              1e-14);  // 60 deg
}

// Where the torque crosses its bias in (from, to), by bisection.
double crossing(const Excitation& excitation, double bias, double from, double to) {
  const bool rising = excitation.torque(from, 0) < bias;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (from + to);
    ((excitation.torque(middle, 0) < bias) == rising ? from : to) = middle;
  }
  return 0.5 * (from + to);
}

// Between two crossings the phase grows by half a turn: with a frequency that is linear in time, the
// frequency in the middle times the distance is exactly 1/2.
void expect_linear_frequency(double start, double end, double duration) {
  const auto chirp = chirp_excitation(1, start, end, duration, 0.25);
  const double step = 0.05 / std::max(start, end);
  std::vector<double> crossings = {0};
  for (double t = step; t + step < duration; t += step)
    if ((chirp->torque(t, 0) < 0.25) != (chirp->torque(t + step, 0) < 0.25))
      crossings.push_back(crossing(*chirp, 0.25, t, t + step));
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    const double middle = 0.5 * (crossings[i] + crossings[i - 1]);
    const double frequency = start + (end - start) * middle / duration;
    // bisection to the last digit; the argument of the sine has an error of a few 1e-14 turns
    EXPECT_NEAR(frequency * (crossings[i] - crossings[i - 1]), 0.5, 1e-11) << "at " << middle << " s";
  }
  // half turns within the sweep: its mean frequency times its length, the last one may be cut
  EXPECT_NEAR(static_cast<double>(crossings.size() - 1), (start + end) * duration, 1);
}

TEST(Excitation, ChirpFrequencyRisesOrFallsLinearly) {
  expect_linear_frequency(1, 50, 4);
  expect_linear_frequency(40, 2, 3);
  expect_linear_frequency(5, 5, 2);
}

TEST(Excitation, ChirpHasContinuousPhaseAndStartsAgainAfterItsDuration) {
  const auto chirp = chirp_excitation(0.3, 1, 20, 2.5, 0.1);
  EXPECT_EQ(chirp->period(), 2.5);
  for (long k : {0L, 1L, 9L, 1000L}) {
    EXPECT_EQ(chirp->segment_end(k), (k + 1) * 2.5);
    EXPECT_NEAR(chirp->torque(k * 2.5, k), 0.1, 1e-15);
    for (double s = 0; s < 2.5; s += 0.13)  // 2500 s have a rounding of 5e-13 s, times 2 pi 20 Hz
      EXPECT_NEAR(chirp->torque(k * 2.5 + s, k), chirp->torque(s, 0), 2e-11);
  }
  for (double t = 0; t < 2.5; t += 1e-3)  // no jump: slope at most amplitude times 2 pi 20 Hz
    EXPECT_LE(std::fabs(chirp->torque(t + 1e-3, 0) - chirp->torque(t, 0)), 0.3 * 2 * M_PI * 20 * 1e-3);
}

TEST(Excitation, MultiSineAddsItsLines) {
  const auto sum = multi_sine_excitation({{1, 2, 0}, {0.5, 3, M_PI / 2}}, 0.25);
  EXPECT_EQ(sum->segment_end(0), kNever);
  EXPECT_DOUBLE_EQ(sum->torque(0, 0), 0.25 + 0.5);
  for (double t = 0; t < 1; t += 0.07)
    EXPECT_NEAR(sum->torque(t, 0), 0.25 + std::sin(4 * M_PI * t) + 0.5 * std::cos(6 * M_PI * t), 1e-14);
}

double multi_sine_period(const std::vector<double>& frequencies) {
  std::vector<SineLine> lines;
  for (double f : frequencies) lines.push_back({1, f, 0.3 * f});
  const auto excitation = multi_sine_excitation(lines);
  const double period = excitation->period();
  if (period > 0) {
    for (double t = 0.01; t < period; t += period / 7)
      EXPECT_NEAR(excitation->torque(t, 0), excitation->torque(t + period, 0), 1e-6) << "does not repeat";
  }
  return period;
}

TEST(Excitation, MultiSinePeriodIsThatOfTheGreatestCommonDivisor) {
  EXPECT_NEAR(multi_sine_period({10, 15, 25}), 0.2, 1e-15);
  EXPECT_NEAR(multi_sine_period({1, 1.5}), 2, 1e-14);
  EXPECT_NEAR(multi_sine_period({0.001, 7}), 1000, 1e-9);
  EXPECT_NEAR(multi_sine_period({1.0 / 3, 2.0 / 3}), 3, 1e-12);  // not a multiple of 1 mHz
  EXPECT_NEAR(multi_sine_period({12.5, 12.5}), 0.08, 1e-15);
  EXPECT_NEAR(multi_sine_period({0.0004}), 2500, 1e-9);  // a single line always repeats
  EXPECT_NEAR(multi_sine_period({101.7, 33.9, 67.8}), 1 / 33.9, 1e-12);
}

TEST(Excitation, MultiSineWithoutCommonPeriodSaysSo) {
  EXPECT_EQ(multi_sine_period({1, std::sqrt(2)}), 0);
  EXPECT_EQ(multi_sine_period({0.0004, 1}),
            0);  // 0.4 mHz is below the limit; the line must not be overlooked
}

TEST(Excitation, ConstantHoldsForEver) {
  const auto constant = constant_excitation(-0.7);
  EXPECT_EQ(constant->torque(0, 0), -0.7);
  EXPECT_EQ(constant->torque(1e9, 0), -0.7);
  EXPECT_EQ(constant->segment_end(0), kNever);
  EXPECT_EQ(constant->period(), 0);
}

TEST(Excitation, TopicHoldsTheLastTorqueAndRefusesNonsense) {
  const auto topic = external_excitation();
  EXPECT_EQ(topic->torque(3, 0), 0);
  EXPECT_TRUE(topic->set_torque(0.4));
  EXPECT_EQ(topic->torque(5, 0), 0.4);
  EXPECT_EQ(topic->segment_end(0), kNever);
  EXPECT_THROW(topic->set_torque(std::nan("")), InvalidParameter);
  EXPECT_THROW(topic->set_torque(kNever), InvalidParameter);
  EXPECT_EQ(topic->torque(6, 0), 0.4);
}

TEST(Excitation, AllButTopicRefuseATorqueFromOutside) {
  const auto square = square_excitation(1, 1);
  EXPECT_FALSE(square->set_torque(5));
  EXPECT_EQ(square->torque(0.1, 0), 1);
  EXPECT_FALSE(constant_excitation(1)->set_torque(5));
  EXPECT_FALSE(sine_excitation(1, 1)->set_torque(5));
  EXPECT_FALSE(chirp_excitation(1, 1, 2, 1)->set_torque(5));
  EXPECT_FALSE(multi_sine_excitation({{1, 1, 0}})->set_torque(5));
}

TEST(Excitation, FactoriesRefuseWhatHasNoMeaning) {
  const double nan = std::nan("");
  const std::function<void()> bad[] = {
      [=] { constant_excitation(nan); },
      [=] { square_excitation(1, 0); },
      [=] { square_excitation(1, -10); },
      [=] { square_excitation(nan, 10); },
      [=] { square_excitation(1, 10, kNever); },
      [=] { sine_excitation(1, -1); },
      [=] { chirp_excitation(1, 0, 10, 1); },
      [=] { chirp_excitation(1, 1, nan, 1); },
      [=] { chirp_excitation(1, 1, 10, 0); },
      [=] {
        multi_sine_excitation({{1, 1, 0}, {1, 0, 0}});
      },
      [=] {
        multi_sine_excitation({{1, 1, nan}});
      },
      [=] {
        ExcitationSettings settings;
        settings.type = "triangle";
        settings.create();
      },
  };
  for (const auto& action : bad) EXPECT_THROW(action(), InvalidParameter) << "case " << &action - bad;
  try {
    square_excitation(1, -10);
  } catch (const InvalidParameter& error) {
    EXPECT_STREQ(error.what(), "excitation.frequency = -10: must be > 0");
  }
}

YamlReader parse(const std::string& text) {
  return YamlReader::from_text(text, "rig.yaml");
}

std::unique_ptr<Excitation> created(const std::string& text) {
  const YamlReader yaml = parse(text);
  const ExcitationSettings settings = read_excitation(yaml);
  yaml.finish();
  return settings.create();
}

TEST(ExcitationSettings, EveryTypeIsReadAndCreated) {
  EXPECT_EQ(created("{type: square, amplitude: 0.05, frequency: 10, bias: 0.01}")->torque(0, 1), 0.01 - 0.05);
  EXPECT_EQ(created("{type: sine, amplitude: 1, frequency: 2}")->period(), 0.5);
  EXPECT_EQ(created("{type: constant, torque: -3}")->torque(0, 0), -3);
  EXPECT_TRUE(created("type: topic")->set_torque(1));
  EXPECT_EQ(
      created("{type: random, rms: 2, lower_frequency: 1, upper_frequency: 9, lines: 20, seed: 5, bias: 1}")
          ->torque(0.2, 0),
      random_excitation(2, 1, 9, 20, 5, 1)->torque(0.2, 0));
  const auto chirp =
      created("{type: chirp, amplitude: 1, start_frequency: 8, end_frequency: 2, duration: 4, bias: 1}");
  EXPECT_EQ(chirp->period(), 4);
  EXPECT_NEAR(chirp->torque(1.0 / 32, 0), 1 + std::sin(2 * M_PI * (8 - 0.75 / 32) / 32), 1e-14);
  const auto sum = created(
      "{type: multi_sine, bias: 2, lines: [{amplitude: 1, frequency: 2, phase: 0.5}, "
      "{amplitude: 3, frequency: 5}]}");
  EXPECT_DOUBLE_EQ(sum->torque(0, 0), 2 + std::sin(0.5));
  const auto stepped = created(
      "{type: stepped_sine, amplitude: 3, bias: 1, start_frequency: 1, end_frequency: 2, step_frequency: 1, "
      "cycles: 4}");
  EXPECT_EQ(stepped->period(), 6);
  EXPECT_NEAR(stepped->torque(0.25, 0), 4, 1e-14);
}

TEST(ExcitationSettings, SpeedLoopsAreReadAndCreated) {
  const std::string controller = "controller: {rate: 10, proportional: 2, integral: 0, torque_limit: 5}";
  const auto asked = [](Excitation& loop, long sample) {
    loop.begin_segment(sample, model::Observation{});
    return loop.torque(0, sample);
  };
  const auto one = created("{type: constant_speed, speed: 1.5, ramp: 1, " + controller + "}");
  EXPECT_EQ(asked(*one, 5), 2 * 0.75);
  EXPECT_EQ(asked(*one, 1000), 2 * 1.5);
  const auto two = created("{type: constant_speed, speeds: [1, -2], hold: 2, ramp: 1, " + controller + "}");
  EXPECT_EQ(asked(*two, 20), 2);
  EXPECT_EQ(asked(*two, 50), -4);
  const auto sine =
      created("{type: sine_speed, offset: 1, amplitude: 0.5, frequency: 0.5, ramp: 1, " + controller + "}");
  EXPECT_NEAR(asked(*sine, 25), 2 * 1.5, 1e-14);
  EXPECT_EQ(asked(*created("{type: constant_speed, speed: 9, ramp: 1, " + controller + "}"), 99), 5);
}

TEST(ExcitationSettings, MovesGoFromPositionToPosition) {
  const std::string controller = "controller: {rate: 100, proportional: 2, integral: 0, torque_limit: 500}";
  const auto loop = created(
      "{type: moves, positions: [1, -0.5], speed: 1, acceleration: 2, dwell: 0.5, position_gain: 8, " +
      controller + "}");
  const auto asked = [&](double t, double position) {
    model::Observation machine{};
    machine.motor_position = position;
    const long sample = std::lround(100 * t);
    loop->begin_segment(sample, machine);
    return loop->torque(t, sample) / 2;
  };
  // To 1: 0.5 s up to 1 rad/s (0.25 rad), 0.5 s on, 0.5 s down; there 0.5 s. To -0.5: 2 s, there 0.5 s. Back:
  // 2 s.
  EXPECT_NEAR(asked(0.25, 0.0625), 0.5, 1e-12);
  EXPECT_NEAR(asked(0.26, 0), 0.52 + 8 * 0.26 * 0.26, 1e-12);
  EXPECT_NEAR(asked(0.75, 0.5), 1, 1e-12);
  EXPECT_NEAR(asked(1.25, 1 - 0.0625), 0.5, 1e-12);
  EXPECT_NEAR(asked(1.75, 0.9), 8 * 0.1, 1e-12);
  EXPECT_NEAR(asked(3, 0.25), -1, 1e-12);
  EXPECT_NEAR(asked(4.2, -0.5), 0, 1e-12);
  EXPECT_NEAR(asked(4.75, -0.5 + 0.0625), 0.5, 1e-12);
  EXPECT_NEAR(asked(3 + 5000, 0.25), -1, 1e-9) << "a cycle takes 5 s";
}

TEST(ExcitationSettings, PlaceAndBrake) {
  const auto read = [](const std::string& text) { return read_excitation(parse(text)); };
  const ExcitationSettings plain = read("{type: constant, torque: 1}");
  EXPECT_FALSE(plain.at_load || plain.motor_brake);
  EXPECT_FALSE(read("{type: constant, torque: 1, at: motor, motor_brake: false}").at_load);
  const ExcitationSettings hand =
      read("{type: sine, amplitude: 1, frequency: 1, at: load, motor_brake: true}");
  EXPECT_TRUE(hand.at_load && hand.motor_brake);
  EXPECT_FALSE(read("{type: topic, at: load}").motor_brake);
}

TEST(RandomExcitation, HasTheRmsAndTheBandAndNeverRepeats) {
  const auto torque = random_excitation(0.05, 20, 60, 64, 7, 0.1);
  EXPECT_EQ(torque->period(), 0);
  EXPECT_EQ(torque->segment_end(0), std::numeric_limits<double>::infinity());
  const int count = 20000;
  double sum = 0, squares = 0, fourth = 0, outside = 0, inside = 0;
  for (int i = 0; i < count; ++i) {
    const double x = torque->torque(i * 7e-3, 0) - 0.1;
    sum += x / count;
    squares += x * x / count;
    fourth += x * x * x * x / count;
  }
  // Over 140 s the lines, 0.6 Hz apart in the mean, are nearly orthogonal.
  EXPECT_NEAR(sum, 0, 1e-4);
  EXPECT_NEAR(std::sqrt(squares), 0.05, 0.0005);
  // Sines of equal amplitude A: kurtosis 3 - 1.5 / lines.
  EXPECT_NEAR(fourth / (squares * squares), 3 - 1.5 / 64, 0.1);
  std::vector<double> x;
  for (int i = 0; i < 4000; ++i)
    x.push_back((1 - std::cos(2 * M_PI * i / 4000)) * (torque->torque(i * 1e-3, 0) - 0.1));
  for (double f = 2; f < 100; f += 0.25) {
    double re = 0, im = 0;
    for (int i = 0; i < 4000; ++i) {
      re += x[i] * std::cos(2 * M_PI * f * i * 1e-3);
      im += x[i] * std::sin(2 * M_PI * f * i * 1e-3);
    }
    if (f > 20 && f < 60) inside += re * re + im * im;
    if (f < 18 || f > 62) outside += re * re + im * im;
  }
  EXPECT_LT(outside, 1e-4 * inside);
}

TEST(RandomExcitation, FollowsItsSeed) {
  const auto a = random_excitation(1, 1, 10, 16, 1), same = random_excitation(1, 1, 10, 16, 1),
             other = random_excitation(1, 1, 10, 16, 2);
  EXPECT_EQ(a->torque(0.3, 0), same->torque(0.3, 0));
  EXPECT_NE(a->torque(0.3, 0), other->torque(0.3, 0));
  EXPECT_THROW(random_excitation(-1, 1, 10, 16, 1), InvalidParameter);
  EXPECT_THROW(random_excitation(1, 0, 10, 16, 1), InvalidParameter);
  EXPECT_THROW(random_excitation(1, 10, 10, 16, 1), InvalidParameter);
  EXPECT_THROW(random_excitation(1, 1, 10, 15, 1), InvalidParameter);
}

TEST(ExcitationSettings, CopiesAreIndependent) {
  ExcitationSettings settings;
  settings.type = "topic";
  const auto a = settings.create(), b = settings.create();
  a->set_torque(1);
  EXPECT_EQ(b->torque(0, 0), 0);
}

TEST(ExcitationSettings, RefusalNamesFileLineKeyValueAndLimit) {
  const std::string kLoop =
      "type: constant_speed\ncontroller: {rate: 1, proportional: 1, integral: 1, torque_limit: 1}\n";
  const struct {
    std::string text;
    std::string message;
  } cases[] = {
      {"amplitude: 1\n",
       "rig.yaml:1: type: is missing, expected one of square, sine, chirp, multi_sine, random, constant, "
       "topic, stepped_sine, constant_speed, sine_speed, moves"},
      {"type: triangle\n",
       "rig.yaml:1: type = triangle: must be one of square, sine, chirp, multi_sine, random, constant, "
       "topic, stepped_sine, constant_speed, sine_speed, moves"},
      {"type: square\nfrequency: 10\n", "rig.yaml:1: amplitude: is missing"},
      {"type: square\namplitude: -1\nfrequency: 10\n", "rig.yaml:2: amplitude = -1: must be >= 0"},
      {"type: square\namplitude: 1\nfrequency: 0\n", "rig.yaml:3: frequency = 0: must be > 0"},
      {"type: square\namplitude: 1\nfrequency: 10 Hz\n", "rig.yaml:3: frequency = 10 Hz: not a number"},
      {"type: square\namplitude: 1\nfrequency: 1\nbias: yes\n", "rig.yaml:4: bias = yes: not a number"},
      {"type: square\namplitude: 1\nfrequency: 1\nduty: 1\n", "rig.yaml:4: duty = 1: unknown key"},
      {"type: constant\namplitude: 1\n", "rig.yaml:1: torque: is missing"},
      {"type: topic\namplitude: 1\n", "rig.yaml:2: amplitude = 1: unknown key"},
      {"type: chirp\namplitude: 1\nstart_frequency: 1\nend_frequency: 2\n",
       "rig.yaml:1: duration: is missing"},
      {"type: chirp\namplitude: 1\nstart_frequency: 0\nend_frequency: 2\nduration: 1\n",
       "rig.yaml:3: start_frequency = 0: must be > 0"},
      {"type: multi_sine\nlines: []\n", "rig.yaml:2: lines = [...]: needs at least one line"},
      {"type: multi_sine\nlines: [{amplitude: 1, frequency: -1}]\n",
       "rig.yaml:2: lines[0].frequency = -1: must be > 0"},
      {"type: multi_sine\nlines: 3\n", "rig.yaml:2: lines = 3: must be a list of maps"},
      {"type: random\nrms: 1\nlower_frequency: 1\nupper_frequency: 9\nlines: 16\n",
       "rig.yaml:1: seed: is missing"},
      {"type: random\nrms: 1\nlower_frequency: 9\nupper_frequency: 9\nlines: 16\nseed: 1\n",
       "rig.yaml:4: upper_frequency = 9: must be > lower_frequency"},
      {"type: random\nrms: 1\nlower_frequency: 1\nupper_frequency: 9\nlines: 3\nseed: 1\n",
       "rig.yaml:5: lines = 3: must be"},
      {"{type: stepped_sine, amplitude: 1, start_frequency: 3, end_frequency: 2, step_frequency: 1, cycles: "
       "1}",
       "rig.yaml:1: end_frequency = 2: must be >= start_frequency"},
      {"{type: stepped_sine, amplitude: 1, start_frequency: 1, end_frequency: 2, step_frequency: 1, cycles: "
       "1.5}",
       "rig.yaml:1: cycles = 1.5: must be an integer"},
      {"type: constant_speed\nspeed: 1\nramp: 1\n", "rig.yaml:1: controller: is missing"},
      {"type: constant_speed\ncontroller: {rate: 1, proportional: 1, integral: 1, torque_limit: 0}\n",
       "rig.yaml:2: controller.torque_limit = 0: must be > 0"},
      {kLoop + "ramp: 1\n", "rig.yaml:1: speed: is missing"},
      {kLoop + "ramp: 1\nspeeds: []\nhold: 1\n", "rig.yaml:4: speeds = [...]: needs at least one"},
      {kLoop + "ramp: 1\nspeeds: [1]\n", "rig.yaml:1: hold: is missing"},
      {kLoop + "ramp: 1\nspeed: 1\nhold: 1\n", "rig.yaml:5: hold = 1: unknown key"},
      {"type: moves\ncontroller: {rate: 1, proportional: 1, integral: 1, torque_limit: 1}\npositions: [1]\n",
       "rig.yaml:3: positions = [...]: needs at least two positions"},
      {kLoop + "ramp: 1\nspeed: 1\nat: load\n", "rig.yaml:5: at = load: a speed loop drives the motor"},
      {kLoop + "ramp: 1\nspeed: 1\nmotor_brake: true\n", "rig.yaml:5: motor_brake = true: needs at: load"},
      {"type: constant\ntorque: 1\nat: gear\n", "rig.yaml:3: at = gear: must be one of motor, load"},
      {"type: constant\ntorque: 1\nmotor_brake: true\n", "rig.yaml:3: motor_brake = true: needs at: load"},
  };
  for (const auto& bad : cases) {
    try {
      created(bad.text);
      ADD_FAILURE() << "accepted: " << bad.text;
    } catch (const BadData& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, bad.message.size()), bad.message);
    }
  }
}

}  // namespace
}  // namespace backlash::simulation
