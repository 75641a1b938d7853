// SPDX-License-Identifier: BSD-3-Clause
#include "answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "backlash_diagnosis/record/csv.h"
#include "record.h"

namespace blind_arms {

namespace fs = std::filesystem;

std::string kind_of(const Options& options, const std::vector<Kind>& known, int i) {
  if (options.kind == "all") return known[std::size_t(i) % known.size()].name;
  const auto is = [&](const Kind& k) { return k.name == options.kind; };
  if (std::none_of(known.begin(), known.end(), is))
    throw std::invalid_argument("--kind " + options.kind + ": not known");
  return options.kind;
}

std::string files_of(const Options& options, const Arm& arm, const Arm& before, const std::string& kind) {
  const std::string folder = fmt::format("{}/{}_{}", options.out, arm.seed, kind);
  fs::create_directories(folder);
  write_files(arm, before, folder);
  return folder;
}

std::string record_of(const Options& options, const Arm& arm, const std::string& folder, int number) {
  std::string path = fmt::format("{}/record{}.csv", folder, number);
  if (fs::exists(path)) return path;
  make_record(arm, options.duration, number, path + ".part");
  fs::rename(path + ".part", path);  // whole or not at all
  return path;
}

backlash::arm::ArmRecord read_record(const std::string& path, const backlash::arm::ArmRig& rig) {
  return backlash::arm::arm_record(backlash::record::read_joints_csv(path), rig, fs::path(path).filename());
}

void Reasons::add(const std::string& message) {
  std::string words;
  for (const char c : message.substr(0, message.find('(')))
    if (std::isdigit(static_cast<unsigned char>(c)) == 0 && words.size() < 70) words += c;
  ++all_[words];
}

void Reasons::print() const {
  std::vector<std::pair<int, std::string>> sorted;
  for (const auto& [words, count] : all_) sorted.emplace_back(-count, words);
  std::sort(sorted.begin(), sorted.end());
  for (const auto& [count, words] : sorted) fmt::print("{:5} {}\n", -count, words);
}

AnswerFile::AnswerFile(const std::string& path) {
  if (!path.empty()) out_.open(path, std::ios::app);
}

void AnswerFile::add(const nlohmann::ordered_json& answer) {
  if (out_.is_open()) out_ << answer.dump() << std::endl;
}

}  // namespace blind_arms
