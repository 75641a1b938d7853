// SPDX-License-Identifier: BSD-3-Clause
// Command lines of the tools: one description gives the parser, the help text and the messages.
#pragma once

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash::tools {

/// A command line that cannot be understood; ends the program with kUsage.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "--name VALUE", with a help text that states unit and default; "--name" alone where `value` is empty,
/// "--name A B C" where it ends in dots ("RECORD..."). One that is `repeated` may be there several times,
/// with one value each.
struct Option {
  std::string name, value, help;
  bool required = false, repeated = false;
};

struct Command {
  std::string name;
  std::string summary;  ///< one sentence
  /// "RIG.yaml", required; "[RIG.yaml]" may be absent; "RECORD..." as the last: one or more
  std::vector<std::string> positional;
  std::vector<Option> options;
  std::string notes;                  ///< paragraphs after the options
  std::vector<std::string> examples;  ///< without "rosrun backlash_diagnosis"
  std::string exit_codes;             ///< lines "  0  done"; those of all commands are added
};

/// What the user wrote. The readers throw UsageError naming option, value and limit.
class Arguments {
 public:
  Arguments(std::vector<std::string> words, std::vector<std::string> positional,
            std::map<std::string, std::vector<std::string>> options)
      : words_(std::move(words)), positional_(std::move(positional)), options_(std::move(options)) {}

  const std::vector<std::string>& words() const { return words_; }  ///< as given

  const std::string& positional(std::size_t i) const { return positional_.at(i); }
  const std::vector<std::string>& positionals() const { return positional_; }
  bool has(const std::string& option) const { return options_.count(option) > 0; }
  std::string text(const std::string& option) const;  ///< empty where absent, never where a value is given
  /// Of one that is required or there.
  const std::vector<std::string>& texts(const std::string& option) const;
  double number(const std::string& option, double absent, const Range& range) const;
  std::uint64_t integer(const std::string& option, std::uint64_t absent, std::uint64_t lower,
                        std::uint64_t upper) const;

 private:
  std::vector<std::string> words_, positional_;
  std::map<std::string, std::vector<std::string>> options_;
};

/// Throws UsageError. --help and --version are the business of run_command.
Arguments parse_arguments(const Command& command, const std::vector<std::string>& words);

std::string help_text(const Command& command);

/// A main(): parses, answers --help and --version, calls `body` and turns exceptions into messages and exit
/// codes.
int run_command(const Command& command, int argc, char** argv, int (*body)(const Arguments&));

}  // namespace backlash::tools
