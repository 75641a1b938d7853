// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/command_line.h"

#include <algorithm>
#include <boost/program_options.hpp>
#include <charconv>
#include <iostream>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/memory.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "tools/common/exit_codes.h"

namespace backlash::tools {
namespace {

namespace po = boost::program_options;

const std::string kPackage = "backlash_diagnosis";
const std::string kPositional = "positional argument";  // with a space, so that nobody writes it as an option
const std::string kCommonExitCodes =
    "  64  usage: unknown or missing option, wrong number\n"
    "  65  bad input data\n"
    "  66  input missing\n"
    "  70  internal error\n"
    "  73  cannot write\n";

/// Whether "RECORD..." and not "RECORD".
bool has_dots(const std::string& value) {
  const std::string dots = "...";
  return value.size() > dots.size() && value.compare(value.size() - dots.size(), dots.size(), dots) == 0;
}

[[noreturn]] void fail_option(const std::string& option, const std::string& value,
                              const std::string& reason) {
  throw UsageError("--" + option + " = '" + printable(value) + "': " + reason);
}

po::options_description described(const Command& command) {
  po::options_description all;
  for (const Option& option : command.options) {
    if (option.value.empty())
      all.add_options()(option.name.c_str(), "");
    else if (has_dots(option.value))
      all.add_options()(option.name.c_str(), po::value<std::vector<std::string>>()->multitoken()->composing(),
                        "");
    else if (option.repeated)
      all.add_options()(option.name.c_str(), po::value<std::vector<std::string>>()->composing(), "");
    else
      all.add_options()(option.name.c_str(), po::value<std::string>(), "");
  }
  all.add_options()(kPositional.c_str(), po::value<std::vector<std::string>>(), "");
  return all;
}

void append_wrapped(std::string& text, const std::string& words, std::size_t indent) {
  constexpr std::size_t kWidth = 100;
  std::istringstream in(words);
  std::size_t column = indent;
  for (std::string word; in >> word; column += word.size() + 1) {
    if (column > indent && column + word.size() > kWidth) {
      text.back() = '\n';
      text += std::string(indent, ' ');
      column = indent;
    }
    text += word + " ";
  }
  text.back() = '\n';
}

void append_option(std::string& text, const std::string& head, const std::string& help) {
  constexpr std::size_t kIndent = 26;
  text += "  " + head;
  text += head.size() + 3 > kIndent ? "\n" + std::string(kIndent, ' ')
                                    : std::string(kIndent - head.size() - 2, ' ');
  append_wrapped(text, help, kIndent);
}

std::string spelling(const Option& option) {
  return "--" + option.name + (option.value.empty() ? "" : " " + option.value);
}

bool takes_more(const Command& command) {
  return !command.positional.empty() && has_dots(command.positional.back());
}

std::vector<std::string> values_of(const Option& option, const po::variable_value& given) {
  if (option.value.empty()) return {""};
  std::vector<std::string> values;
  if (has_dots(option.value) || option.repeated)
    values = given.as<std::vector<std::string>>();
  else
    values = {given.as<std::string>()};
  for (const std::string& value : values)
    if (value.empty()) throw UsageError("--" + option.name + " is empty");
  return values;
}

std::string usage_line(const Command& command) {
  std::string line = "Usage: " + command.name;
  for (const std::string& name : command.positional) line += " " + name;
  for (const Option& option : command.options) {
    const std::string part = spelling(option);
    line += option.required ? " " + part : " [" + part + "]";
  }
  return line;
}

void finish_output() {
  if (!std::cout.flush()) throw CannotWrite("standard output: cannot be written");
}

int answer(const Command& command, const std::vector<std::string>& words, int (*body)(const Arguments&)) {
  const auto asks = [&words](const char* option) {
    return std::find(words.begin(), words.end(), option) != words.end();
  };
  if (asks("--help") || asks("-h")) {
    std::cout << help_text(command);
    finish_output();
    return kHealthy;
  }
  if (asks("--version")) {
    std::cout << command.name << " (" << kPackage << ") " << version() << '\n';
    finish_output();
    return kHealthy;
  }
  const int code = body(parse_arguments(command, words));
  finish_output();
  return code;
}

}  // namespace

std::string Arguments::text(const std::string& option) const {
  const auto found = options_.find(option);
  return found == options_.end() ? "" : found->second.front();
}

const std::vector<std::string>& Arguments::texts(const std::string& option) const {
  return options_.at(option);
}

double Arguments::number(const std::string& option, double absent, const Range& range) const {
  if (!has(option)) return absent;
  const std::string value = text(option);
  const ParsedNumber number = parse_number(value);
  if (!number) fail_option(option, value, number.problem);
  if (!range.contains(number.value)) fail_option(option, value, range.text());
  return number.value;
}

std::uint64_t Arguments::integer(const std::string& option, std::uint64_t absent, std::uint64_t lower,
                                 std::uint64_t upper) const {
  if (!has(option)) return absent;
  const std::string value = text(option);
  std::uint64_t number = 0;
  const auto result = std::from_chars(value.data(), value.data() + value.size(), number);
  if (result.ec != std::errc() || result.ptr != value.data() + value.size() || number < lower ||
      number > upper)
    fail_option(option, value,
                "must be a whole number from " + std::to_string(lower) + " to " + std::to_string(upper));
  return number;
}

Arguments parse_arguments(const Command& command, const std::vector<std::string>& words) {
  po::variables_map given;
  try {
    const auto style = po::command_line_style::unix_style & ~po::command_line_style::allow_guessing;
    const auto description = described(command);
    po::store(po::command_line_parser(words)
                  .options(description)
                  .positional(po::positional_options_description().add(kPositional.c_str(), -1))
                  .style(style)
                  .run(),
              given);
  } catch (const po::error& e) {
    throw UsageError(e.what());
  }
  std::vector<std::string> positional;
  if (given.count(kPositional)) positional = given[kPositional].as<std::vector<std::string>>();
  if (positional.size() < command.positional.size() && command.positional[positional.size()].front() != '[')
    throw UsageError("missing " + command.positional[positional.size()]);
  if (positional.size() > command.positional.size() && !takes_more(command))
    throw UsageError("unexpected argument '" + printable(positional[command.positional.size()]) + "'");
  for (std::size_t i = 0; i < positional.size(); ++i)
    if (positional[i].empty())
      throw UsageError(command.positional[std::min(i, command.positional.size() - 1)] + " is empty");
  std::map<std::string, std::vector<std::string>> options;
  for (const Option& option : command.options) {
    if (given.count(option.name))
      options[option.name] = values_of(option, given[option.name]);
    else if (option.required)
      throw UsageError("missing " + spelling(option));
  }
  return {words, std::move(positional), std::move(options)};
}

std::string help_text(const Command& command) {
  std::string text;
  append_wrapped(text, usage_line(command), 0);
  text += "\n";
  append_wrapped(text, command.summary, 0);
  text += "\nOptions:\n";
  for (const Option& option : command.options) append_option(text, spelling(option), option.help);
  append_option(text, "--help", "show this text");
  append_option(text, "--version", "show the version");
  if (!command.notes.empty()) {
    text += "\n";
    append_wrapped(text, command.notes, 0);
  }
  text += "\nExamples:\n";
  for (const std::string& example : command.examples) text += "  rosrun " + kPackage + " " + example + "\n";
  text += "\nExit codes:\n" + command.exit_codes + kCommonExitCodes;
  return text;
}

int run_command(const Command& command, int argc, char** argv, int (*body)(const Arguments&)) {
  keep_freed_memory();
  const auto fail = [&command](const std::string& message, ExitCode code) {
    std::cerr << command.name << ": " << message << std::endl;
    return static_cast<int>(code);
  };
  try {
    return answer(command, {argv + std::min(argc, 1), argv + argc}, body);
  } catch (const UsageError& e) {
    return fail(std::string(e.what()) + "; see --help", kUsage);
  } catch (const MissingInput& e) {
    return fail(e.what(), kMissingInput);
  } catch (const BadData& e) {
    return fail(e.what(), kBadData);
  } catch (const InvalidParameter& e) {  // options were checked by their readers: this one came from a file
    return fail(e.what(), kBadData);
  } catch (const IntegrationError& e) {  // so did this machine
    return fail(e.what(), kBadData);
  } catch (const CannotWrite& e) {
    return fail(e.what(), kCannotWrite);
  } catch (const std::bad_alloc&) {
    return fail("out of memory", kInternal);
  } catch (const std::exception& e) {
    return fail(std::string("internal error: ") + e.what(), kInternal);
  } catch (...) {
    return fail("internal error of an unknown kind", kInternal);
  }
}

}  // namespace backlash::tools
