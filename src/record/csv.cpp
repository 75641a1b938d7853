// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/csv.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <istream>
#include <iterator>
#include <map>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash::record {
namespace {

const std::string kTimeColumn = "time";
constexpr char kSeparator = ',';

std::vector<std::string> required_names() {
  std::vector<std::string> names;
  for (const Channel channel : kBacklashChannels) names.push_back(channel_name(channel));
  return names;
}

bool has_required_channel(const std::vector<Channel>& channels) {
  return std::any_of(channels.begin(), channels.end(), [](Channel channel) {
    return std::find(kBacklashChannels.begin(), kBacklashChannels.end(), channel) != kBacklashChannels.end();
  });
}

std::string in_quotes(std::string_view text) {
  return "'" + printable(text) + "'";
}

// Lines of a stream in pieces of bounded size: a device or a file without line ends must not fill the memory.
class LineReader {
 public:
  LineReader(std::istream& in, const std::string& name)
      : in_(in), name_(name), buffer_(std::size_t{1} << 16, '\0') {}

  // The next line without its end; valid until the next call. False at the end of the stream.
  bool next(std::string_view& line) {
    ++number_;
    const char* newline = find_newline();
    while (newline == nullptr && refill()) newline = find_newline();
    const std::size_t length =
        newline != nullptr ? static_cast<std::size_t>(newline - buffer_.data()) - begin_ : filled_ - begin_;
    if (length > kLongestCsvLine) {
      fail("line is longer than " + std::to_string(kLongestCsvLine) + " bytes");
    }
    if (newline == nullptr && begin_ == filled_) return false;
    const char* const start = buffer_.data() + begin_;
    const char* const end = newline != nullptr ? newline : buffer_.data() + filled_;
    begin_ = static_cast<std::size_t>(end - buffer_.data()) + (newline != nullptr ? 1 : 0);
    line = std::string_view(start, static_cast<std::size_t>(end - start));
    if (line.find('\0') != std::string_view::npos) fail("contains a NUL byte: not a text file in UTF-8");
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (number_ == 1 && line.substr(0, 3) == "\xef\xbb\xbf") line.remove_prefix(3);
    return true;
  }

  std::size_t number() const { return number_; }

  [[noreturn]] void fail(const std::string& reason) const {
    throw BadData(name_ + ":" + std::to_string(number_), reason);
  }

 private:
  const char* find_newline() const {
    return static_cast<const char*>(std::memchr(buffer_.data() + begin_, '\n', filled_ - begin_));
  }

