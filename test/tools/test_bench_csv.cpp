// SPDX-License-Identifier: BSD-3-Clause
// A record as a test bench writes it, through the commands: what the rig file says of its columns gives the
// record that it was made of. The oracle is the file in the package's own format, turned into the other one
// by awk.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/record/csv.h"
#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using record::Channel;

class BenchCsv : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    write("rig.yaml", content(package_file("config/two_inertia_servo.yaml")));
    done("simulate rig.yaml --duration 3 --out own.csv");
    // Milliseconds, degrees, a current of 2 N m/A, arc minutes of the other sign; semicolons, decimal commas.
    ASSERT_EQ(
        shell("(awk -F, 'BEGIN {print \"# bench 4\"; print \"No;t [ms];\\\"Iq, filtered\\\";phi [deg];psi "
              "(arcmin)\";"
              " print \";;A;;\"}"
              " NR == 1 {for (i = 1; i <= NF; ++i) at[$i] = i; next}"
              " {line = sprintf(\"%d;%.12g;%.17g;%.17g;%.17g\", NR, 1000 * $at[\"time\"], "
              "$at[\"motor_torque\"] / 2,"
              " $at[\"motor_position\"] * 45 / atan2(1, 1), -$at[\"load_position\"] * 2700 / atan2(1, 1));"
              " gsub(/\\./, \",\", line); print line}' own.csv >bench.csv)")
            .code,
        0);
    write("bench.yaml", read("rig.yaml") +
                            "channels:\n"
                            "  time: {column: t}\n"
                            "  motor_torque: {column: 'Iq, filtered', scale: 2}\n"
                            "  motor_position: {column: 'phi [deg]'}\n"
                            "  load_position: {column: psi, scale: -1}\n");
  }
};

TEST_F(BenchCsv, IsReadAsTheRecordItWasMadeOf) {
  done("convert_record bench.csv out.csv --rig bench.yaml");
  const record::Record own = record::read_csv(path("own.csv")), out = record::read_csv(path("out.csv"));
  ASSERT_EQ(out.size(), own.size());
  EXPECT_EQ(out.time, own.time);
  for (const Channel channel : {Channel::motor_torque, Channel::motor_position, Channel::load_position})
    for (std::size_t i = 0; i < own.size(); ++i) {
      const double value = own.column(channel)[i];  // four roundings
      ASSERT_NEAR(out.column(channel)[i], value, 1e-15 * std::fabs(value)) << i;
    }
  EXPECT_FALSE(out.has(Channel::motor_velocity));

  // What was converted has the package's own names, which the same rig file reads as what they are.
  done("convert_record out.csv again.csv --rig bench.yaml");
  EXPECT_EQ(read("again.csv"), read("out.csv"));

  const auto verdict = [&](const std::string& line) {
    const Outcome outcome = run(line);
    EXPECT_LE(outcome.code, 3) << outcome.err;
    const std::string json = read("x.json");
    return json.substr(json.find("\"verdict\""));
  };
  // Of the last digits of a value, none is left in the message.
  const auto message = [](const std::string& text) {
    const auto start = text.find("\"message\"");
    return text.substr(start, text.find('\n', start) - start);
  };
  EXPECT_EQ(message(verdict("diagnose_record bench.csv --rig bench.yaml --json x.json")),
            message(verdict("diagnose_record out.csv --rig rig.yaml --json x.json")));
}

TEST_F(BenchCsv, RefusalsNameFileLineAndColumn) {
  ASSERT_EQ(shell("(sed '1,2s/deg/Nm/' bench.csv >wrong.csv)").code, 0);
  Outcome outcome = run("identify wrong.csv --rig bench.yaml --out f.yaml --json f.json");
  EXPECT_EQ(outcome.code, 65);
  expect_contains(outcome.err,
                  "wrong.csv:2: column 'phi [deg]' of channels.motor_position: not there, there are: No, ");
  ASSERT_EQ(shell("(sed 's/phi .deg./phi/' bench.yaml >other.yaml)").code, 0);
  outcome = run("compare_models wrong.csv other.yaml --json f.json");
  EXPECT_EQ(outcome.code, 65);
  expect_contains(
      outcome.err,
      "wrong.csv:2: phi [Nm]: unit = 'Nm' of channels.motor_position: a torque, expected an angle");
  ASSERT_EQ(shell("(sed 's/column: t}/column: t, unit: fortnight}/' bench.yaml >other.yaml)").code, 0);
  outcome = run("trace_residual --rig other.yaml --train bench.csv --test bench.csv --out d");
  EXPECT_EQ(outcome.code, 65);
  expect_contains(outcome.err, "channels.time.unit = fortnight: unknown, known are s, ");
}

}  // namespace
}  // namespace backlash::test
