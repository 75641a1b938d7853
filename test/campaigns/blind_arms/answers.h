// SPDX-License-Identifier: BSD-3-Clause
// Shared by the questions: records that are made once, and answers that are written down.
#pragma once

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "backlash_diagnosis/arm/motion.h"
#include "blind_arm.h"
#include "questions.h"

namespace blind_arms {

/// The kind of the i-th arm: each in turn, or the one that was asked for. Throws std::invalid_argument.
std::string kind_of(const Options& options, const std::vector<Kind>& known, int i);

/// Folder of an arm's files, which are made where they are not there yet.
std::string files_of(const Options& options, const Arm& arm, const Arm& before, const std::string& kind);

/// Path of a record of that folder, which is made where it is not there yet.
std::string record_of(const Options& options, const Arm& arm, const std::string& folder, int number);

/// As the package's commands read it. Throws as they do.
backlash::arm::ArmRecord read_record(const std::string& path, const backlash::arm::ArmRig& rig);

/// Reasons why nothing was reported, without their figures.
class Reasons {
 public:
  void add(const std::string& message);
  void print() const;

 private:
  std::map<std::string, int> all_;
};

/// One line of JSON per answer; nothing where no file was asked for.
class AnswerFile {
 public:
  explicit AnswerFile(const std::string& path);
  void add(const nlohmann::ordered_json& answer);

 private:
  std::ofstream out_;
};

}  // namespace blind_arms