  // Reads more behind what is there; false where there is no more or the line is too long already.
  bool refill() {
    std::memmove(buffer_.data(), buffer_.data() + begin_, filled_ - begin_);
    filled_ -= begin_;
    begin_ = 0;
    if (filled_ > kLongestCsvLine) return false;
    if (filled_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
    in_.read(buffer_.data() + filled_, static_cast<std::streamsize>(buffer_.size() - filled_));
    const auto count = static_cast<std::size_t>(in_.gcount());
    filled_ += count;
    if (in_.bad()) fail("cannot be read further");
    return count > 0;
  }

  std::istream& in_;
  const std::string name_;
  std::string buffer_;
  std::size_t begin_ = 0, filled_ = 0, number_ = 0;
};

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (;;) {
    const auto comma = line.find(kSeparator);
    fields.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

class Reader {
 public:
  Reader(std::istream& in, const std::string& name) : lines_(in, name), name_(name) {}

  std::vector<JointRecord> read() {
    read_header();
    read_rows();
    if (time_.empty()) throw BadData(name_, "no data: there are only column names");
    Record& first = joints_.front().record;
    const std::string repeated = stamps_.describe("line " + std::to_string(first_repeated_line_));
    if (!repeated.empty()) first.warnings.push_back(repeated);
    for (std::string& warning : describe_time_base(time_)) first.warnings.push_back(std::move(warning));
    for (JointRecord& joint : joints_) joint.record.time = time_;
    return {std::make_move_iterator(joints_.begin()), std::make_move_iterator(joints_.end())};
  }

 private:
  void read_header() {
    std::string_view line;
    if (!lines_.next(line)) throw BadData(name_ + ":1", "empty, expected column names");
    if (trimmed(line).empty()) lines_.fail("an empty line, expected column names");
    split(line, fields_);
    refuse_other_separator();
    for (const std::string_view field : fields_) add_column(std::string(field));
    if (time_column_ == kNone) lines_.fail("no column 'time'; there are: " + joined(names_));
    for (const JointRecord& joint : joints_) check_channels(joint);
    if (joints_.empty()) check_channels({});
  }

  void check_channels(const JointRecord& joint) const {
    if (!has_required_channel(channels_.count(joint.joint) ? channels_.at(joint.joint)
                                                           : std::vector<Channel>())) {
      lines_.fail((joint.joint.empty() ? "" : "joint " + in_quotes(joint.joint) + ": ") +
                  "no torque, position, speed of the motor, current or acceleration: needs at least one of " +
                  joined(required_names()) + "; there are: " + joined(names_));
    }
  }

  void add_column(const std::string& name) {
    if (name.empty()) lines_.fail("column " + std::to_string(names_.size() + 1) + " has no name");
    if (std::find(names_.begin(), names_.end(), name) != names_.end()) {
      lines_.fail("column = " + in_quotes(name) + ": there twice");
    }
    if (name == kTimeColumn) {
      time_column_ = names_.size();
      targets_.push_back(nullptr);
    } else {
      const auto slash = name.rfind('/');
      const std::string joint = slash == std::string::npos ? "" : name.substr(0, slash);
      const std::string channel = slash == std::string::npos ? name : name.substr(slash + 1);
      const auto known = std::find_if(kChannels.begin(), kChannels.end(),
                                      [&](Channel c) { return channel_name(c) == channel; });
      if (known == kChannels.end() || slash == 0) fail_unknown_column(name);
      channels_[joint].push_back(*known);
      targets_.push_back(&record_of(joint).column(*known));
    }
    names_.push_back(name);
  }

  Record& record_of(const std::string& joint) {
    const auto known =
        std::find_if(joints_.begin(), joints_.end(), [&](const JointRecord& j) { return j.joint == joint; });
    if (known != joints_.end()) return known->record;
    if (!joints_.empty() && (joint.empty() || joints_.front().joint.empty()))
      lines_.fail("some columns name their joint and some do not: all or none must (JOINT/channel)");
    joints_.push_back({joint, {}});
    joints_.back().record.name = name_;
    return joints_.back().record;
  }

  [[noreturn]] void fail_unknown_column(const std::string& name) const {
    std::string known = kTimeColumn;
    for (const Channel channel : kChannels) known += ", " + channel_name(channel);
    lines_.fail("column = " + in_quotes(name) + ": unknown, known are " + known);
  }

  // A tab beside a field is a space; one within it separates.
  void refuse_other_separator() const {
    for (const std::string_view field : fields_) {
      const auto place = field.find_first_of(";\t");
      if (place == std::string_view::npos) continue;
      lines_.fail(std::string("separator is '") + (field[place] == ';' ? ";" : "\\t") + "', expected ','");
    }
  }

  void read_rows() {
    std::string_view line;
    std::size_t empty_line = 0;
    while (lines_.next(line)) {
      if (trimmed(line).empty()) {
        if (empty_line == 0) empty_line = lines_.number();
        continue;
      }
      if (empty_line != 0) {
        throw BadData(name_ + ":" + std::to_string(empty_line), "an empty line amid the data");
      }
      read_row(line);
    }
  }

  void read_row(std::string_view line) {
    split(line, fields_);
    if (fields_.size() != names_.size()) {
      refuse_other_separator();
      lines_.fail(std::to_string(fields_.size()) + (fields_.size() == 1 ? " field" : " fields") + " in " +
                  in_quotes(line) + ", expected " + std::to_string(names_.size()) + ": " + joined(names_));
    }
    values_.resize(fields_.size());
    for (std::size_t i = 0; i < fields_.size(); ++i) values_[i] = read_field(i);
    if (!accept_stamp(values_[time_column_])) return;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (i != time_column_) targets_[i]->push_back(values_[i]);
    }
  }

  double read_field(std::size_t i) const {
    const ParsedNumber number = parse_number(fields_[i]);
    if (number) return number.value;
    lines_.fail(names_[i] + " = " + in_quotes(fields_[i]) + ": " +
                (fields_[i].empty() ? "empty" : number.problem));
  }

  bool accept_stamp(double stamp) {
    switch (stamps_.next(stamp)) {
      case StampVerdict::accept:
        time_.push_back(stamp);
        return true;
      case StampVerdict::repeated:
        if (first_repeated_line_ == 0) first_repeated_line_ = lines_.number();
        return false;
      case StampVerdict::backwards:
        break;
    }
    lines_.fail("time = " + in_quotes(fields_[time_column_]) + ": goes back, the row before has " +
                to_text(stamps_.last()));
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  LineReader lines_;
  const std::string name_;
  std::deque<JointRecord> joints_;  // targets_ point into them
  std::vector<double> time_;
  std::vector<std::string> names_;
  std::map<std::string, std::vector<Channel>> channels_;  // of each joint
  std::vector<std::vector<double>*> targets_;             // one per column, nullptr for time
  std::size_t time_column_ = kNone;
  std::vector<std::string_view> fields_;
  std::vector<double> values_;
  StampChecker stamps_;
  std::size_t first_repeated_line_ = 0;
};

std::vector<Channel> present_channels(const Record& record) {
  std::vector<Channel> present;
  for (const Channel channel : kChannels) {
    if (record.has(channel)) present.push_back(channel);
  }
  return present;
}

void check_writable(const Record& record, const std::vector<Channel>& channels) {
  if (record.time.empty()) throw BadData(record.name, "a record without samples cannot be written");
  if (!has_required_channel(channels)) {
    throw BadData(record.name,
                  "a record needs at least one of " + joined(required_names()) + " to be written");
  }
  for (const Channel channel : channels) {
    const std::vector<double>& column = record.column(channel);
    if (column.size() != record.size()) {
      throw BadData(record.name, channel_name(channel) + " has " + std::to_string(column.size()) +
                                     " values, time has " + std::to_string(record.size()));
    }
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (std::isfinite(column[i])) continue;
      throw BadData(record.name, channel_name(channel) + " = " + to_text(column[i]) + " in sample " +
                                     std::to_string(i) + ": not a finite number");
    }
  }
}

// The stamps as they will be read back, which must still increase.
std::vector<std::string> stamp_texts(const Record& record) {
  std::vector<std::string> texts(record.size());
  StampChecker stamps;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const auto fail = [&](const char* reason) {
      throw BadData(record.name, "time = " + to_text(record.time[i]) + " s in sample " + std::to_string(i) +
                                     ": " + reason);
    };
    if (!std::isfinite(record.time[i])) fail("not a finite number");
    texts[i] = time_text(record.time[i]);
    if (stamps.next(parse_number(texts[i]).value) != StampVerdict::accept) {
      fail("does not increase by at least 1 ns");
    }
  }
  return texts;
}

}  // namespace

