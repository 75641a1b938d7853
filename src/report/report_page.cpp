// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/report_page.h"

#include <fmt/format.h>

#include <filesystem>

#include "backlash_diagnosis/base/digest.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/report/script.h"
#include "html_template.h"

namespace backlash::report {
namespace {

/// So that a shell reads it as one word.
std::string quoted(const std::string& word) {
  const char* const plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_@%+=:,./-";  // mean nothing to a shell
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) c == '\'' ? text += "'\\''" : text += c;
  return text + "'";
}

std::string digest_text(const std::string& path) {
  try {
    return file_digest(path);
  } catch (const Error&) {
    return "not there any more";
  }
}

}  // namespace

std::string shell_command(const std::vector<std::string>& words) {
  std::error_code ignored;
  std::string text =
      "cd " + quoted(std::filesystem::current_path(ignored).string()) + " &&\nrosrun backlash_diagnosis";
  for (const std::string& word : words) text += " " + quoted(word);
  return text;
}

std::string provenance_sections(const Provenance& p) {
  Json data = {
      {"rig", p.rig_text.empty() ? Json(nullptr) : Json{{"source", p.rig_source}, {"text", p.rig_text}}},
      {"files", Json::array()},
      {"has_files", !p.files.empty()},
      {"version", version()},
      {"built_with", built_with()},
      {"seeds", p.seeds},
      {"command", shell_command(p.command)}};
  for (const UsedFile& file : p.files)
    data["files"].push_back({{"what", file.what}, {"path", file.path}, {"digest", digest_text(file.path)}});
  return filled(kProvenanceTemplate, data);
}

std::string warnings_section(const std::vector<std::string>& warnings) {
  return filled(kWarningsTemplate, {{"has_warnings", !warnings.empty()}, {"warnings", warnings}});
}

std::string drawn_figures(const std::string& script, const std::vector<std::string>& arguments) {
  try {
    const ScratchFolder scratch;
    const std::string out = scratch.path("figures.json");
    std::vector<std::string> words = {"--out", out};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const int code = run_script(script, words);
    if (code != 0)
      throw Error(
          fmt::format("{} ended with exit code {}{}", script, code,
                      code == 70 ? ": matplotlib or numpy is missing (Debian: python3-matplotlib)" : ""));
    std::ifstream in = open_input(out);
    return filled(kFiguresTemplate, Json::parse(in));
  } catch (const Error& error) {
    return no_figures(error.what());
  } catch (const Json::exception& error) {
    return no_figures(script + ": " + error.what());
  }
}

std::string no_figures(const std::string& reason) {
  return filled("<p>No plots were drawn: {{reason}}.</p>\n", {{"reason", reason}});
}

std::string report_page(const std::string& title, const std::string& body) {
  return filled(kPageTemplate, {{"title", title}, {"body", body}});
}

}  // namespace backlash::report
