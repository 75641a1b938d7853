// SPDX-License-Identifier: BSD-3-Clause
// The exceptions of the core. Each carries what an operator needs to act: the name, the value and the limit,
// or the place in the file. Boundaries (tools, nodes) turn them into exit codes, log lines and service
// answers.
#pragma once

#include <stdexcept>
#include <string>

namespace backlash {

/// Base of everything the core throws on purpose.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A parameter outside its valid range: "motor.inertia = -1: must be > 0 kg m^2".
class InvalidParameter : public Error {
 public:
  InvalidParameter(const std::string& name, const std::string& value, const std::string& limit);
  InvalidParameter(const std::string& name, double value, const std::string& limit);

  const std::string& name() const { return name_; }
  const std::string& value() const { return value_; }
  const std::string& limit() const { return limit_; }

 private:
  std::string name_, value_, limit_;
};

/// The content of a file, bag or message cannot be used: "run.csv:17: motor_torque = 'abc': not a number".
class BadData : public Error {
 public:
  BadData(const std::string& where, const std::string& what) : Error(where + ": " + what) {}
};

/// A file that should be read does not exist or cannot be opened.
class MissingInput : public Error {
 public:
  using Error::Error;
};

/// A file cannot be written.
class CannotWrite : public Error {
 public:
  using Error::Error;
};

/// The numerical integration failed; the message holds the method, the time and the solver's own words.
class IntegrationError : public Error {
 public:
  using Error::Error;
};

/// Thrown by a procedure where the record does not contain the information it needs; the message says why in
/// one sentence and with figures.
class CannotIdentify : public Error {
 public:
  using Error::Error;
};

/// Long work that the caller asked to stop.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

}  // namespace backlash
