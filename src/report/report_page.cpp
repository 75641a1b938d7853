// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/report_page.h"

#include <filesystem>
#include <iterator>

#include "backlash_diagnosis/base/digest.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/version.h"
#include "backlash_diagnosis/report/html.h"
#include "backlash_diagnosis/report/script.h"

namespace backlash {
namespace {

const char* const kStyle = R"(
* { box-sizing: border-box; }
body { font: 15px/1.5 sans-serif; color: #222; max-width: 76em; margin: 2em auto; padding: 0 1.2em; }
h1 { font-size: 1.5em; overflow-wrap: anywhere; }
h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ccc; }
h3 { font-size: 1em; margin: 1.2em 0 0.3em; }
table { border-collapse: collapse; } th, td { text-align: left; vertical-align: top; padding: 0.3em 1em 0.3em 0; }
th { font-weight: normal; color: #666; white-space: nowrap; } tr + tr td { border-top: 1px solid #eee; }
.scroll { overflow-x: auto; }
.verdict { border-left: 0.5em solid #888; padding: 0.5em 1em; background: #f6f6f6; overflow-wrap: anywhere; }
.good, .nothing_missing { border-color: #2a8a3e; } .watch, .effect_found { border-color: #d98200; }
.service, .stop, .unexplained { border-color: #b3261e; } .cannot_tell { border-color: #888; }
.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
.text { min-width: 18em; overflow-wrap: anywhere; } .facts .text { min-width: 0; } .together td { font-weight: bold; }
.bars td { padding-top: 0; padding-bottom: 0; border: 0; } .bars .wide { width: 32em; }
.bar { height: 0.9em; min-width: 1px; }
.before { background: #9aa7b5; } .after { background: #1f6fb4; } .floor { background: #d5d5d5; }
.small { color: #666; font-size: 0.9em; overflow-wrap: anywhere; }
pre { background: #f6f6f6; padding: 0.8em 1em; margin: 0.5em 0; max-height: 32em; overflow: auto; font-size: 0.85em; }
pre.command { white-space: pre-wrap; overflow-wrap: anywhere; }
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 28em), 1fr)); gap: 0.5em 1.5em; }
figure { margin: 0.5em 0; } figure img { display: block; width: 100%; max-width: 46em; height: auto; }
figcaption { color: #666; font-size: 0.9em; }
)";

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
  std::string text;
  if (!p.rig_text.empty())
    text += html_tag("h2", "Rig") + "\n" + html_tag("p", html_text(p.rig_source), "class=\"small\"") + "\n" +
            html_tag("pre", html_text(p.rig_text), "id=\"rig\"") + "\n";
  std::string rows = html_heads({"file", "path", "digest (FNV-1a, 64 bits)"});
  for (const UsedFile& file : p.files)
    rows += html_row(html_cell(html_text(file.what)) + html_cell(html_text(file.path), "text") +
                     html_cell(digest_text(file.path), "number"));
  text += html_tag("h2", "How this came about") + "\n" + html_table(rows) +
          html_tag("p",
                   "backlash_diagnosis " + std::string(version()) + ", built with " +
                       html_text(built_with()) + "." + (p.seeds.empty() ? "" : " " + html_text(p.seeds)),
                   "id=\"versions\"") +
          "\n" + html_tag("p", "The same again:") + "\n" +
          html_tag("pre", html_text(shell_command(p.command)), "id=\"command\" class=\"command\"") + "\n";
  return text;
}

std::string drawn_figures(const std::string& script, const std::vector<std::string>& arguments) {
  try {
    const ScratchFolder scratch;
    const std::string out = scratch.path("figures.html");
    std::vector<std::string> words = {"--out", out};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const int code = run_script(script, words);
    if (code != 0)
      throw Error(script + " ended with exit code " + std::to_string(code) +
                  (code == 70 ? ": matplotlib or numpy is missing (Debian: python3-matplotlib)" : ""));
    std::ifstream in = open_input(out);
    return {std::istreambuf_iterator<char>(in), {}};
  } catch (const Error& error) {
    return "<p>No plots were drawn: " + html_text(error.what()) + ".</p>\n";
  }
}

std::string report_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         // nothing is loaded, and a page that something was smuggled into runs nothing
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
         "style-src 'unsafe-inline'\">\n" +
         html_tag("title", html_text(title)) + "\n" + html_tag("style", kStyle) + "\n</head>\n<body>\n" +
         html_tag("h1", html_text(title)) + "\n" + body + "</body>\n</html>\n";
}

}  // namespace backlash
