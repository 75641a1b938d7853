// SPDX-License-Identifier: BSD-3-Clause
// What the pages for people share: one self-contained HTML file each, with the plots inside, that says how it
// came about and how to make it again. It loads nothing.
#pragma once

#include <string>
#include <vector>

namespace backlash::report {

/// A file that went into a result: what it is for ("rig") and its path.
struct UsedFile {
  std::string what, path;
};

/// How a result came about.
struct Provenance {
  std::vector<std::string> command;  // words, the first one is a command of this package
  std::vector<UsedFile> files;
  std::string rig_source, rig_text;  // the rig file as read; empty: none
  std::string seeds;                 // what was drawn at random; empty: nothing
};

/// Sections on the rig, the files with their digests, versions and the command that repeats all.
std::string provenance_sections(const Provenance& provenance);

/// Section on the warnings, if only to say that there are none.
std::string warnings_section(const std::vector<std::string>& warnings);

/// The command for a shell: the folder it was given in, then its words, quoted where they need it.
std::string shell_command(const std::vector<std::string>& words);

/// Runs a script of this package, which writes its plots as JSON to the path after --out
/// (scripts/plotting.py), and returns them as HTML; no_figures() where it fails.
std::string drawn_figures(const std::string& script, const std::vector<std::string>& arguments);

/// The sentence that says why there are no plots.
std::string no_figures(const std::string& reason);

/// The whole page; `body` is HTML.
std::string report_page(const std::string& title, const std::string& body);

}  // namespace backlash::report
