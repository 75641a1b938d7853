// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/change_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/utc.h"

namespace backlash::diagnosis {
namespace {

const std::string kHeader =
    "seen,date,id,state,effect,since,since_from,since_to,until,size,equivalent_to,gain,error_before,"
    "error_after,";
constexpr std::size_t kCells = 14;

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

/// Empty where not known.
std::string cell(double value) {
  return std::isfinite(value) ? to_text(value) : "";
}

/// "name=value+-standard error unit; ..."
std::string size_text(const FoundChange& change) {
  std::string text;
  for (const FoundSize& s : change.size)
    text += (text.empty() ? "" : "; ") + s.name + "=" + cell(s.value) + "+-" + cell(s.standard_error) + " " +
            s.unit;
  return text;
}

std::string line_of(const KnownChange& k) {
  const FoundChange& f = k.found;
  std::string alike;
  for (const std::string& e : f.equivalent_to) alike += (alike.empty() ? "" : "; ") + e;
  return to_text(k.seen) + "," + utc_time(k.seen) + "," + std::to_string(k.id) + "," + to_string(k.state) +
         "," + (f.joint.empty() ? "" : f.joint + " ") + f.effect + "," + to_text(f.since) + "," +
         to_text(f.since_from) + "," + to_text(f.since_to) + "," + (f.until ? to_text(*f.until) : "") + "," +
         size_text(f) + "," + alike + "," + cell(f.gain) + "," + cell(f.error_before) + "," +
         cell(f.error_after) + ",\n";  // a cut line lacks the last comma
}

double number(const std::string& text, const std::string& where) {
  if (text.empty()) return kNaN;
  const ParsedNumber parsed = parse_number(trimmed(text));
  if (!parsed) throw BadData(where, "'" + printable(text) + "': " + parsed.problem);
  return parsed.value;
}

FoundSize size_from(const std::string& text, const std::string& where) {
  const std::size_t equal = text.find('='), error = text.find("+-"), unit = text.find(' ', error);
  if (equal == std::string::npos || error == std::string::npos || unit == std::string::npos)
    throw BadData(where, "'" + printable(text) + "': not name=value+-error unit");
  FoundSize size;
  size.name = text.substr(0, equal);
  size.value = number(text.substr(equal + 1, error - equal - 1), where);
  size.standard_error = number(text.substr(error + 2, unit - error - 2), where);
  size.unit = text.substr(unit + 1);
  return size;
}

KnownChange change_from(const std::string& line, const std::string& where) {
  const std::vector<std::string> cells = split(line, ',');
  if (cells.size() != kCells)
    throw BadData(where, "has " + std::to_string(cells.size()) + " of " + std::to_string(kCells) + " cells");
  KnownChange k;
  k.seen = number(cells[0], where);
  k.id = static_cast<long>(number(cells[2], where));
  const auto state = change_state_from(cells[3]);
  if (!state || k.id < 1) throw BadData(where, "'" + printable(cells[2] + "," + cells[3]) + "': no change");
  k.state = *state;
  FoundChange& f = k.found;
  const std::size_t space = cells[4].rfind(' ');  // "JOINT EFFECT" of an arm
  if (space != std::string::npos) f.joint = cells[4].substr(0, space);
  f.effect = cells[4].substr(space + 1);
  f.since = number(cells[5], where);
  f.since_from = number(cells[6], where);
  f.since_to = number(cells[7], where);
  if (!cells[8].empty()) f.until = number(cells[8], where);
  for (const std::string& part : split(cells[9], ';'))
    f.size.push_back(size_from(std::string(trimmed(part)), where));
  for (const std::string& part : split(cells[10], ';')) f.equivalent_to.emplace_back(trimmed(part));
  f.gain = number(cells[11], where);
  f.error_before = number(cells[12], where);
  f.error_after = number(cells[13], where);
  return k;
}

}  // namespace

void append_change(const std::string& path, const KnownChange& change) {
  const auto fail = [&] { throw CannotWrite(path + ": cannot be written: " + std::strerror(errno)); };
  const int file = ::open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0) fail();
  const off_t size = ::lseek(file, 0, SEEK_END);
  std::string text = size == 0 ? kHeader + "\n" : "";
  char last = '\n';
  if (size > 0 && ::pread(file, &last, 1, size - 1) == 1 && last != '\n') text = "\n";  // ends a cut line
  text += line_of(change);
  const bool written =
      ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(file) == 0;
  const int error = errno;
  ::close(file);
  errno = error;
  if (!written) fail();
}

std::vector<KnownChange> read_change_log(const std::string& path) {
  if (!std::filesystem::exists(path)) return {};
  std::ifstream in = open_input(path);
  std::map<long, KnownChange> latest;
  std::string line;
  for (long number = 1; std::getline(in, line); ++number) {
    const std::string where = path + ":" + std::to_string(number);
    if (number == 1) {
      if (line != kHeader) throw BadData(where, "is no list of changes: '" + printable(line) + "'");
      continue;
    }
    try {
      const KnownChange k = change_from(line, where);
      latest[k.id] = k;
    } catch (const BadData&) {
      if (!line.empty() && line.back() == ',') throw;  // a whole line; one that was cut off is left out
    }
  }
  std::vector<KnownChange> all;
  for (const auto& [id, change] : latest) all.push_back(change);
  return all;
}

}  // namespace backlash::diagnosis