Record read_csv(const std::string& path) {
  std::ifstream in = open_input(path);
  return read_csv(in, path);
}

Record read_csv(std::istream& in, const std::string& name) {
  return record_of_joint(read_joints_csv(in, name), "", name);
}

std::vector<JointRecord> read_joints_csv(const std::string& path) {
  std::ifstream in = open_input(path);
  return read_joints_csv(in, path);
}

std::vector<JointRecord> read_joints_csv(std::istream& in, const std::string& name) {
  return Reader(in, name).read();
}

Record record_of_joint(std::vector<JointRecord> joints, const std::string& joint, const std::string& name) {
  if (joints.size() == 1 && (joints.front().joint.empty() || joint.empty()))
    return std::move(joints.front().record);
  std::vector<std::string> names;
  for (JointRecord& j : joints) {
    names.push_back(j.joint);
    if (j.joint != joint || joint.empty()) continue;
    j.record.warnings.insert(j.record.warnings.begin(), joints.front().record.warnings.begin(),
                             &j == &joints.front() ? joints.front().record.warnings.begin()
                                                   : joints.front().record.warnings.end());
    return std::move(j.record);
  }
  throw BadData(name, "several joints: " + joined(names) +
                          (joint.empty() ? "; the command looks at one, which the rig file names (joint:)"
                                         : "; the rig file asks for joint " + in_quotes(joint)));
}

void write_csv(const Record& record, const std::string& path) {
  write_joints_csv({{"", record}}, path);
}

void write_joints_csv(const std::vector<JointRecord>& joints, const std::string& path) {
  if (joints.empty()) throw BadData(path, "a record without joints cannot be written");
  const Record& first = joints.front().record;
  std::string content = kTimeColumn;
  std::vector<const std::vector<double>*> columns;
  for (const JointRecord& joint : joints) {
    const std::vector<Channel> channels = present_channels(joint.record);
    check_writable(joint.record, channels);
    if (joint.record.time != first.time)
      throw BadData(path, joint.joint + ": has other times than the first joint");
    for (const Channel channel : channels) {
      content += kSeparator + (joint.joint.empty() ? "" : joint.joint + "/") + channel_name(channel);
      columns.push_back(&joint.record.column(channel));
    }
  }
  const std::vector<std::string> stamps = stamp_texts(first);
  content += '\n';
  for (std::size_t i = 0; i < first.size(); ++i) {
    content += stamps[i];
    for (const std::vector<double>* column : columns) {
      content += kSeparator;
      content += to_text((*column)[i]);
    }
    content += '\n';
  }
  write_file(path, content);
}

}  // namespace backlash::record
